"""Items of a specification from the tables of a task."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bellcrank.errors import InvalidProblem, InvalidSettings
from bellcrank.model import CARRIED, QUANTITIES, Item, ObjectiveTerm
from bellcrank.part.units import read_quantity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bellcrank.part.units import Quantity
    from bellcrank.task.schema import Bounds, PathSection
    from bellcrank.task.units import ProblemUnits


class Reading(NamedTuple):
    """How the bounds of a quantity are read."""

    unit: Quantity
    single: str
    """Bound that a single value is: at_least, at_most, plus_minus, or none."""
    from_start: bool
    """Whether bounds hold along the whole stroke unless `from` is given."""
    largest: float = math.inf
    """Largest bound that makes sense."""


READINGS = {
    "gain": Reading("ratio", "none", False, 1e4),
    "travel": Reading("length", "at_least", False),
    "off_axis": Reading("ratio", "at_most", False, 2.0),
    "rotation": Reading("angle", "plus_minus", True, 360.0),
    "stiffness": Reading("stiffness", "at_least", False),
    "payload": Reading("load", "at_least", False),
    "dead_load": Reading("load", "at_least", False),
    "blocked_force": Reading("force", "at_least", False),
    "sag": Reading("ratio", "at_most", False, 2.0),
    "input_force": Reading("force", "at_most", False),
    "strain": Reading("ratio", "at_most", True, 2.0),
}
"""Quantities that the tables of outputs and cases bound."""
SPREAD = Reading("ratio", "at_most", False, 10.0)
"""The same for the spread of a quantity, which is a ratio."""
FRACTIONS = 1.0
"""Largest fraction of the stroke at which bounds hold."""


@dataclass(slots=True)
class ItemReader:
    """Reads items of one case into the units of a problem.

    Parameters
    ----------
    units
        Units of the problem.
    case
        Name of the case.
    items, maximise
        Filled by `read`.
    """

    units: ProblemUnits
    case: str
    items: list[Item] = field(default_factory=list)
    maximise: list[ObjectiveTerm] = field(default_factory=list)
    scaled: list[bool] = field(default_factory=list)
    """Whether each objective has a scale of its own."""

    def read(self, quantity: str, wanted: Sequence[Bounds], key: str, output: str = "") -> None:
        """Add the items and objectives of a quantity.

        Parameters
        ----------
        quantity
            Name in `bellcrank.model.QUANTITIES`.
        wanted
            Tables.
        key
            Key of the table in the task, for errors.
        output
            Name of the output; empty where the quantity belongs to the case.

        Raises
        ------
        InvalidProblem
            If a value is not one, or does not make sense.
        """
        for index, bounds in enumerate(wanted):
            name = f"{key}[{index}]" if len(wanted) > 1 else key
            self._read(quantity, bounds, name, output)

    def _read(self, quantity: str, bounds: Bounds, key: str, output: str) -> None:
        named: dict[str, Any] = {"quantity": quantity, "case": self.case, "output": output}
        if bounds.value is not None:
            self._single(quantity, bounds.value, key, named)
            return
        if bounds.maximise or bounds.minimise:
            self._objective(quantity, bounds, key, named)
        limits = self._limits(quantity, bounds, key)
        if not limits:
            if not (bounds.maximise or bounds.minimise):
                raise InvalidProblem(
                    f"{key}: expected at_least, at_most, target with tolerance, or maximise"
                )
            return
        self.items.append(Item(**named, **limits, **self._range(quantity, bounds, key)))

    def _single(self, quantity: str, value: Any, key: str, named: dict[str, Any]) -> None:
        """Read a single value in place of a table."""
        reading = READINGS[quantity]
        if value in {"maximise", "minimise"} and quantity not in CARRIED:
            sign = 1.0 if value == "maximise" else -1.0
            self._add_objective(named, sign, scaled=False)
            return
        if reading.single == "none":
            raise InvalidProblem(
                f"{key}: expected 'maximise', or a table like {{ at_least = 2.0 }} or "
                f"{{ target = 3.0, tolerance = '2%' }}, got {value!r}"
            )
        number = self._number(quantity, value, key)
        start: dict[str, Any] = {"start": 0.0} if reading.from_start else {}
        if reading.single == "plus_minus":
            self.items.append(Item(**named, at_least=-abs(number), at_most=abs(number), **start))
        else:
            bound: dict[str, Any] = {reading.single: number}
            self.items.append(Item(**named, **bound, **start))

    def _number(self, quantity: str, value: Any, key: str, *, spread: bool = False) -> float:
        """Return a bound in the units of the problem; that of a spread is a ratio."""
        reading = SPREAD if spread else READINGS[quantity]
        try:
            number = read_quantity(key, value, reading.unit)
        except InvalidSettings as error:
            raise InvalidProblem(str(error)) from None
        if abs(number) > reading.largest:
            hint = f"; write '{number:g}%' for {number / 100:g}" if reading.unit == "ratio" else ""
            raise InvalidProblem(
                f"{key}: expected at most {reading.largest:g}, got {value!r}{hint}"
            )
        return number if spread else self.units.in_problem(QUANTITIES[quantity].dimension, number)

    def _limits(self, quantity: str, bounds: Bounds, key: str) -> dict[str, Any]:
        """Return the bounds of an item."""
        if (bounds.target is None) != (bounds.tolerance is None):
            missing = "tolerance" if bounds.tolerance is None else "target"
            raise InvalidProblem(f"{key}: key {missing!r} is missing; target needs a tolerance")
        if bounds.target is not None:
            if bounds.of == "spread":
                raise InvalidProblem(f"{key}: expected at_most with of = 'spread', got target")
            if bounds.at_least is not None or bounds.at_most is not None:
                raise InvalidProblem(f"{key}: expected target or at_least and at_most, got both")
            target = self._number(quantity, bounds.target, f"{key}.target")
            half = self._tolerance(quantity, bounds.tolerance, target, f"{key}.tolerance")
            return {"at_least": target - half, "at_most": target + half}
        spread = bounds.of == "spread"
        limits: dict[str, Any] = {
            name: self._number(quantity, value, f"{key}.{name}", spread=spread)
            for name in ("at_least", "at_most")
            if (value := getattr(bounds, name)) is not None
        }
        if quantity == "rotation" and set(limits) == {"at_most"}:
            limits["at_least"] = -limits["at_most"]
        if len(limits) == 2 and limits["at_least"] > limits["at_most"]:
            raise InvalidProblem(
                f"{key}: at_least {bounds.at_least!r} exceeds at_most {bounds.at_most!r}"
            )
        return limits

    def _tolerance(self, quantity: str, value: Any, target: float, key: str) -> float:
        """Return half the width of a tolerance: a percentage of the target, or a number."""
        try:
            if isinstance(value, str) and value.strip().endswith("%"):
                half = abs(target) * read_quantity(key, value, "ratio")
            else:
                half = self._number(quantity, value, key)
        except InvalidSettings as error:
            raise InvalidProblem(str(error)) from None
        if half <= 0.0:
            raise InvalidProblem(f"{key}: expected a tolerance above 0, got {value!r}")
        return half

    def _range(self, quantity: str, bounds: Bounds, key: str) -> dict[str, Any]:
        """Return the fractions of the stroke at which bounds hold, and the reduction."""
        along = QUANTITIES[quantity].along
        given = bounds.start is not None or bounds.stop is not None
        if not along and (given or bounds.of != "every"):
            raise InvalidProblem(
                f"{key}: {quantity} is a single number; from, to and of do not apply to it"
            )
        # A least value, such as that of a wanted rotation, cannot hold from rest on.
        whole = READINGS[quantity].from_start and bounds.target is bounds.at_least is None
        start = 0.0 if whole or given or bounds.of != "every" else 1.0
        found = {"start": start, "stop": 1.0}
        for name, value in (("start", bounds.start), ("stop", bounds.stop)):
            if value is not None:
                if not 0.0 <= value <= FRACTIONS:
                    label = {"start": "from", "stop": "to"}[name]
                    raise InvalidProblem(
                        f"{key}.{label}: expected a part of the stroke from 0 to 1, or a "
                        f"percentage like '50%', got {value:g}"
                    )
                found[name] = value
        if found["start"] > found["stop"]:
            raise InvalidProblem(f"{key}: from {found['start']:g} is after to {found['stop']:g}")
        return {**found, "of": bounds.of}

    def _objective(self, quantity: str, bounds: Bounds, key: str, named: dict[str, Any]) -> None:
        if bounds.maximise and bounds.minimise:
            raise InvalidProblem(f"{key}: expected maximise or minimise, got both")
        scale = 1.0
        if bounds.scale is not None:
            scale = self._number(quantity, bounds.scale, f"{key}.scale")
            if scale <= 0.0:
                raise InvalidProblem(
                    f"{key}.scale: expected a number above 0, got {bounds.scale!r}"
                )
        sign = 1.0 if bounds.maximise else -1.0
        if quantity in CARRIED and bounds.at_least is None:
            raise InvalidProblem(f"{key}: a load that is maximised needs at_least, to begin with")
        self._add_objective(named, sign * scale, scaled=bounds.scale is not None)

    def _add_objective(self, named: dict[str, Any], scale: float, *, scaled: bool) -> None:
        self.maximise.append(ObjectiveTerm(**named, scale=scale))
        self.scaled.append(scaled)

    def path(self, path: PathSection, direction: tuple[float, ...], key: str, output: str) -> None:
        """Add the item of a wanted path.

        Raises
        ------
        InvalidProblem
            If the path has no length, or is given twice.
        """
        if (path.points is None) == (path.arc is None):
            raise InvalidProblem(f"{key}: expected points or arc, and not both")
        if not 0.0 < path.error <= 0.5:
            raise InvalidProblem(
                f"{key}.error: expected a part of the length of the path up to 50%, got "
                f"{path.error:g}"
            )
        if path.arc is not None:
            if len(direction) != 2:
                raise InvalidProblem(f"{key}.arc: expected points in space, got an arc")
            corners = arc(*path.arc, direction)
        else:
            assert path.points is not None
            lengths = {len(point) for point in path.points}
            if lengths != {len(direction)}:
                axes = ", ".join("xyz"[: len(direction)])
                raise InvalidProblem(f"{key}.points: expected points [{axes}]")
            corners = np.array(path.points, dtype=float)
        if len(corners) < 2 or np.abs(np.diff(corners, axis=0)).sum() == 0.0:
            raise InvalidProblem(f"{key}: expected a path of at least two different points")
        if np.abs(corners[0]).max() > 0.0:
            raise InvalidProblem(
                f"{key}.points: a path begins at the rest position of the output, [0, 0]; got "
                f"{corners[0].tolist()}"
            )
        self.items.append(
            Item(
                quantity="path_error", case=self.case, output=output, at_most=path.error,
                path=corners / self.units.length,
            )
        )  # fmt: skip


def arc(radius: float, angle: float, direction: tuple[float, ...]) -> np.ndarray[Any, Any]:
    """Return (k, 2) points of an arc that begins at the origin along a direction.

    Parameters
    ----------
    radius
        Radius.
    angle
        Angle, degrees; a positive one turns left.
    direction
        Unit vector.

    Examples
    --------
    >>> arc(10.0, 90.0, (1.0, 0.0))[-1].round(6)
    array([10., 10.])
    """
    turn = np.radians(np.linspace(0.0, abs(angle), 33))
    side = 1.0 if angle >= 0.0 else -1.0
    along, across = radius * np.sin(turn), side * radius * (1.0 - np.cos(turn))
    x, y = direction
    return np.column_stack([along * x - across * y, along * y + across * x])
