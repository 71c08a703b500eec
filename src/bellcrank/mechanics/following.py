"""Follow a superelement from one equilibrium to another on one stable path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics.conditions import Conditions, LinearEquations
from bellcrank.mechanics.status import Status

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics.superelement import Condensed, State
    from bellcrank.model import Design

MAX_ITERATIONS = 12
SMALL_STEP = 1e-7
"""Step, in lattice units, after which one more Newton step leaves only rounding errors."""
TOLERANCE = 1e-9
"""Largest size of that last step."""
LONGEST_STEP = 0.5
LARGEST_DEPARTURE = 0.05
"""Departure of an increment from the mean of the tangents at its ends, as a part of the movement,
above which the two states may be on different paths."""
LARGEST_SOFTENING = 0.7
"""Least ratio of the lowest stiffnesses at the ends of an increment, in either direction, so that
no loss of stability between them is missed."""
SMALLEST_INCREMENT = 1.0 / 4096.0


class Movable(Protocol):
    """What `follow` moves: a superelement, or an assembly of several.

    See `bellcrank.mechanics.Superelement` for the attributes.
    """

    design: Design
    measures: NDArray[np.float64]

    @property
    def reached(self) -> NDArray[np.bool_]:
        """(k,) whether each coordinate belongs to a piece that the input reaches."""

    def rest(self) -> State:
        """Return the state at rest."""

    def linear(self, state: State, conditions: Conditions) -> LinearEquations:
        """Return the linear equations around a state."""

    def condense(
        self,
        displacement: NDArray[np.float64],
        *,
        softened: bool = True,
        predicted: bool = False,
    ) -> Condensed | None:
        """Condense the tangent stiffness to the coordinates."""

    def predict_tension(self, motion: NDArray[np.float64]) -> None:
        """Compute the tension to first order after a motion."""

    def moved(
        self, displacement: NDArray[np.float64], motion: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the displacement after a motion."""

    def motion(self, start: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the motion from one displacement to another."""

    def state(
        self, z: NDArray[np.float64], displacement: NDArray[np.float64], found: Condensed
    ) -> State:
        """Return the state of an equilibrium that was condensed to `found`."""


@dataclass(frozen=True, slots=True, eq=False)
class PathEnd:
    """Last state on the path of a superelement to new conditions.

    Parameters
    ----------
    state
        The last stable state.
    fraction
        Part of the change of conditions at that state, 0 to 1.
    status
        CONVERGED at fraction 1; SNAPPED if stability is lost beyond `fraction`.
    """

    state: State
    fraction: float
    status: Status


def follow(element: Movable, state: State, conditions: Conditions) -> PathEnd:
    """Change the conditions on a superelement in increments that stay on one stable path.

    An increment is accepted if it ends in a stable equilibrium, if the tangents at both of its
    ends account for the movement between them, and if the lowest stiffness, of the interior and
    against the motions that the conditions leave free, changes little; otherwise it is halved.
    The conditions may be of another kind than those of the state: an output can, for example, be
    held where it is before the input is pushed.

    Parameters
    ----------
    state
        First state: at rest, or the result of an earlier call.
    conditions
        Conditions on each of the k coordinates of the element.

    Returns
    -------
    PathEnd
        SNAPPED where even the smallest increment fails.

    Raises
    ------
    InvalidSettings
        If the conditions are not on k coordinates, prescribe a coordinate that the input does not
        reach, or leave a motion free that nothing resists at the state.

    Examples
    --------
    The full crane, pushed by its whole stroke:

    >>> from bellcrank.mechanics import Superelement, uniform_motion
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> push = uniform_motion(crane.input.nodes, crane.input.direction)
    >>> pushed = Superelement(crane.full_design(), [push])
    >>> stroke = Conditions(np.array([True]), np.array([crane.input.amount]), np.zeros(1))
    >>> end = follow(pushed, pushed.rest(), stroke)
    >>> end.status.label, end.state.force.round(4)
    ('converged', array([4.0187]))
    """
    _check(element, state, conditions)
    start = np.where(
        conditions.prescribed,
        state.coordinates,
        state.force + conditions.spring * state.coordinates,
    )
    change = conditions.value - start
    before = element.condense(state.displacement)
    fraction, increment = 0.0, 1.0
    while fraction < 1.0 and increment >= SMALLEST_INCREMENT and before is not None:
        end = min(1.0, fraction + increment)
        value = conditions.value if end == 1.0 else start + end * change
        target = Conditions(conditions.prescribed, value, conditions.spring)
        reached = find_equilibrium(element, state, target)
        if reached is not None:
            after, found = reached
            part = (end - fraction) * change
            mean = 0.5 * (
                _tangent(element, before, conditions, part)
                + _tangent(element, found, conditions, part)
            )
            moved = element.motion(state.displacement, after.displacement)
            if _is_consistent(mean, moved) and _keeps_stiffness(element, conditions, before, found):
                state, before, fraction = after, found, end
                increment *= 2.0
                continue
        increment *= 0.5
    status = Status.CONVERGED if fraction == 1.0 else Status.SNAPPED
    return PathEnd(state, fraction, status)


def _check(element: Movable, state: State, conditions: Conditions) -> None:
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
    element: Movable,
    found: Condensed,
    conditions: Conditions,
    change: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return (N, 2) the motion for a small change of the conditions."""
    linear = LinearEquations(found.stiffness, element.measures, conditions)
    load = element.measures.T @ np.where(conditions.prescribed, 0.0, change)
    step, _ = linear.solve(load, change[conditions.prescribed])
    moved: NDArray[np.float64] = found.response(step)
    return moved


def _is_consistent(mean: NDArray[np.float64], moved: NDArray[np.float64]) -> bool:
    """Whether the mean of the tangents accounts for a movement."""
    departure = float(np.abs(moved - mean).max())
    return departure <= LARGEST_DEPARTURE * max(float(np.abs(moved).max()), SMALL_STEP)


def _keeps_stiffness(
    element: Movable, conditions: Conditions, before: Condensed, after: Condensed
) -> bool:
    """Whether the lowest stiffnesses of two states differ little."""
    pairs = list(zip(before.lowest, after.lowest, strict=True))
    both = [
        LinearEquations(found.stiffness, element.measures, conditions).lowest()[0]
        for found in (before, after)
    ]
    pairs.append((both[0], both[1]))
    return all(
        first == last or (last > LARGEST_SOFTENING * first and first > LARGEST_SOFTENING * last)
        for first, last in pairs
    )


def find_equilibrium(
    element: Movable, start: State, conditions: Conditions
) -> tuple[State, Condensed] | None:
    """Find the stable equilibrium closest to a state by Newton's method.

    Returns
    -------
    (State, Condensed) or None
        None if a step is too long, the iteration does not converge, or the result is not stable.
    """
    z, displacement = start.z.copy(), start.displacement.copy()
    last = predicted = False
    for _ in range(MAX_ITERATIONS):
        found = element.condense(displacement, predicted=predicted and not last)
        whole = found is not None
        found = found or element.condense(displacement, softened=False)
        if found is None:
            return None
        linear = LinearEquations(found.stiffness, element.measures, conditions)
        step = _newton_step(linear, found, z)
        if step is None:
            return None
        moved = found.interior_step + found.response(step)
        size = float(np.abs(moved).max())
        if last:
            good = whole and size <= TOLERANCE and linear.is_stable()
            return (element.state(z, displacement, found), found) if good else None
        if not size < LONGEST_STEP:
            return None
        element.predict_tension(moved)
        predicted = True
        z, displacement = z + step, element.moved(displacement, moved)
        last = size <= SMALL_STEP and whole
    return None


def _newton_step(
    linear: LinearEquations, found: Condensed, z: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Return (m,) the Newton step; None if the equations are singular."""
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
