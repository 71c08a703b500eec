"""Lattices that fill a domain in space."""

from __future__ import annotations

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
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.part import PartSpec
    from bellcrank.task.schema import DomainSection, Shape
    from bellcrank.task.shapes import Contains

    Points = NDArray[np.float64]

CELLS = ("octet", "cubic", "body-centred", "kelvin", "displaced-delaunay-space")
"""Lattices that fill a domain."""
WITHIN = 1.0 - 1e-6
"""Radius at which the surface of a strut is compared with a domain, over that of the strut."""
STATIONS = 9
"""Number of sections of a strut at which its surface is compared with a domain."""
AROUND = 8
"""Number of points of each section."""


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
