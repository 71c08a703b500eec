"""Placement of parts: reflection, half a turn, rotation, scaling and translation.

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
from bellcrank.machines.plan import BASE, ROTATION_STEP, port_name

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
    """A similarity transformation: reflect, turn over, rotate, scale, translate.

    Parameters
    ----------
    mirror
        Whether the sign of x is changed first.
    upside_down
        Whether the signs of y and z are changed then, in space.
    rotate
        Rotation in degrees, counter-clockwise, a multiple of `ROTATION_STEP`; in space about z.
    scale
        Scale factor.
    shift : (d,) float64
        Translation in lattice units of the machine.
    """

    mirror: bool = False
    upside_down: bool = False
    rotate: int = 0
    scale: float = 1.0
    shift: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))

    @property
    def rotation(self) -> NDArray[np.float64]:
        """(d, d) orthogonal matrix of reflection and rotations."""
        turns, rest = divmod(self.rotate, 60)
        angle = math.radians(self.rotate)
        cosine, sine = round(math.cos(angle), 15), round(math.sin(angle), 15)
        if rest == 0:
            cosine, sine = COSINE[turns % 6], SINE[turns % 6]
        matrix = np.eye(len(self.shift))
        matrix[:2, :2] = [[cosine, -sine], [sine, cosine]]
        if self.upside_down:
            matrix[:, 1:] *= -1.0
        if self.mirror:
            matrix[:, 0] *= -1.0
        return matrix

    def positions(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the transformed points (n, d)."""
        return self.scale * self.directions(points) + self.shift

    def directions(self, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the reflected and rotated vectors (n, d), of unchanged length."""
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
        """(N, d) node positions in the machine."""
        return self.placement.positions(self.design.problem.lattice.positions)

    @property
    def spacing(self) -> float:
        """Median beam length in the machine."""
        return self.placement.scale * float(np.median(self.design.problem.lattice.rest_length))

    def nodes(self, port: str) -> NDArray[np.int64]:
        """Return (n,) the nodes of a port of the design."""
        problem = self.design.problem
        return problem.supports.nodes if port == BASE else self._region(port).nodes

    def _region(self, port: str) -> Input | Output:
        """Return the input or the output of the design."""
        problem = self.design.problem
        return problem.input if port == "input" else problem.output

    def centre(self, port: str) -> NDArray[np.float64]:
        """(d,) mean position of the nodes of a port, in the machine."""
        centre: NDArray[np.float64] = self.positions[self.nodes(port)].mean(axis=0)
        return centre

    def direction(self, port: str) -> NDArray[np.float64]:
        """(n, d) unit directions of the nodes of the input or the output, in the machine."""
        return self.placement.directions(self._region(port).direction)


def place_parts(plan: Plan, find: Callable[[str], Design]) -> dict[str, Part]:
    """Return the parts of a plan at their positions, in the order of the plan.

    Parameters
    ----------
    find
        Function from the entry of a part (a name or a file) to its design.

    Raises
    ------
    InvalidFile
        If an entry does not exist or is not a design, a placement is not one in the plane or in
        space, or parts have different dimensions, models, stiffness, sections or materials.
    """
    parts: dict[str, Part] = {}
    for name in plan.order:
        table = plan.table.parts[name]
        try:
            design = find(table.entry)
        except BellcrankError as error:
            raise InvalidFile(f"{plan.source}: parts.{name}.entry: {error}") from None
        _check_placement(plan, name, table, design.problem.lattice.dimension)
        parts[name] = _placed(name, table, design, parts)
    _check_models(plan, parts)
    return {name: parts[name] for name in plan.table.parts}


def _check_placement(plan: Plan, name: str, table: PartTable, dimension: int) -> None:
    where, step = {2: "the plane", 3: "space"}[dimension], ROTATION_STEP[dimension]
    if table.rotate % step:
        raise InvalidFile(
            f"{plan.source}: parts.{name}.rotate: expected a multiple of {step} degrees in "
            f"{where}, got {table.rotate}"
        )
    if table.at is not None and len(table.at) != dimension:
        raise InvalidFile(
            f"{plan.source}: parts.{name}.at: expected {dimension} coordinates in {where}, got "
            f"{len(table.at)}"
        )
    if table.upside_down and dimension == 2:
        raise InvalidFile(
            f"{plan.source}: parts.{name}.upside_down: expected a part in space; in the plane give "
            "mirror = true and rotate = 180"
        )


def _placed(name: str, table: PartTable, design: Design, parts: dict[str, Part]) -> Part:
    rest = np.zeros(design.problem.lattice.dimension)
    placement = Placement(table.mirror, table.upside_down, table.rotate, table.scale, rest)
    part = Part(name, design, placement, table.supports)
    if table.join is not None:
        joined = port_name(table.join)
        target = parts[joined.part].centre(joined.port)
    else:
        target = rest if table.at is None else np.array(table.at)
    shift = target - part.centre(table.by if table.join is not None else "input")
    return replace(part, placement=replace(placement, shift=shift))


def _check_models(plan: Plan, parts: dict[str, Part]) -> None:
    """Check that all parts have the model of the first: a problem has one for all beams."""
    first = next(iter(parts.values()))
    dimension = first.design.problem.lattice.dimension
    for name, region in (("input", plan.table.input), ("output", plan.table.output)):
        if region.direction is not None and len(region.direction[0]) != dimension:
            raise InvalidFile(
                f"{plan.source}: {name}.direction: expected {dimension} components, got "
                f"{len(region.direction[0])}"
            )
    for part in parts.values():
        for what, one, other in _differences(first.design.problem, part.design.problem):
            raise InvalidFile(
                f"{plan.source}: parts {first.name} and {part.name} have different {what}: {one} "
                f"against {other}; all parts of a machine must have the same"
            )


def _differences(first: Problem, other: Problem) -> Iterator[tuple[str, str, str]]:
    """Yield what differs between the models of two problems, and both values as text."""
    if first.lattice.dimension != other.lattice.dimension:
        names = [
            "in the plane" if each.lattice.dimension == 2 else "in space" for each in (first, other)
        ]
        yield "dimensions", names[0], names[1]
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
    if section is None:
        return ""
    if section.shape == "round":
        return f"diameter {section.width:g}"
    return f"width {section.width:g}, thickness {section.thickness:g}"


def _material_text(problem: Problem) -> str:
    material = problem.material
    # Young's modulus may contain the rounding errors of a mean length.
    return "" if material is None else f"young {material.young:.6g}, poisson {material.poisson:g}"
