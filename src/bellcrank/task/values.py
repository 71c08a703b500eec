"""Values of a task file: numbers with units, points, boxes and directions.

Bare numbers are in mm, N, g, degrees and N/mm (`bellcrank.part.units`).
"""

from __future__ import annotations

import math
from contextlib import suppress
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator
from pydantic_core import PydanticCustomError

from bellcrank.errors import InvalidProblem, InvalidSettings
from bellcrank.part.units import UNITS, read_quantity

if TYPE_CHECKING:
    from bellcrank.part.units import Quantity

DIRECTIONS: dict[int, dict[str, tuple[float, ...]]] = {
    2: {"right": (1.0, 0.0), "left": (-1.0, 0.0), "up": (0.0, 1.0), "down": (0.0, -1.0)},
    3: {
        "right": (1.0, 0.0, 0.0), "left": (-1.0, 0.0, 0.0),
        "back": (0.0, 1.0, 0.0), "front": (0.0, -1.0, 0.0),
        "up": (0.0, 0.0, 1.0), "down": (0.0, 0.0, -1.0),
    },
}  # fmt: skip
"""Directions by name, in the plane and in space."""


def reader(quantity: Quantity) -> BeforeValidator:
    """Return a validator that reads a number with a unit."""

    def read(value: Any) -> float:
        try:
            return read_quantity("", value, quantity)
        except InvalidSettings:
            raise PydanticCustomError("unit", UNITS[quantity].wanted) from None

    return BeforeValidator(read)


Length = Annotated[float, reader("length")]
Force = Annotated[float, reader("force")]
Mass = Annotated[float, reader("mass")]
Angle = Annotated[float, reader("angle")]
Ratio = Annotated[float, reader("ratio")]
Stiffness = Annotated[float, reader("stiffness")]


def _as_point(value: Any) -> Any:
    if isinstance(value, list | tuple) and len(value) in {2, 3}:
        return tuple(value)
    raise PydanticCustomError("point", "two lengths, or three in space")


def _as_box(value: Any) -> Any:
    if isinstance(value, list | tuple) and len(value) in {4, 6}:
        return tuple(value)
    raise PydanticCustomError("box", "four lengths, or six in space")


Point = Annotated[tuple[Length, ...], BeforeValidator(_as_point)]
"""A point [x, y], in space [x, y, z], mm."""


def as_tuple(value: Any) -> Any:
    """Return a list as a tuple, and anything else as it is."""
    return tuple(value) if isinstance(value, list) else value


def as_range(value: Any) -> Any:
    """Return two fractions as a tuple."""
    if value is None or (isinstance(value, list | tuple) and len(value) == 2):
        return as_tuple(value)
    raise PydanticCustomError("range", "two fractions of the stroke like ['0%', '50%']")


def as_list(value: Any) -> Any:
    """Return a list of one value, and a list as it is."""
    return value if isinstance(value, list) else [value]


def read_direction(value: Any) -> tuple[float, ...] | str:
    """Return a name as it is, and the unit vector of an angle from the x axis or of a vector.

    Examples
    --------
    >>> read_direction("left"), read_direction([0, 2]), read_direction([0, 0, 2])
    ('left', (0.0, 1.0), (0.0, 0.0, 1.0))
    """
    if isinstance(value, str) and value in DIRECTIONS[3]:
        return value
    if isinstance(value, str) and not value.strip().isdigit():
        with suppress(InvalidSettings):
            angle = math.radians(read_quantity("", value, "angle"))
            return math.cos(angle), math.sin(angle)
    if isinstance(value, list | tuple) and len(value) in DIRECTIONS:
        with suppress(TypeError, ValueError, ZeroDivisionError):
            parts = [float(each) for each in value]
            size = math.hypot(*parts)
            if math.isfinite(size):
                return tuple(each / size for each in parts)
    raise PydanticCustomError(
        "direction",
        "left, right, up, down, an angle like '30deg', or a vector [x, y]; in space also front, "
        "back and [x, y, z]",
    )


def unit_vector(direction: tuple[float, ...] | str, dimension: int, key: str) -> tuple[float, ...]:
    """Return the unit vector (d,) of a direction that `read_direction` has read.

    Raises
    ------
    InvalidProblem
        If it is one of the plane in space, or the other way round.

    Examples
    --------
    >>> unit_vector("up", 2, "direction"), unit_vector("up", 3, "direction")
    ((0.0, 1.0), (0.0, 0.0, 1.0))
    """
    names = DIRECTIONS[dimension]
    if isinstance(direction, str):
        if direction not in names:
            raise InvalidProblem(
                f"{key}: expected {', '.join(names)} or a vector in the plane, got {direction!r}"
            )
        return names[direction]
    if len(direction) != dimension:
        form = f"[{', '.join('xyz'[:dimension])}]"
        raise InvalidProblem(
            f"{key}: expected {', '.join(names)} or a vector {form}, got {list(direction)}"
        )
    return direction


def switch(quantity: Quantity) -> BeforeValidator:
    """Return a validator that reads a number with a unit, true or false."""

    def read(value: Any) -> float | bool:
        if isinstance(value, bool):
            return value
        try:
            return read_quantity("", value, quantity)
        except InvalidSettings:
            message = f"{UNITS[quantity].wanted}, true or false"
            raise PydanticCustomError("unit", message) from None

    return BeforeValidator(read)


Pair = Annotated[tuple[Length, Length], BeforeValidator(as_tuple)]
Box = Annotated[tuple[Length, ...], BeforeValidator(_as_box)]
Direction = Annotated[tuple[float, ...] | str, BeforeValidator(read_direction)]
"""left, right, up, down, in space also front and back, an angle from the x axis, or a vector."""
