"""Placement of parts: reflection, rotation, scaling and translation.

Examples
--------
>>> rotated = Placement(rotate=60, shift=np.array([1.0, 0.0]))
>>> rotated.positions(np.array([[1.0, 0.0]])).round(3)
array([[1.5  , 0.866]])
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import BellcrankError, InvalidFile
from bellcrank.machines.plan import ROTATION_STEP, port_name
from bellcrank.model import require_plane

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from bellcrank.machines.plan import PartTable, Plan
    from bellcrank.model import Design, Input, Output, Problem

HALF = math.sqrt(3.0) / 2.0
COSINE = (1.0, 0.5, -0.5, -1.0, -0.5, 0.5)
SINE = (0.0, HALF, HALF, 0.0, -HALF, -HALF)
"""Values at multiples of 60 degrees, equal to the last bit for opposite angles."""


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """A similarity transformation: reflect, rotate, scale, translate.

    Parameters
    ----------
    mirror
        Whether the sign of x is changed first.
    rotate
        Rotation in degrees, counter-clockwise, a multiple of 60.
    scale
        Scale factor.
    shift : (2,) float64
        Translation in lattice units of the machine.
    """

    mirror: bool = False
    rotate: int = 0
    scale: float = 1.0
    shift: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))

    @property
    def rotation(self) -> NDArray[np.float64]:
        """(2, 2) orthogonal matrix of reflection and rotation."""
        number = self.rotate // ROTATION_STEP % 6
        cosine, sine = COSINE[number], SINE[number]
        matrix = np.array([[cosine, -sine], [sine, cosine]])
        return matrix @ np.diag([-1.0, 1.0]) if self.mirror else matrix

    def positions(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the transformed points (n, 2)."""
        return self.scale * self.directions(points) + self.shift

    def directions(self, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the reflected and rotated vectors (n, 2), of unchanged length."""
        rotated: NDArray[np.float64] = vectors @ self.rotation.T
        return rotated


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A design and its placement in a machine.

    Parameters
    ----------
    name
        Name of the part in the plan.
    design
        Design in its own coordinates.
    placement
        Transformation from its coordinates to those of the machine.
    supported
        Whether its supports are supports of the machine.
    """

    name: str
    design: Design
    placement: Placement
    supported: bool = True

    @property
    def positions(self) -> NDArray[np.float64]:
        """(N, 2) node positions in the machine."""
        return self.placement.positions(self.design.problem.lattice.positions)

    @property
    def spacing(self) -> float:
        """Median beam length in the machine."""
        return self.placement.scale * float(np.median(self.design.problem.lattice.rest_length))

    def region(self, port: str) -> Input | Output:
        """Return the input or the output of the design."""
        problem = self.design.problem
        return problem.input if port == "input" else problem.output

    def centre(self, port: str) -> NDArray[np.float64]:
        """(2,) mean position of the nodes of a port, in the machine."""
        centre: NDArray[np.float64] = self.positions[self.region(port).nodes].mean(axis=0)
        return centre

    def direction(self, port: str) -> NDArray[np.float64]:
        """(n, 2) unit directions of the nodes of a port, in the machine."""
        return self.placement.directions(self.region(port).direction)


def place_parts(plan: Plan, find: Callable[[str], Design]) -> dict[str, Part]:
    """Return the parts of a plan at their positions, in the order of the plan.

    Parameters
    ----------
    find
        Function from the entry of a part (a name or a file) to its design.

    Raises
    ------
    InvalidFile
        If an entry does not exist, is not a design or is in space, or parts have different
        models, stiffness, sections or materials.
    """
    parts: dict[str, Part] = {}
    for name in plan.order:
        table = plan.table.parts[name]
        try:
            design = find(table.entry)
            require_plane(design.problem, "machine")
        except BellcrankError as error:
            raise InvalidFile(f"{plan.source}: parts.{name}.entry: {error}") from None
        parts[name] = _placed(name, table, design, parts)
    _check_models(plan, parts)
    return {name: parts[name] for name in plan.table.parts}


def _placed(name: str, table: PartTable, design: Design, parts: dict[str, Part]) -> Part:
    placement = Placement(table.mirror, table.rotate, table.scale)
    part = Part(name, design, placement, table.supports)
    if table.join is not None:
        joined = port_name(table.join)
        target = parts[joined.part].centre(joined.port)
    else:
        target = np.array(table.at or [0.0, 0.0])
    shift = target - part.centre(table.by if table.join is not None else "input")
    return replace(part, placement=replace(placement, shift=shift))


def _check_models(plan: Plan, parts: dict[str, Part]) -> None:
    """Check that all parts have the model of the first: a problem has one for all beams."""
    first = next(iter(parts.values()))
    for part in parts.values():
        for what, one, other in _differences(first.design.problem, part.design.problem):
            raise InvalidFile(
                f"{plan.source}: parts {first.name} and {part.name} have different {what}: {one} "
                f"against {other}; all parts of a machine must have the same"
            )


def _differences(first: Problem, other: Problem) -> Iterator[tuple[str, str, str]]:
    """Yield what differs between the models of two problems, and both values as text."""
    if (first.section is None) != (other.section is None):
        names = ["springs" if each.section is None else "frames" for each in (first, other)]
        yield "models (--model reads all parts as one)", names[0], names[1]
    for what, describe in (
        ("stiffness", _stiffness_text), ("sections", _section_text), ("materials", _material_text),
    ):  # fmt: skip
        one, two = describe(first), describe(other)
        if one != two:
            yield what, one, two


def _stiffness_text(problem: Problem) -> str:
    return f"bond {problem.stiffness.bond:g} and angle {problem.stiffness.angle:g}"


def _section_text(problem: Problem) -> str:
    section = problem.section
    return "" if section is None else f"width {section.width:g}, thickness {section.thickness:g}"


def _material_text(problem: Problem) -> str:
    material = problem.material
    # Young's modulus may contain the rounding errors of a mean length.
    return "" if material is None else f"young {material.young:.6g}, poisson {material.poisson:g}"
