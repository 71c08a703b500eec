"""Deviations of print and drive over which the specification of a problem is to be met."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidProblem

if TYPE_CHECKING:
    from collections.abc import Mapping

LARGEST = {
    "width": 0.9,
    "each_width": 0.3,
    "node": math.inf,
    "angle": 90.0,
    "least_yield": 1.0,
    "keep": 0.99,
}
"""Largest value of each tolerance; the smallest one is 0."""


def out_of_range(given: object, largest: Mapping[str, float]) -> str:
    """Return which attribute is not a number from 0 to its largest value; empty if none is."""
    for name, most in largest.items():
        value = getattr(given, name)
        if not (math.isfinite(value) and 0.0 <= value <= most):
            limit = "at least 0" if most == math.inf else f"from 0 to {most:g}"
            return f"{name}: expected a number {limit}, got {value!r}"
    return ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerances:
    """Deviations over which the items of a specification are to be met.

    Parameters
    ----------
    width
        Largest deviation of all widths together, as a part of the width.
    each_width
        Standard deviation of the width of each strut, as a part of it.
    node
        Largest deviation of each coordinate of a node, lattice units.
    angle
        Largest deviation of the direction of the input, degrees.
    least_yield
        Part of random prints with these deviations that are to meet all items.
    keep
        Smallest efficiency with deviations over that as drawn. Items are to be met as drawn alone
        then, and the yield is that of this bound. 0: all items are to be met with deviations too.

    Raises
    ------
    InvalidProblem
        If a number is out of its range.

    Examples
    --------
    >>> Tolerances(width=0.2).to_dict()["width"]
    0.2
    """

    width: float = 0.1
    each_width: float = 0.05
    node: float = 0.01
    angle: float = 5.0
    least_yield: float = 0.95
    keep: float = 0.0

    def __post_init__(self) -> None:
        if fault := out_of_range(self, LARGEST):
            raise InvalidProblem(f"tolerances: {fault}")

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; `keep` if it is not 0."""
        found = {field.name: getattr(self, field.name) for field in fields(self)}
        return found if self.keep else {name: found[name] for name in found if name != "keep"}


USUAL = Tolerances()
"""Tolerances of parts whose task names none, at 10 mm for each lattice unit."""
