"""Curves of an actuator along its stroke, against a load at its output."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, cast, get_args

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.machines.ports import INPUT, OUTPUT
from bellcrank.mechanics import Conditions, Status, follow

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics import Movable, State

LoadKind = Literal["free", "blocked", "spring", "force"]


@dataclass(frozen=True, slots=True)
class Load:
    """A load on the mean motion of an output.

    Parameters
    ----------
    kind
        ``"free"``: no load; ``"blocked"``: the output is held at rest; ``"spring"``: a linear
        spring; ``"force"``: a dead force that is applied before the stroke.
    value
        Stiffness of the spring, or the force along the output direction (negative if it resists
        the motion), in lattice units; 0 for the other kinds.

    Raises
    ------
    InvalidSettings
        If the kind is unknown, or the value does not fit it.
    """

    kind: LoadKind = "free"
    value: float = 0.0

    def __post_init__(self) -> None:
        if self.kind not in get_args(LoadKind):
            raise InvalidSettings(
                f"load: expected one of {', '.join(get_args(LoadKind))}, got {self.kind!r}"
            )
        if not math.isfinite(self.value) or (self.kind == "spring" and self.value < 0.0):
            raise InvalidSettings(
                f"load {self.kind}: expected a finite number, for a spring at least 0, got "
                f"{self.value!r}"
            )
        if self.kind in ("free", "blocked") and self.value != 0.0:
            raise InvalidSettings(f"load {self.kind}: expected no value, got {self.value!r}")

    @property
    def label(self) -> str:
        """Text of the load, as `read` parses it."""
        return self.kind if self.kind in ("free", "blocked") else f"{self.kind}:{self.value!r}"

    @classmethod
    def read(cls, text: str) -> Load:
        """Parse a load.

        Raises
        ------
        InvalidSettings

        Examples
        --------
        >>> Load.read("spring:0.5"), Load.read("blocked").label
        (Load(kind='spring', value=0.5), 'blocked')
        """
        kind, colon, value = text.partition(":")
        if kind not in get_args(LoadKind) or bool(colon) != (kind in ("spring", "force")):
            raise InvalidSettings(
                f"load {text!r}: expected free, blocked, spring:STIFFNESS or force:FORCE"
            )
        try:
            number = float(value) if colon else 0.0
        except ValueError:
            raise InvalidSettings(f"load {text!r}: expected a number, got {value!r}") from None
        return cls(cast("LoadKind", kind), number)


@dataclass(frozen=True, slots=True, eq=False)
class PortCurve:
    """Motions and forces of an actuator along its stroke, against one load.

    Parameters
    ----------
    load
        Load at the output.
    motion, input_force : (p,)
        Motion of the input and external force on it; the first point is the start of the stroke.
    output, output_force : (p,)
        Motion of the output and external force on it.
    energy : (p,)
        Elastic energy of the actuator.
    status
        SNAPPED if stability is lost before the end of the stroke; the curve then ends at the
        last stable state.
    reached
        Stable fraction of the stroke, 0 to 1.
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
        """(p,) output motion since the start of the stroke over input motion; nan at the start."""
        efficiency = np.full_like(self.output, math.nan)
        efficiency[1:] = (self.output[1:] - self.output[0]) / self.motion[1:]
        return efficiency


def trace(element: Movable, load: Load, points: int) -> PortCurve:
    """Follow the equilibrium of an actuator along its stroke, against a load.

    Parameters
    ----------
    element
        Actuator from `mean_ports`, or machine from `assembled_ports`. A problem that is driven by
        a force is loaded up to its full force.
    load
        Load at the output.
    points
        Number of equal increments.

    Raises
    ------
    InvalidSettings
        If `points` is below 1, or the load is impossible: a blocked output that is not connected,
        or a force on an output without resistance.

    Examples
    --------
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
        target = _conditions(element, load, (number + 1) / points)
        arrival = follow(element, states[-1], target)
        status = arrival.status
        reached = (number + arrival.fraction) / points
        if arrival.fraction > 0.0:
            states.append(arrival.state)
    return _curve(load, states, status, reached)


def _conditions(element: Movable, load: Load, fraction: float) -> Conditions:
    """Return the boundary conditions at a fraction of the stroke."""
    given = element.design.problem.input
    displaced = given.drive == "displacement"
    full = given.amount if displaced else given.amount * len(given.nodes)
    value, spring = np.zeros(2), np.zeros(2)
    value[INPUT] = fraction * full
    if load.kind == "force":
        value[OUTPUT] = load.value
    elif load.kind == "spring":
        spring[OUTPUT] = load.value
    return Conditions(np.array([displaced, load.kind == "blocked"]), value, spring)


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
