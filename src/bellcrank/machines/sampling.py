"""Equilibria of an actuator all over the range in which it will work, to fit a potential to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import qmc

from bellcrank.errors import InvalidSettings
from bellcrank.machines.potential import (
    Potential,
    answers_of,
    fit_potential,
    term_count,
    variables_of,
)
from bellcrank.mechanics import Conditions, Status, follow

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.mechanics import State, Superelement

OVERSHOOT = 0.1
"""Beyond the ends of the stroke, and beyond a free and a blocked output, in parts of the way."""
SIDEWAYS = 0.2
"""How far an input that is a block goes across its direction, in strokes; and how far its edge
goes by turning."""
ASKEW = 0.3
"""Forces on an output that is a block, across that which would bring it back, as a part of it (in
units in which all cost the same energy)."""
PARTS = 5
"""Of the samples: one to choose the degree by, one to measure the error with, the others to fit."""
NOTHING = 1e-12
"""Answers that are all smaller are rounding errors, and none of them is wrong."""
EQUATIONS = 6
"""For each term of a polynomial."""


@dataclass(frozen=True, slots=True, eq=False)
class Reach:
    """The range in which an actuator will work: the further along its stroke, the wider.

    At the part t of the stroke, the variables are ``t (axis + spread r)``, with r (s,) between -1
    and 1.

    Parameters
    ----------
    prescribed : (k,) bool
        Which coordinates are moved; the others are loaded.
    axis : (k,)
        Displacements and forces at the full stroke.
    spread : (k, s)
    """

    prescribed: NDArray[np.bool_]
    axis: NDArray[np.float64]
    spread: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A potential, and what is known of its error.

    Parameters
    ----------
    potential
    degree
        Of the polynomial.
    samples
        Equilibria that it was fitted to.
    held_out
        Equilibria that its error was measured with, and that had no part in its making.
    lost
        Places in the range that no stable path leads to: the actuator snaps on the way.
    low, high : (k,)
        Range of the variables in the samples; beyond it the potential means nothing.
    error : (k,)
        Largest difference of an answer on what was held out, as a part of the largest answer.
    typical_error : (k,)
        The same, root mean square.
    """

    potential: Potential
    degree: int
    samples: int
    held_out: int
    lost: int
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    error: NDArray[np.float64]
    typical_error: NDArray[np.float64]


def usual_reach(element: Superelement) -> Reach:
    """Return the range to expect: the whole stroke, from a free to a blocked output.

    An input that is a block also goes `SIDEWAYS`. The force that blocks the output is taken in
    linear approximation; on an output that is a block, others act `ASKEW`.

    Parameters
    ----------
    element
        From `mean_ports` or `block_ports`; the first half of its coordinates is the input.

    Raises
    ------
    InvalidSettings
        If nothing holds the output.

    Examples
    --------
    >>> from bellcrank.machines.ports import mean_ports
    >>> from bellcrank.model import find_problem
    >>> reach = usual_reach(mean_ports(find_problem("crane").full_design()))
    >>> reach.axis.round(4)  # the stroke, and half of the force that blocks
    array([0.433 , 0.0567])
    """
    count = len(element.measures)
    half = count // 2
    prescribed = np.arange(count) < half
    linear = element.linear(
        element.rest(), Conditions(prescribed, np.zeros(count), np.zeros(count))
    )
    if not (element.reached.all() and linear.is_stable()):
        raise InvalidSettings(
            f"{element.design.problem.name}: nothing holds the output; there is no range of forces"
        )
    transfer = linear.transfer()
    stroke = _stroke(element, transfer[:half, :half])
    spread = np.zeros((count, count))
    if half > 1:
        spread[:2, 1] = SIDEWAYS * np.array([-stroke[1], stroke[0]])
        spread[2, 2] = SIDEWAYS * float(np.hypot(*stroke[:2])) / _radius(element)
    stiffness = np.linalg.inv(transfer[half:, half:])
    values, vectors = np.linalg.eigh(0.5 * (stiffness + stiffness.T))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    # Blocking costs the energy |back|^2 / 2: root @ back is the force that does it.
    back = -root.T @ transfer[half:, :half] @ stroke
    across = np.linalg.svd(back[None])[2][1:].T
    sides = [(0.5 + OVERSHOOT) * back[:, None], ASKEW * float(np.linalg.norm(back)) * across]
    spread[half:, half:] = root @ np.concatenate(sides, axis=1)
    axis = np.concatenate([stroke, 0.5 * root @ back])
    return Reach(prescribed, axis, spread[:, spread.any(axis=0)])


def _stroke(element: Superelement, stiffness: NDArray[np.float64]) -> NDArray[np.float64]:
    """Displacement of the input at the full stroke; what the full force does, linearly."""
    given = element.design.problem.input
    along = np.zeros(len(stiffness))
    along[:2] = given.direction.mean(axis=0) if len(along) > 1 else 1.0
    if given.drive == "displacement":
        return given.amount * along
    force = given.amount * len(given.nodes)
    return force * along / float(along @ stiffness @ along)


def _radius(element: Superelement) -> float:
    """Distance of the nodes of the input from its centre, root mean square."""
    positions = element.design.problem.lattice.positions[element.design.problem.input.nodes]
    arm = positions - positions.mean(axis=0)
    return float(np.sqrt((arm**2).sum(axis=1).mean())) or 1.0


def sample(
    element: Superelement, reach: Reach, count: int, seed: int = 0
) -> tuple[list[State], int]:
    """Return stable equilibria spread evenly over a range, and how many places snapped.

    Each is reached from the nearest one known, so that all are joined with rest.

    Raises
    ------
    InvalidSettings
        If no sample is asked for.
    """
    if count < 1:
        raise InvalidSettings(f"samples: expected at least one, got {count}")
    spread = reach.spread
    places = qmc.Halton(1 + spread.shape[1], rng=np.random.default_rng(seed)).random(count)
    along = (1.0 + 2.0 * OVERSHOOT) * places[:, :1] - OVERSHOOT
    targets = along * (reach.axis + (2.0 * places[:, 1:] - 1.0) @ spread.T)
    unit = np.abs(reach.axis) + np.abs(spread).sum(axis=1)
    unit[unit == 0.0] = 1.0
    known = [element.rest()]
    at = [np.zeros(len(unit))]
    lost = 0
    none = np.zeros(len(unit))
    for target in sorted(targets, key=lambda place: float((np.abs(place) / unit).max())):
        distances = [float(np.abs((target - place) / unit).max()) for place in at]
        start = known[int(np.argmin(distances))]
        arrival = follow(element, start, Conditions(reach.prescribed, target, none))
        if arrival.status is Status.CONVERGED:
            known.append(arrival.state)
            at.append(target)
        else:
            lost += 1
    return known[1:], lost


def fit(
    element: Superelement, degrees: Sequence[int], reach: Reach | None = None, seed: int = 0
) -> Fit:
    """Sample an actuator, fit potentials, choose one and measure its error.

    Strongly nonlinear actuators are no polynomials, and high degrees only make that worse; so
    the degree is chosen by how well each does on samples that it was not fitted to.

    Parameters
    ----------
    element
        From `mean_ports` or `block_ports`.
    degrees
        Of the polynomials to try.
    reach
        The range; by default `usual_reach`.

    Raises
    ------
    InvalidSettings
        If there is no degree, or one below 2; if so much of the range snaps that too few samples
        are left; or as `usual_reach`.

    Examples
    --------
    >>> from bellcrank.machines.ports import mean_ports
    >>> from bellcrank.model import find_problem
    >>> found = fit(mean_ports(find_problem("scaling-8").full_design()), degrees=[2, 4])
    >>> found.degree, bool(found.error.max() < 1e-3)
    (4, True)
    """
    if not degrees or min(degrees) < 2:
        raise InvalidSettings(f"degrees: expected some of at least 2, got {list(degrees)}")
    reach = reach or usual_reach(element)
    prescribed = reach.prescribed
    variables = len(prescribed)
    needed = EQUATIONS * term_count(variables, max(degrees)) // (variables + 1) + 4 * variables
    states, lost = sample(element, reach, PARTS * needed // (PARTS - 2), seed)
    parts = [states[number::PARTS] for number in range(PARTS)]
    kept = [state for part in parts[2:] for state in part]
    if not (parts[0] and parts[1]):
        raise InvalidSettings(
            f"{element.design.problem.name}: snaps nearly everywhere in its range; no potential"
        )
    size = np.abs([answers_of(state, prescribed) for state in states]).max(axis=0)
    size = np.maximum(size, NOTHING)
    fitted = [(degree, fit_potential(element, prescribed, kept, degree)) for degree in degrees]
    degree, potential = min(
        fitted, key=lambda one: float(((_missed(one[1], parts[1]) / size) ** 2).mean(axis=0).max())
    )
    missed = _missed(potential, parts[0]) / size
    x = np.array([variables_of(state, prescribed) for state in kept])
    return Fit(
        potential=potential,
        degree=degree,
        samples=len(kept),
        held_out=len(parts[0]),
        lost=lost,
        low=x.min(axis=0),
        high=x.max(axis=0),
        error=np.abs(missed).max(axis=0),
        typical_error=np.sqrt((missed**2).mean(axis=0)),
    )


def _missed(potential: Potential, states: Sequence[State]) -> NDArray[np.float64]:
    """(n, k) differences of a potential's answers from those of equilibria."""
    return np.array(
        [
            potential.answer(variables_of(state, potential.prescribed))
            - answers_of(state, potential.prescribed)
            for state in states
        ]
    )
