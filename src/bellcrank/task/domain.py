"""Lattices that fill a domain."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from shapely.geometry import box

from bellcrank.errors import InvalidFile, InvalidProblem
from bellcrank.model import Lattice
from bellcrank.model.lattice import MAX_NODES
from bellcrank.model.parsing import parse
from bellcrank.task.outlines import read_outline
from bellcrank.task.schema import Shape
from bellcrank.task.shapes import polygon_of, shape_of

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from bellcrank.task.schema import DomainSection

ROW_HEIGHT = math.sqrt(3.0) / 2.0
"""Distance of the rows of a triangular lattice, in spacings."""


def fill(region: BaseGeometry, spacing: float, width: float) -> Lattice:
    """Return the triangular lattice whose struts lie in a region.

    It is centred in the bounding box of the region. Pieces that are not connected with the
    largest one are left out.

    Parameters
    ----------
    region
        Region, mm.
    spacing
        Distance of neighbouring nodes, mm.
    width
        Width of the struts, mm.

    Returns
    -------
    Lattice
        In units of the spacing, with the origin of the region.

    Raises
    ------
    InvalidProblem
        If no strut fits, or the lattice would be too large.

    Examples
    --------
    >>> lattice = fill(box(0.0, 0.0, 62.0, 54.0), spacing=10.0, width=2.0)
    >>> lattice.node_count, lattice.positions.max(axis=0).round(2)
    (46, array([6.1, 5.3]))
    """
    inner = region.buffer(-0.5 * width + 1e-6 * spacing, join_style="mitre")
    if inner.is_empty:
        raise InvalidProblem(
            f"domain: no strut of {width:g} mm fits into it; its size is {_size(region)}"
        )
    low_x, low_y, high_x, high_y = inner.bounds
    middle = 0.5 * (low_x + high_x), 0.5 * (low_y + high_y)
    height = ROW_HEIGHT * spacing
    rows = math.floor((high_y - low_y) / height + 1e-6) + 1
    columns = math.floor((high_x - low_x) / spacing + 1e-6) + 1
    if rows * columns > MAX_NODES:
        raise InvalidProblem(
            f"domain: {rows * columns:,} nodes at a spacing of {spacing:g} mm in {_size(region)}; "
            f"expected at most {MAX_NODES:,}; are the lengths in mm?"
        )
    points = []
    for row in range(rows):
        y = middle[1] + (row - 0.5 * (rows - 1)) * height
        count = columns - row % 2
        if row % 2 and columns * spacing <= high_x - low_x + 1e-6 * spacing:
            count = columns + 1
        x = middle[0] + (np.arange(count) - 0.5 * (count - 1)) * spacing
        points.append(np.column_stack([x, np.full(count, y)]))
    positions = np.concatenate(points)
    return _within(positions, inner, spacing)


def _within(positions: NDArray[np.float64], inner: BaseGeometry, spacing: float) -> Lattice:
    """Return the lattice of the struts between neighbours that lie in a region."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    pairs = cKDTree(positions).query_pairs(1.01 * spacing, output_type="ndarray")
    shapely.prepare(inner)
    beams = pairs[shapely.covers(inner, shapely.linestrings(positions[pairs]))]
    if not len(beams):
        raise InvalidProblem(
            f"domain: no strut of the lattice, {spacing:g} mm long, fits into it; its inner size "
            f"is {_size(inner)}; choose a smaller spacing"
        )
    count = len(positions)
    graph = coo_matrix((np.ones(len(beams)), beams.T), shape=(count, count))
    _, piece = connected_components(graph, directed=False)
    largest = np.bincount(piece[beams[:, 0]]).argmax()
    connected = np.flatnonzero(piece == largest)
    number = np.full(count, -1)
    number[connected] = np.arange(len(connected))
    beams = np.sort(number[beams[piece[beams[:, 0]] == largest]], axis=1)
    return Lattice(positions[connected] / spacing, beams[np.lexsort(beams.T[::-1])])


def _size(region: BaseGeometry) -> str:
    x_min, y_min, x_max, y_max = region.bounds
    return f"{x_max - x_min:.4g} x {y_max - y_min:.4g} mm"


def region_of(domain: DomainSection, folder: Path) -> BaseGeometry:
    """Return the region that a domain describes, mm, without its holes.

    Parameters
    ----------
    domain
        Table of a task, with a size or an outline.
    folder
        Folder of the task file, in which outlines are looked up.

    Raises
    ------
    InvalidProblem, InvalidFile
        If it is empty, or the file of the outline cannot be read.
    """
    if domain.size is not None:
        width, height = domain.size
        if width <= 0.0 or height <= 0.0:
            raise InvalidProblem(
                f"domain.size: expected lengths above 0, got [{width:g}, {height:g}]"
            )
        region: Any = box(0.0, 0.0, width, height)
    elif isinstance(domain.outline, str):
        region = read_outline(folder / domain.outline)
    elif isinstance(domain.outline, dict | Shape):
        shape = parse(Shape, domain.outline, "domain.outline")  # type: ignore[arg-type]
        region = shape_of(shape, "domain.outline")
    else:
        region = polygon_of(_corners(domain.outline), "domain.outline")
    for name in ("holes", "keep_out"):
        for index, shape in enumerate(getattr(domain, name)):
            region = region.difference(shape_of(shape, f"domain.{name}[{index}]"))
    if region.is_empty:
        raise InvalidProblem("domain: its holes and keep-out regions leave nothing of it")
    return region


def boundary_of(region: BaseGeometry, spacing: float) -> tuple[NDArray[np.float64], ...]:
    """Return the rings around a region, and around its holes, in units of the spacing.

    Examples
    --------
    >>> (ring,) = boundary_of(box(0.0, 0.0, 20.0, 10.0), spacing=10.0)
    >>> ring.tolist()
    [[2.0, 0.0], [2.0, 1.0], [0.0, 1.0], [0.0, 0.0]]
    """
    polygons = [each for each in getattr(region, "geoms", [region]) if each.geom_type == "Polygon"]
    loops = [loop for each in polygons for loop in (each.exterior, *each.interiors)]
    return tuple(np.array(loop.coords)[:-1, :2] / spacing for loop in loops)


def _corners(outline: object) -> list[list[float]]:
    """Return the corners of an outline, mm."""
    from bellcrank.errors import InvalidSettings
    from bellcrank.part.units import read_length

    wanted = "a DXF or SVG file, a shape, or corners [[x, y], ...]"
    if not isinstance(outline, list | tuple):
        raise InvalidFile(f"domain.outline: expected {wanted}, got {outline!r}")
    corners = []
    for index, point in enumerate(outline):
        if not isinstance(point, list | tuple) or len(point) != 2:
            raise InvalidFile(f"domain.outline[{index}]: expected a point [x, y], got {point!r}")
        try:
            corners.append([read_length(f"domain.outline[{index}]", each) for each in point])
        except InvalidSettings as error:
            raise InvalidFile(str(error)) from None
    return corners


def in_regions(
    shapes: Sequence[Shape], lattice: Lattice, spacing: float, key: str
) -> NDArray[np.bool_]:
    """Return (M,) the beams with both ends in one of some regions."""
    inside = np.zeros(lattice.beam_count, dtype=bool)
    positions = lattice.positions * spacing
    for index, shape in enumerate(shapes):
        region = shape_of(shape, f"{key}[{index}]").buffer(1e-6 * spacing)
        within = shapely.contains_xy(region, positions[:, 0], positions[:, 1])
        found = within[lattice.beams].all(axis=1)
        if not found.any():
            raise InvalidProblem(f"{key}[{index}]: no beam lies in this region")
        inside |= found
    return inside
