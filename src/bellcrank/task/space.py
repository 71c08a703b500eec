"""Domains, shapes and regions of nodes in space, in mm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidFile, InvalidProblem
from bellcrank.model import Lattice, lattices
from bellcrank.model.calls import call_with_keys
from bellcrank.model.lattices.crystals import without_dead_ends
from bellcrank.task.surfaces import Surface, read_surface

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.part import PartSpec
    from bellcrank.task.schema import DomainSection, NodeRegion, Shape

    Points = NDArray[np.float64]
    Contains = Callable[[Points], NDArray[np.bool_]]

SHAPES = ("sphere", "cylinder", "box")
CELLS = ("octet", "cubic", "body-centred", "kelvin", "displaced-delaunay-space")
"""Lattices that fill a domain."""
SNAP = 1e-6
"""Distance, in spacings, by which points may lie outside a shape."""
STATIONS = 9
"""Number of sections of a strut at which its surface is compared with a domain."""
AROUND = 8
"""Number of points of each section."""
FACES = {
    "left": (0, 0.55), "right": (0, 0.55), "front": (1, 0.55), "back": (1, 0.55),
    "bottom": (2, 0.3), "top": (2, 0.3),
}  # fmt: skip
"""Axis of each face, and the distance, in spacings, up to which nodes belong to it."""


def shape_in_space(shape: Shape, key: str) -> Contains:
    """Return a function from points (n, 3), mm, to whether they are in a shape (n,).

    Raises
    ------
    InvalidProblem
        If the table describes no shape in space, several, or an empty one.

    Examples
    --------
    >>> from bellcrank.task.schema import Shape
    >>> ball = shape_in_space(Shape(sphere=[0, 0, 0], radius="1 cm"), "hole")
    >>> ball(np.array([[0.0, 9.0, 0.0], [8.0, 8.0, 0.0]]))
    array([ True, False])
    """
    given = [name for name in SHAPES if getattr(shape, name) is not None]
    others = [name for name in ("circle", "polygon") if getattr(shape, name) is not None]
    if len(given) != 1 or others:
        raise InvalidProblem(
            f"{key}: expected one of {', '.join(SHAPES)} in space, got "
            f"{' and '.join([*given, *others]) or 'none'}"
        )
    (kind,) = given
    if (shape.radius is None) != (kind == "box"):
        raise InvalidProblem(f"{key}: expected a radius with sphere or cylinder")
    if kind == "box":
        low, high = _box(shape, key)
        return lambda points: np.all((points >= low) & (points <= high), axis=1)
    radius = shape.radius
    assert radius is not None
    if radius <= 0.0:
        raise InvalidProblem(f"{key}.radius: expected a length above 0, got {radius:g}")
    centre, axes = getattr(shape, kind), 3 if kind == "sphere" else 2
    if len(centre) != axes:
        raise InvalidProblem(
            f"{key}.{kind}: expected [{', '.join('xyz'[:axes])}], got {list(centre)}"
        )
    return lambda points: np.linalg.norm(points[:, :axes] - centre, axis=1) <= radius


def _box(shape: Shape, key: str) -> tuple[Points, Points]:
    assert shape.box is not None
    low, high = np.array(shape.box[:3]), np.array(shape.box[3:])
    if len(shape.box) != 6 or not (low < high).all():
        raise InvalidProblem(
            f"{key}.box: expected [x_min, y_min, z_min, x_max, y_max, z_max], got {list(shape.box)}"
        )
    return low, high


@dataclass(frozen=True, slots=True)
class _Body:
    """Where struts may be: in an envelope, and outside of holes."""

    surface: Surface | None
    holes: tuple[Contains, ...]

    @property
    def is_whole_envelope(self) -> bool:
        return self.surface is None and not self.holes

    def holds(self, points: Points) -> NDArray[np.bool_]:
        """Return (n,) whether points are inside."""
        inside = np.ones(len(points), dtype=bool)
        if self.surface is not None:
            inside &= self.surface.contains(points)
        for hole in self.holes:
            inside &= ~hole(points)
        return inside


def fill_in_space(domain: DomainSection, part: PartSpec, folder: Path) -> Lattice:
    """Return the lattice whose struts lie in a domain in space.

    Parameters
    ----------
    domain
        Table of a task with a size, or with the file of a closed surface as its outline.
    part
        Diameter of the struts and spacing of the nodes.
    folder
        Folder of the task file.

    Returns
    -------
    Lattice
        In units of the spacing, with the origin of the domain.

    Raises
    ------
    InvalidProblem, InvalidFile
        If no strut fits, a value is outside its bounds, or the surface cannot be read.

    Examples
    --------
    >>> from pathlib import Path
    >>> from bellcrank.part import PartSpec
    >>> from bellcrank.task.schema import DomainSection
    >>> lattice = fill_in_space(DomainSection(size=["32 mm"] * 3), PartSpec(), Path())
    >>> lattice.node_count, lattice.dimension
    (63, 3)
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
    inner = (size - part.width) / part.scale
    if not (inner > 0.0).all():
        raise InvalidProblem(
            f"domain: no strut of {part.width:g} mm fits into it; its size is "
            f"{' x '.join(f'{each:.4g}' for each in size)} mm"
        )
    kind, options = _cells(domain)
    whole: Lattice = call_with_keys(
        lattices[kind], {**options, "size": inner.tolist()}, "domain.cells"
    )
    origin = (low + 0.5 * part.width) / part.scale
    lattice = Lattice(whole.positions + origin, whole.beams)
    holes = tuple(
        shape_in_space(shape, f"domain.{name}[{index}]")
        for name in ("holes", "keep_out")
        for index, shape in enumerate(getattr(domain, name))
    )
    body = _Body(surface, holes)
    return lattice if body.is_whole_envelope else _inside(lattice, body, part)


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


def _inside(lattice: Lattice, body: _Body, part: PartSpec) -> Lattice:
    """Return the part of a lattice whose struts lie in a body."""
    positions, beams = lattice.positions * part.scale, lattice.beams
    inside = np.ones(len(beams), dtype=bool)
    for points in _strut_surfaces(positions, beams, 0.5 * part.width):
        left = np.flatnonzero(inside)
        inside[left] = body.holds(points[left])
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
    reach = (1.0 - SNAP) * radius
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
        within = _nodes_in(shape, lattice.positions * spacing, spacing, f"{key}[{index}]")
        found = within[lattice.beams].all(axis=1)
        if not found.any():
            raise InvalidProblem(f"{key}[{index}]: no beam lies in this region")
        inside |= found
    return inside


def _nodes_in(shape: Shape, positions: Points, spacing: float, key: str) -> NDArray[np.bool_]:
    """Return (N,) the nodes in a shape, those that rounding puts just outside included."""
    contains = shape_in_space(shape, key)
    shifts = SNAP * spacing * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    inside: NDArray[np.bool_] = np.any([contains(positions + shift) for shift in shifts], axis=0)
    return inside


def face_nodes(region: NodeRegion, positions: Points, spacing: float) -> NDArray[np.int64]:
    """Return the nodes on one side of a domain in space."""
    assert region.face is not None
    axis, most = FACES[region.face]
    along = positions[:, axis]
    at_low = region.face in {"left", "front", "bottom"}
    depth = along - along.min() if at_low else along.max() - along
    return np.flatnonzero(depth <= most * spacing)


def nodes_in_shape(
    region: NodeRegion, positions: Points, spacing: float, key: str
) -> NDArray[np.int64]:
    """Return the nodes in a shape in space.

    Raises
    ------
    InvalidProblem
        If there are none.
    """
    inside = np.flatnonzero(_nodes_in(region, positions, spacing, key))
    if not len(inside):
        low, high = positions.min(axis=0), positions.max(axis=0)
        extent = ", ".join(
            f"{axis} = {a:.4g} to {b:.4g}" for axis, a, b in zip("xyz", low, high, strict=True)
        )
        raise InvalidProblem(
            f"{key}: no node lies in this shape; the lattice extends from {extent} mm"
        )
    return inside
