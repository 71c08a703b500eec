"""From one equilibrium of a superelement to another, on one stable path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics.conditions import Conditions, Linear
from bellcrank.mechanics.status import Status

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics.substructure import Condensed
    from bellcrank.mechanics.superelement import State, Superelement

MOST_ITERATIONS = 12
SETTLED = 1e-7
"""Step, in lattice units, after which one more Newton step leaves only rounding errors."""
TOLERANCE = 1e-9
"""What that last one may still move."""
LONGEST_STEP = 0.5
LARGEST_DEPARTURE = 0.05
"""Of an increment from the mean of the tangents at its ends, as a part of the movement, beyond
which the two states may not be on one path."""
LARGEST_SOFTENING = 0.7
"""Least ratio of the lowest stiffnesses at the ends of an increment, in either direction: a
stability that is lost between them would have been seen to fade."""
SMALLEST_INCREMENT = 1.0 / 4096.0


@dataclass(frozen=True, slots=True, eq=False)
class Arrival:
    """How far a superelement came on its way to new conditions.

    Parameters
    ----------
    state
        The last stable one.
    fraction
        Of the way, 0 to 1.
    status
        CONVERGED if it came all the way; SNAPPED if stability is lost beyond `fraction`.
    """

    state: State
    fraction: float
    status: Status


def follow(element: Superelement, state: State, conditions: Conditions) -> Arrival:
    """Go from a state to new conditions in increments that stay on one stable path.

    An increment counts if it ends in a stable equilibrium, if the tangents at both of its ends
    account for the way between them, and if the lowest stiffness, of the interior and against what
    the conditions leave free, changes little; else it is halved. Conditions may be of another kind
    than those the state was reached under, which is what makes it possible to hold an output
    where it is, and then to push.

    Parameters
    ----------
    state
        Where to begin: at rest, or where an earlier call arrived.
    conditions
        On each of the k coordinates of the element.

    Returns
    -------
    Arrival
        SNAPPED where even the smallest increment fails.

    Raises
    ------
    InvalidSettings
        If the conditions are not about k coordinates, ask for a motion of what the input does
        not reach, or leave a motion free that nothing resists at the state.

    Examples
    --------
    The full crane, pushed by its whole stroke:

    >>> from bellcrank.mechanics.grips import Sliding
    >>> from bellcrank.mechanics.superelement import Superelement
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> push = Sliding(crane.input.nodes, crane.input.direction)
    >>> pushed = Superelement(crane.full_design(), [push])
    >>> stroke = Conditions(np.array([True]), np.array([crane.input.amount]), np.zeros(1))
    >>> arrival = follow(pushed, pushed.rest(), stroke)
    >>> arrival.status.label, arrival.state.force.round(4)
    ('converged', array([4.0187]))
    """
    _check(element, state, conditions)
    start = np.where(
        conditions.prescribed,
        state.coordinates,
        state.force + conditions.spring * state.coordinates,
    )
    change = conditions.value - start
    before = element.condense(state.z, state.displacement)
    fraction, increment = 0.0, 1.0
    while fraction < 1.0 and increment >= SMALLEST_INCREMENT and before is not None:
        end = min(1.0, fraction + increment)
        value = conditions.value if end == 1.0 else start + end * change
        target = Conditions(conditions.prescribed, value, conditions.spring)
        arrived = settle(element, state, target)
        if arrived is not None:
            after, found = arrived
            part = (end - fraction) * change
            mean = 0.5 * (
                _tangent(element, before, conditions, part)
                + _tangent(element, found, conditions, part)
            )
            moved = after.displacement - state.displacement
            if _is_way(mean, moved) and _is_near(element, conditions, before, found):
                state, before, fraction = after, found, end
                increment *= 2.0
                continue
        increment *= 0.5
    status = Status.CONVERGED if fraction == 1.0 else Status.SNAPPED
    return Arrival(state, fraction, status)


def _check(element: Superelement, state: State, conditions: Conditions) -> None:
    name, count = element.design.problem.name, len(element.measures)
    if len(conditions.value) != count:
        raise InvalidSettings(
            f"conditions: expected one for each of {count} coordinates, got {len(conditions.value)}"
        )
    missed = np.flatnonzero(conditions.prescribed & ~element.reached)
    if len(missed):
        raise InvalidSettings(
            f"{name}: coordinate {missed[0]} cannot be moved: nothing connects it to the input"
        )
    if not element.linear(state, conditions).is_stable():
        raise InvalidSettings(
            f"{name}: the conditions leave a motion free that nothing resists: the design is a "
            "mechanism, or about to snap"
        )


def _tangent(
    element: Superelement,
    found: Condensed,
    conditions: Conditions,
    change: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return (N, 2) the motion for a small change of the conditions."""
    linear = Linear(found.stiffness, element.measures, conditions)
    load = element.measures.T @ np.where(conditions.prescribed, 0.0, change)
    step, _ = linear.solve(load, change[conditions.prescribed])
    moved: NDArray[np.float64] = np.tensordot(step, found.responses, axes=1)
    return moved


def _is_way(mean: NDArray[np.float64], moved: NDArray[np.float64]) -> bool:
    """Whether the mean of the tangents accounts for a movement."""
    departure = float(np.abs(moved - mean).max())
    return departure <= LARGEST_DEPARTURE * max(float(np.abs(moved).max()), SETTLED)


def _is_near(
    element: Superelement, conditions: Conditions, before: Condensed, after: Condensed
) -> bool:
    """Whether the lowest stiffnesses of two states are alike."""
    pairs = [(before.lowest, after.lowest)]
    both = [
        Linear(found.stiffness, element.measures, conditions).lowest()[0]
        for found in (before, after)
    ]
    pairs.append((both[0], both[1]))
    return all(
        first == last or (last > LARGEST_SOFTENING * first and first > LARGEST_SOFTENING * last)
        for first, last in pairs
    )


def settle(
    element: Superelement, start: State, conditions: Conditions
) -> tuple[State, Condensed] | None:
    """Find the stable equilibrium next to a state by Newton's method.

    Returns
    -------
    (State, Condensed) or None
        None if steps grow too long, do not settle, or end where it is not stable.
    """
    z, displacement = start.z.copy(), start.displacement.copy()
    last = predicted = False
    for _ in range(MOST_ITERATIONS):
        found = element.condense(z, displacement, predicted=predicted and not last)
        whole = found is not None
        found = found or element.condense(z, displacement, softened=False)
        if found is None:
            return None
        linear = Linear(found.stiffness, element.measures, conditions)
        step = _newton_step(linear, found, z)
        if step is None:
            return None
        moved = found.settling + np.tensordot(step, found.responses, axes=1)
        size = float(np.abs(moved).max())
        if last:
            good = whole and size <= TOLERANCE and linear.is_stable()
            return (element.state(z, displacement, found), found) if good else None
        if not size < LONGEST_STEP:
            return None
        element.cut.predict_tension(moved)
        predicted = True
        z, displacement = z + step, displacement + moved
        element.place(z, displacement)
        last = size <= SETTLED and whole
    return None


def _newton_step(
    linear: Linear, found: Condensed, z: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Return (m,) the step towards equilibrium; None if nothing resists it."""
    conditions, coordinates = linear.conditions, linear.measures @ z
    missing = conditions.value - coordinates
    load = conditions.value - conditions.spring * coordinates
    load[conditions.prescribed] = 0.0
    try:
        return linear.solve(linear.measures.T @ load - found.force, missing[conditions.prescribed])[
            0
        ]
    except np.linalg.LinAlgError:
        return None
