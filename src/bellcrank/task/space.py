"""Lattices that fill a domain in space."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidFile, InvalidProblem
from bellcrank.model import Lattice, lattices
from bellcrank.model.calls import call_with_keys
from bellcrank.model.lattices.crystals import without_dead_ends
from bellcrank.task.shapes import ROUNDING, shape_in_space
from bellcrank.task.surfaces import Surface, read_surface

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.part import PartSpec
    from bellcrank.task.schema import DomainSection, Shape

    Points = NDArray[np.float64]

CELLS = ("octet", "cubic", "body-centred", "kelvin", "displaced-delaunay-space")
"""Lattices that fill a domain."""
WITHIN = 1.0 - 1e-6
"""Radius at which the surface of a strut is compared with a domain, over that of the strut."""
STATIONS = 9
"""Number of sections of a strut at which its surface is compared with a domain."""
LEAST_SIDES = 16
"""Smallest number of sides of the polyhedra of round holes."""
AROUND = 8
"""Number of points of each section."""


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """Region of space in which struts may be: a box or a closed surface, outside of holes.

    Parameters
    ----------
    low, size : (3,)
        Smallest coordinates and lengths of the bounding box, mm.
    surface
        Surface around the body; None for the box.
    holes
        Shapes outside of which the body is, by their names in the task.
    """

    low: Points
    size: Points
    surface: Surface | None
    holes: Mapping[str, Shape]

    @property
    def is_box(self) -> bool:
        """Whether the body is its bounding box."""
        return self.surface is None and not self.holes

    def contains(self, points: Points) -> NDArray[np.bool_]:
        """Return (n,) which points (n, 3) of the bounding box, mm, are in the body."""
        inside = np.ones(len(points), dtype=bool)
        if self.surface is not None:
            inside &= self.surface.contains(points)
        for name, shape in self.holes.items():
            inside &= ~shape_in_space(shape, name)(points)
        return inside

    def boundary(self, spacing: float, sagitta: float) -> Points:
        """Return (k, 3, 3) the triangles of its surface, in units of the spacing.

        Small triangles are joined, and round holes are polyhedra, within the sagitta, mm.
        """
        import manifold3d

        if self.surface is None:
            body = manifold3d.Manifold.cube(self.size.tolist()).translate(self.low.tolist())
        else:
            body = _solid_of(self.surface).simplify(sagitta)
        for shape in self.holes.values():
            body -= _hole(shape, self.low, self.low + self.size, sagitta)
        mesh = body.to_mesh64()
        corners: Points = np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts)]
        return corners / spacing


def body_of(domain: DomainSection, folder: Path) -> Body:
    """Return the region of space that a domain describes.

    Parameters
    ----------
    domain
        Table of a task with a size, or with the file of a closed surface as its outline.
    folder
        Folder of the task file.

    Raises
    ------
    InvalidProblem, InvalidFile
        If a length is not above 0, a hole is no shape in space, or the surface cannot be read.

    Examples
    --------
    >>> from pathlib import Path
    >>> from bellcrank.task.schema import DomainSection
    >>> body = body_of(DomainSection(size=["32 mm"] * 3), Path())
    >>> body.contains(np.zeros((1, 3))), body.boundary(10.0, 0.1).shape
    (array([ True]), (12, 3, 3))
    """
    surface = None
    if domain.size is not None:
        low, size = np.zeros(3), np.array(domain.size)
        if not (size > 0.0).all():
            raise InvalidProblem(f"domain.size: expected lengths above 0, got {size.tolist()}")
    else:
        assert isinstance(domain.outline, str)
        surface = read_surface(folder / domain.outline)
        low, size = surface.low, surface.high - surface.low
    holes = {
        f"domain.{name}[{index}]": shape
        for name in ("holes", "keep_out")
        for index, shape in enumerate(getattr(domain, name))
    }
    for name, shape in holes.items():
        shape_in_space(shape, name)
    return Body(low, size, surface, holes)


def fill_in_space(body: Body, domain: DomainSection, part: PartSpec) -> Lattice:
    """Return the lattice whose struts lie in a body.

    Parameters
    ----------
    body
        Region of space.
    domain
        Table of a task, which names the cells.
    part
        Diameter of the struts and spacing of the nodes.

    Returns
    -------
    Lattice
        In units of the spacing, with the origin of the domain.

    Raises
    ------
    InvalidProblem, InvalidFile
        If no strut fits, or a value is outside its bounds.

    Examples
    --------
    >>> from pathlib import Path
    >>> from bellcrank.part import PartSpec
    >>> from bellcrank.task.schema import DomainSection
    >>> domain = DomainSection(size=["32 mm"] * 3)
    >>> lattice = fill_in_space(body_of(domain, Path()), domain, PartSpec())
    >>> lattice.node_count, lattice.dimension
    (63, 3)
    """
    inner = (body.size - part.width) / part.scale
    if not (inner > 0.0).all():
        raise InvalidProblem(
            f"domain: no strut of {part.width:g} mm fits into it; its size is "
            f"{' x '.join(f'{each:.4g}' for each in body.size)} mm"
        )
    kind, options = _cells(domain)
    whole: Lattice = call_with_keys(
        lattices[kind], {**options, "size": inner.tolist()}, "domain.cells"
    )
    origin = (body.low + 0.5 * part.width) / part.scale
    lattice = Lattice(whole.positions + origin, whole.beams)
    return lattice if body.is_box else _inside(lattice, body, part)


def _solid_of(surface: Surface) -> Any:
    """Return the solid that a closed surface encloses."""
    import manifold3d

    points, triangles = surface.joined()
    if np.linalg.det(points[triangles]).sum() < 0.0:  # six times the volume
        triangles = triangles[:, ::-1]
    return manifold3d.Manifold(manifold3d.Mesh64(points, triangles.astype(np.uint64)))


def _hole(shape: Shape, low: Points, high: Points, sagitta: float) -> Any:
    """Return the solid of a hole in a box."""
    import manifold3d

    if shape.box is not None:
        first, second = np.array(shape.box[:3]), np.array(shape.box[3:])
        return manifold3d.Manifold.cube((second - first).tolist()).translate(first.tolist())
    assert shape.radius is not None
    half_angle = math.acos(max(1.0 - sagitta / shape.radius, 0.0))
    sides = max(LEAST_SIDES, 4 * math.ceil(math.pi / half_angle / 4.0))
    if shape.sphere is not None:
        ball = manifold3d.Manifold.sphere(shape.radius, sides)
        return ball.translate(list(shape.sphere))
    assert shape.cylinder is not None
    height = float(high[2] - low[2])
    foot = [*shape.cylinder, float(low[2]) - height]
    column = manifold3d.Manifold.cylinder(3.0 * height, shape.radius, shape.radius, sides)
    return column.translate(foot)


def _cells(domain: DomainSection) -> tuple[str, dict[str, Any]]:
    """Return the kind of a lattice in space and its options."""
    given = domain.cells
    options = dict(given) if isinstance(given, dict) else {"kind": given or CELLS[0]}
    kind = options.pop("kind", None)
    if kind not in CELLS:
        raise InvalidFile(f"domain.cells: expected one of {', '.join(CELLS)}, got {kind!r}")
    for name in ("size", "spacing"):
        if name in options:
            raise InvalidFile(
                f"domain.cells.{name}: expected domain.size and part.spacing in its place"
            )
    return kind, options


def _inside(lattice: Lattice, body: Body, part: PartSpec) -> Lattice:
    """Return the part of a lattice whose struts lie in a body."""
    positions, beams = lattice.positions * part.scale, lattice.beams
    inside = np.ones(len(beams), dtype=bool)
    for points in _strut_surfaces(positions, beams, 0.5 * part.width):
        left = np.flatnonzero(inside)
        inside[left] = body.contains(points[left])
    nodes, inner = without_dead_ends(lattice.node_count, beams[inside])
    if not len(inner):
        raise InvalidProblem(
            f"domain: no strut of the lattice fits into it; choose a spacing below "
            f"{part.scale:g} mm or other cells"
        )
    return Lattice(lattice.positions[nodes], inner)


def _strut_surfaces(positions: Points, beams: NDArray[np.int64], radius: float) -> list[Points]:
    """Return points (m, 3) of each strut, one set after the other, slightly within its surface."""
    first, second = positions[beams].transpose(1, 0, 2)
    axis = (second - first) / np.linalg.norm(second - first, axis=1)[:, None]
    helper = np.where(np.abs(axis[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    one = np.cross(helper, axis)
    one /= np.linalg.norm(one, axis=1)[:, None]
    two = np.cross(axis, one)
    reach = WITHIN * radius
    found = [first - reach * axis, second + reach * axis]
    angles = 2.0 * np.pi * np.arange(AROUND) / AROUND
    found += [
        first + share * (second - first) + reach * (np.cos(angle) * one + np.sin(angle) * two)
        for share in np.linspace(0.0, 1.0, STATIONS)
        for angle in angles
    ]
    return found


def beams_in_space(
    shapes: Sequence[Shape], lattice: Lattice, spacing: float, key: str
) -> NDArray[np.bool_]:
    """Return (M,) the beams with both ends in one of some shapes.

    Raises
    ------
    InvalidProblem
        If no beam lies in one of them.
    """
    inside = np.zeros(lattice.beam_count, dtype=bool)
    for index, shape in enumerate(shapes):
        contains = shape_in_space(shape, f"{key}[{index}]", ROUNDING * spacing)
        within = contains(lattice.positions * spacing)
        found = within[lattice.beams].all(axis=1)
        if not found.any():
            raise InvalidProblem(f"{key}[{index}]: no beam lies in this region")
        inside |= found
    return inside
