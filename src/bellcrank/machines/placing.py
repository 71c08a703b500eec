"""Parts in their places: mirrored, turned, scaled and moved.

Examples
--------
>>> turned = Placement(rotate=60, shift=np.array([1.0, 0.0]))
>>> turned.positions(np.array([[1.0, 0.0]])).round(3)
array([[1.5  , 0.866]])
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import BellcrankError, InvalidFile
from bellcrank.machines.plan import TURN, port_name

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.machines.plan import PartTable, Plan
    from bellcrank.model import Design, Input, Output

HALF = math.sqrt(3.0) / 2.0
COSINE = (1.0, 0.5, -0.5, -1.0, -0.5, 0.5)
SINE = (0.0, HALF, HALF, 0.0, -HALF, -HALF)
"""Of multiples of 60 degrees, to the last bit the same for opposite ones."""


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """A motion of the plane: mirror left to right, turn, scale, shift.

    Parameters
    ----------
    mirror
        Whether x changes its sign, first of all.
    rotate
        Degrees, counter-clockwise, a multiple of 60.
    scale
        How many times as large.
    shift : (2,) float64
        Lattice units of the machine.
    """

    mirror: bool = False
    rotate: int = 0
    scale: float = 1.0
    shift: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))

    @property
    def turn(self) -> NDArray[np.float64]:
        """(2, 2) orthogonal matrix that directions are multiplied by."""
        number = self.rotate // TURN % 6
        cosine, sine = COSINE[number], SINE[number]
        turned = np.array([[cosine, -sine], [sine, cosine]])
        return turned @ np.diag([-1.0, 1.0]) if self.mirror else turned

    def positions(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return where points (n, 2) go."""
        return self.scale * self.directions(points) + self.shift

    def directions(self, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how vectors (n, 2) are turned; none gets longer."""
        turned: NDArray[np.float64] = vectors @ self.turn.T
        return turned


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A design in its place.

    Parameters
    ----------
    name
        As the plan calls it.
    design
        As it came.
    placement
        From its lattice to the machine.
    supported
        Whether its supports hold in the machine.
    """

    name: str
    design: Design
    placement: Placement
    supported: bool = True

    @property
    def positions(self) -> NDArray[np.float64]:
        """(N, 2) of its nodes, in the machine."""
        return self.placement.positions(self.design.problem.lattice.positions)

    @property
    def spacing(self) -> float:
        """Median length of its beams, in the machine."""
        return self.placement.scale * float(np.median(self.design.problem.lattice.rest_length))

    def region(self, port: str) -> Input | Output:
        """Return its input or its output."""
        problem = self.design.problem
        return problem.input if port == "input" else problem.output

    def centre(self, port: str) -> NDArray[np.float64]:
        """(2,) mean of the positions of a port's nodes, in the machine."""
        middle: NDArray[np.float64] = self.positions[self.region(port).nodes].mean(axis=0)
        return middle

    def direction(self, port: str) -> NDArray[np.float64]:
        """(n, 2) of each of a port's nodes, in the machine."""
        return self.placement.directions(self.region(port).direction)


def place_parts(plan: Plan, find: Callable[[str], Design]) -> dict[str, Part]:
    """Find the parts of a plan and put them where they belong, in the plan's order.

    Parameters
    ----------
    find
        Returns the design that an entry's name or a file stands for.

    Raises
    ------
    InvalidFile
        If there is no such entry, or what is there is no design.
    """
    parts: dict[str, Part] = {}
    for name in plan.order:
        table = plan.table.parts[name]
        try:
            design = find(table.entry)
        except BellcrankError as error:
            raise InvalidFile(f"{plan.source}: parts.{name}.entry: {error}") from None
        parts[name] = _place(name, table, design, parts)
    _check_stiffness(plan, parts)
    return {name: parts[name] for name in plan.table.parts}


def _place(name: str, table: PartTable, design: Design, parts: dict[str, Part]) -> Part:
    placement = Placement(table.mirror, table.rotate, table.scale)
    part = Part(name, design, placement, table.supports)
    if table.join is not None:
        onto = port_name(table.join)
        target = parts[onto.part].centre(onto.port)
    else:
        target = np.array(table.at or [0.0, 0.0])
    shift = target - part.centre(table.by if table.join is not None else "input")
    return replace(part, placement=replace(placement, shift=shift))


def _check_stiffness(plan: Plan, parts: dict[str, Part]) -> None:
    """Refuse parts of other stiffness than the first: a problem has one for all its beams."""
    first = next(iter(parts.values()))
    own = first.design.problem.stiffness
    for part in parts.values():
        other = part.design.problem.stiffness
        if (other.bond, other.angle) != (own.bond, own.angle):
            raise InvalidFile(
                f"{plan.source}: parts {first.name} and {part.name} are made of different struts: "
                f"stiffness {own.bond:g} and {own.angle:g} against {other.bond:g} and "
                f"{other.angle:g}"
            )
