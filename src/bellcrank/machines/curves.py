"""How an actuator goes along its stroke, against a load."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.machines.ports import INPUT, OUTPUT
from bellcrank.mechanics import Conditions, Status, follow

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.machines.loads import Load
    from bellcrank.mechanics import State, Superelement


@dataclass(frozen=True, slots=True, eq=False)
class PortCurve:
    """The way of an actuator along its stroke, against one load.

    Parameters
    ----------
    load
    motion, input_force : (p,)
        Of the input, from rest on.
    output, output_force : (p,)
        Its motion, and the force from outside on it.
    energy : (p,)
        Elastic, of the actuator alone.
    status
        SNAPPED where stability is lost on the way: the curve ends at the last state before.
    reached
        Part of the stroke that is stable, 0 to 1.
    """

    load: Load
    motion: NDArray[np.float64]
    input_force: NDArray[np.float64]
    output: NDArray[np.float64]
    output_force: NDArray[np.float64]
    energy: NDArray[np.float64]
    status: Status
    reached: float

    @property
    def efficiency(self) -> NDArray[np.float64]:
        """(p,) output motion since the stroke began, over input motion; nan at its beginning."""
        efficiency = np.full_like(self.output, math.nan)
        efficiency[1:] = (self.output[1:] - self.output[0]) / self.motion[1:]
        return efficiency


def trace(element: Superelement, load: Load, points: int) -> PortCurve:
    """Push an actuator along its stroke, against a load.

    Parameters
    ----------
    element
        From `mean_ports`. A problem that is driven by a force goes up to its whole force.
    load
    points
        Number of equal increments.

    Raises
    ------
    InvalidSettings
        If there are no points, or the load asks for what the actuator cannot do: to hold an
        output that nothing connects, or to move one that nothing resists.

    Examples
    --------
    >>> from bellcrank.machines.loads import Load
    >>> from bellcrank.machines.ports import mean_ports
    >>> from bellcrank.model import find_problem
    >>> curve = trace(mean_ports(find_problem("scaling-8").full_design()), Load("blocked"), 4)
    >>> print(curve.output_force.round(4))
    [0.     0.0084 0.017  0.0258 0.0348]
    """
    if points < 1:
        raise InvalidSettings(f"points: expected at least one, got {points}")
    states = [element.rest()]
    reached, status = 0.0, Status.CONVERGED
    if load.kind == "force" and load.value != 0.0:
        arrival = follow(element, states[0], _conditions(element, load, 0.0))
        states, status = [arrival.state], arrival.status
    for number in range(points):
        if status is not Status.CONVERGED:
            break
        asked = _conditions(element, load, (number + 1) / points)
        arrival = follow(element, states[-1], asked)
        status = arrival.status
        reached = (number + arrival.fraction) / points
        if arrival.fraction > 0.0:
            states.append(arrival.state)
    return _curve(load, states, status, reached)


def _conditions(element: Superelement, load: Load, part: float) -> Conditions:
    given = element.design.problem.input
    driven = given.drive == "displacement"
    whole = given.amount if driven else given.amount * len(given.nodes)
    value, spring = np.zeros(2), np.zeros(2)
    value[INPUT] = part * whole
    if load.kind == "force":
        value[OUTPUT] = load.value
    elif load.kind == "spring":
        spring[OUTPUT] = load.value
    return Conditions(np.array([driven, load.kind == "blocked"]), value, spring)


def _curve(load: Load, states: list[State], status: Status, reached: float) -> PortCurve:
    coordinates = np.array([state.coordinates for state in states])
    force = np.array([state.force for state in states])
    return PortCurve(
        load=load,
        motion=coordinates[:, INPUT],
        input_force=force[:, INPUT],
        output=coordinates[:, OUTPUT],
        output_force=force[:, OUTPUT],
        energy=np.array([state.energy for state in states]),
        status=status,
        reached=reached,
    )
