"""Tables of a task file, which are also the classes of a task in Python.

Numbers may carry a unit (`bellcrank.task.values`); bare ones are in mm, N, g, degrees and N/mm.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field

from bellcrank.model.parsing import Table
from bellcrank.model.tolerances import USUAL
from bellcrank.task.values import (
    Angle,
    Box,
    Direction,
    Force,
    Length,
    Mass,
    Pair,
    Point,
    Ratio,
    Stiffness,
    as_list,
    as_range,
    as_tuple,
    reader,
    switch,
)

SCHEMA = "bellcrank/task/1"


def _as_bounds(value: Any) -> Any:
    """Return a list of tables for a table or a single value."""
    return [each if isinstance(each, dict | Bounds) else {"value": each} for each in as_list(value)]


class PartSection(Table):
    """``[part]``: size of the struts and material."""

    width: Length = 2.0
    """Width of the struts."""
    thickness: Length = 5.0
    """Thickness of the part."""
    spacing: Length = 10.0
    """Length of a lattice unit: the distance of neighbouring nodes."""
    fillet: Length | None = None
    """Radius in the corners between struts."""
    joint: Length | None = None
    """Length of the ends of struts that do not bend in frames."""
    material: Any = "ninjaflex"
    """Name of a registered material, or a table."""


class Shape(Table):
    """A region: exactly one of circle, box and polygon, in space of sphere, cylinder and box."""

    circle: Pair | None = None
    """Centre of a circle in the plane; with `radius`."""
    sphere: Point | None = None
    """Centre of a sphere; with `radius`."""
    cylinder: Point | None = None
    """Axis [x, y] of an upright cylinder; with `radius`."""
    radius: Length | None = None
    box: Box | None = None
    """x_min, y_min, x_max, y_max; in space x_min, y_min, z_min, x_max, y_max, z_max."""
    polygon: list[Point] | None = None
    """Corners, in the plane."""


class NodeRegion(Shape):
    """Nodes: those in a shape, next to a point, on an edge of the domain, or given by number."""

    point: Point | None = None
    """The nodes nearest to a point."""
    count: int = 1
    """Number of nodes nearest to the point."""
    edge: Literal["left", "right", "top", "bottom"] | None = None
    """The nodes on one side of a domain in the plane."""
    between: Pair | None = None
    """Range of an edge: from and to, along it."""
    face: Literal["left", "right", "front", "back", "bottom", "top"] | None = None
    """The nodes on one side of a domain in space."""
    nodes: list[int] | None = None
    """Numbers of nodes."""
    without: Shape | None = None
    """A shape whose nodes are left out."""


class DomainSection(Table):
    """``[domain]``: where material may be."""

    size: Point | None = None
    """Width and height of a rectangle with its lower left corner at the origin; in space width,
    depth and height of a box."""
    outline: Any = None
    """DXF or SVG file, next to the task file, a shape, or the corners of a polygon; in space an STL
    file."""
    cells: Any = None
    """Lattice that fills a domain in space: a name, or a table of its kind and options."""
    lattice: dict[str, Any] | None = None
    """A lattice by name, as in a problem file; in lattice units."""
    problem: str | None = None
    """A bundled problem, of which lattice, supports, input and output are taken."""
    holes: list[Shape] = Field(default_factory=list)
    """Regions without material."""
    keep_out: list[Shape] = Field(default_factory=list)
    """Regions that are free of struts, like holes."""
    solid: list[Shape] = Field(default_factory=list)
    """Regions in which all beams are present."""


NodeRegions = Annotated[list[NodeRegion], BeforeValidator(as_list)]
"""A region, or several."""


class SupportSection(Table):
    """``[[supports]]``: nodes that are held."""

    at: NodeRegions
    hold: Literal["all", "x", "y", "z"] = "all"
    """Coordinates that are held; ``"x"``, ``"y"`` and ``"z"`` are rollers."""


StrokeRange = Annotated[tuple[Ratio, Ratio], BeforeValidator(as_range)]
"""Two fractions of the stroke."""


class InputSection(Table):
    """``[[cases.inputs]]``: nodes that are pushed."""

    at: NodeRegions | None = None
    direction: Direction | None = None
    displacement: Length | None = None
    """Displacement of each node."""
    force: Force | None = None
    """Total force."""
    during: StrokeRange | None = None
    """Fractions of the stroke between which it grows from zero to its full size."""


class LoadSection(Table):
    """``[[cases.loads]]``: a force, or a spring to the ground."""

    at: NodeRegions
    direction: Direction
    force: Annotated[float, reader("load")] | None = None
    """Total force, or the mass whose weight acts."""
    spring: Stiffness | None = None
    """Total stiffness."""
    during: StrokeRange | None = None
    """Fractions of the stroke between which the force grows; by default the whole stroke."""


class Bounds(Table):
    """What is wanted of a quantity."""

    model_config = ConfigDict(populate_by_name=True)

    value: Any = None
    """A single value in place of a table: ``"maximise"``, or a bound in its usual sense."""
    at_least: Any = None
    at_most: Any = None
    target: Any = None
    """With `tolerance`."""
    tolerance: Any = None
    """A percentage of the target, or a number in its unit."""
    start: Ratio | None = Field(default=None, alias="from")
    """Fraction of the stroke from which the bounds hold."""
    stop: Ratio | None = Field(default=None, alias="to")
    """Fraction of the stroke up to which the bounds hold."""
    of: Literal["every", "largest", "smallest", "spread"] = "every"
    """Whether every value in the range is bounded, the largest, the smallest, or the spread."""
    maximise: bool = False
    """Whether to maximise it once all is met."""
    minimise: bool = False
    scale: Any = None
    """Unit in which it is compared with other objectives."""


Wanted = Annotated[list[Bounds], BeforeValidator(_as_bounds)]
"""A table, several, or a single value with the usual meaning."""


class PathSection(Table):
    """A wanted path of the output."""

    points: list[Point] | None = None
    """Corners, from the rest position of the output, which is [0, 0]."""
    arc: Annotated[tuple[Length, Angle], BeforeValidator(as_tuple)] | None = None
    """Radius and angle of an arc that begins along the direction of the output; a positive angle
    turns left."""
    error: Ratio = 0.01
    """Allowed root mean square error, as a part of the length."""


class OutputSection(Table):
    """``[[cases.outputs]]``: nodes whose motion is wanted."""

    name: str | None = None
    at: NodeRegions | None = None
    direction: Direction | None = None
    spring: Stiffness | None = None
    """Total stiffness of a workpiece that resists along the direction."""
    gain: Wanted = Field(default_factory=list)
    travel: Wanted = Field(default_factory=list)
    off_axis: Wanted = Field(default_factory=list)
    rotation: Wanted = Field(default_factory=list)
    path: PathSection | None = None
    stiffness: Wanted = Field(default_factory=list)
    payload: Wanted = Field(default_factory=list)
    dead_load: Wanted = Field(default_factory=list)
    blocked_force: Wanted = Field(default_factory=list)
    sag: Wanted = Field(default_factory=list)


class CaseSection(Table):
    """``[[cases]]``: a load case."""

    name: str | None = None
    supports: list[SupportSection] = Field(default_factory=list)
    """Supports of this case besides those of the task."""
    inputs: list[InputSection] = Field(default_factory=list)
    loads: list[LoadSection] = Field(default_factory=list)
    gravity: Direction | None = None
    """Direction in which the own weight acts."""
    gravity_during: StrokeRange | None = None
    """Fractions of the stroke between which the own weight grows."""
    outputs: list[OutputSection] = Field(default_factory=list)
    input_force: Wanted = Field(default_factory=list)
    strain: Wanted = Field(default_factory=list)


class LimitsSection(Table):
    """``[limits]``: what holds in every case."""

    strain: Annotated[Any, switch("ratio")] = True
    """Largest principal strain; by default that of the material. false for no limit."""
    clearance: Annotated[Any, switch("length")] = True
    """Smallest gap between struts along the stroke; by default they must not touch."""
    stable_stroke: Ratio | None = None
    """Part of the stroke up to which the part is stable, such as 1.2."""
    strut_loss: Ratio | None = None
    """Largest part of the efficiency that the loss of a single strut may cost, such as '30%'."""
    mass: Mass | None = None
    """Largest mass of the struts."""
    symmetry: (
        Literal["x", "y", "z", "xy", "xz", "yz", "xyz", "2-fold", "3-fold", "4-fold", "6-fold"]
        | None
    ) = None
    """Mirror symmetry along axes, or in space rotational symmetry about the vertical axis."""
    upright: Direction = "down"
    """Direction of the own weight for `sag`."""


class ToleranceSection(Table):
    """``[tolerance]``: deviations of print and drive over which all items are to be met."""

    width: Ratio = USUAL.width
    """Largest deviation of all widths together, as a part of the width."""
    each_width: Ratio = USUAL.each_width
    """Standard deviation of the width of each strut, as a part of it."""
    node: Length = 0.1
    """Largest deviation of each coordinate of a node."""
    angle: Angle = USUAL.angle
    """Largest deviation of the direction of the input."""
    least_yield: Ratio = USUAL.least_yield
    """Part of random prints that are to meet all items."""
    keep: Ratio = USUAL.keep
    """Smallest efficiency with deviations over that as drawn, where items hold as drawn alone."""


class TaskTable(Table):
    """A task file."""

    schema_: Literal["bellcrank/task/1"] = Field(default="bellcrank/task/1", alias="schema")
    name: str
    description: str = ""
    part: PartSection = PartSection()
    domain: DomainSection
    supports: list[SupportSection] = Field(default_factory=list)
    cases: list[CaseSection]
    limits: LimitsSection = LimitsSection()
    tolerance: ToleranceSection | None = None
