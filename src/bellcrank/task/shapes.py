"""Shapes and regions of nodes, in mm."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely.geometry import Point, Polygon, box

from bellcrank.errors import InvalidProblem

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from bellcrank.task.schema import NodeRegion, Shape

    Points = NDArray[np.float64]
    Contains = Callable[[Points], NDArray[np.bool_]]

SHAPES = {2: ("circle", "box", "polygon"), 3: ("sphere", "cylinder", "box")}
"""Shapes in the plane and in space."""
REGIONS = {2: ("point", "edge", "nodes", *SHAPES[2]), 3: ("point", "face", "nodes", *SHAPES[3])}
"""Regions of nodes in the plane and in space."""
ROUND = ("circle", "sphere", "cylinder")
"""Shapes with a radius."""
SNAP = 1.25
"""Largest distance of a node from the point that it is named by, in spacings. The nearest node to a
corner of a domain may be one spacing away: every other row begins half a spacing later."""
SIDES = {
    2: {"left": (0, 0.55), "right": (0, 0.55), "bottom": (1, 0.3), "top": (1, 0.3)},
    3: {
        "left": (0, 0.55), "right": (0, 0.55), "front": (1, 0.55), "back": (1, 0.55),
        "bottom": (2, 0.3), "top": (2, 0.3),
    },
}  # fmt: skip
"""Axis of each edge or face, and the distance from the extreme coordinate up to which nodes belong
to it, in spacings: rows of a triangular lattice end alternately half a spacing inside."""
ROUNDING = 1e-6
"""Distance, in spacings, by which nodes may lie outside a shape."""


def kind_of(region: Shape, names: Sequence[str], key: str) -> str:
    """Return the one key that says what a shape or region is.

    Raises
    ------
    InvalidProblem
        If there is none, or several.
    """
    every = {*REGIONS[2], *REGIONS[3]}
    given = [name for name in sorted(every) if getattr(region, name, None) is not None]
    if len(given) != 1 or given[0] not in names:
        where = "space" if "sphere" in names else "the plane"
        raise InvalidProblem(
            f"{key}: expected one of {', '.join(names)} in {where}, got "
            f"{' and '.join(given) or 'none'}"
        )
    if (region.radius is not None) != (given[0] in ROUND):
        rounded = " or ".join(name for name in ROUND if name in names)
        raise InvalidProblem(f"{key}: expected {rounded} and radius together")
    if region.radius is not None and region.radius <= 0.0:
        raise InvalidProblem(f"{key}.radius: expected a length above 0, got {region.radius:g}")
    return given[0]


def shape_of(shape: Shape, key: str) -> BaseGeometry:
    """Return the region of the plane that a table describes.

    Raises
    ------
    InvalidProblem
        If it describes none, several, or an empty one.

    Examples
    --------
    >>> from bellcrank.task.schema import Shape
    >>> round(shape_of(Shape(box=[0, 0, 20, "1cm"]), "hole").area, 1)
    200.0
    """
    kind = kind_of(shape, SHAPES[2], key)
    if kind == "circle":
        assert shape.circle is not None
        assert shape.radius is not None
        return Point(shape.circle).buffer(shape.radius, quad_segs=32)
    if kind == "box":
        assert shape.box is not None
        if len(shape.box) != 4:
            raise InvalidProblem(
                f"{key}.box: expected [x_min, y_min, x_max, y_max], got {list(shape.box)}"
            )
        x_min, y_min, x_max, y_max = shape.box
        if x_min >= x_max or y_min >= y_max:
            raise InvalidProblem(
                f"{key}.box: expected [x_min, y_min, x_max, y_max], got {list(shape.box)}"
            )
        return box(*shape.box)
    assert shape.polygon is not None
    return polygon_of(shape.polygon, f"{key}.polygon")


def polygon_of(points: Sequence[Sequence[float]], key: str) -> Polygon:
    """Return a polygon.

    Raises
    ------
    InvalidProblem
        If it has fewer than three corners, or intersects itself.
    """
    if len(points) < 3:
        raise InvalidProblem(f"{key}: expected at least 3 corners, got {len(points)}")
    polygon = Polygon(points)
    if not polygon.is_valid or polygon.area == 0.0:
        reason = shapely.is_valid_reason(polygon)
        raise InvalidProblem(f"{key}: expected a polygon that does not intersect itself ({reason})")
    return polygon


def shape_in_space(shape: Shape, key: str, slack: float = 0.0) -> Contains:
    """Return a function from points (n, 3), mm, to whether they are in a shape (n,).

    Parameters
    ----------
    shape
        Table of a task.
    key
        Its name, for errors.
    slack
        Distance by which points may lie outside, mm.

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
    kind = kind_of(shape, SHAPES[3], key)
    if kind == "box":
        assert shape.box is not None
        low, high = np.array(shape.box[:3]), np.array(shape.box[3:])
        if len(shape.box) != 6 or not (low < high).all():
            raise InvalidProblem(
                f"{key}.box: expected [x_min, y_min, z_min, x_max, y_max, z_max], got "
                f"{list(shape.box)}"
            )
        low, high = low - slack, high + slack
        return lambda points: np.all((points >= low) & (points <= high), axis=1)
    assert shape.radius is not None
    centre, axes, reach = getattr(shape, kind), 3 if kind == "sphere" else 2, shape.radius + slack
    if len(centre) != axes:
        raise InvalidProblem(
            f"{key}.{kind}: expected [{', '.join('xyz'[:axes])}], got {list(centre)}"
        )
    return lambda points: np.linalg.norm(points[:, :axes] - centre, axis=1) <= reach


def nodes_at(
    regions: Sequence[NodeRegion], positions: NDArray[np.float64], spacing: float, key: str
) -> NDArray[np.int64]:
    """Return the nodes of regions, sorted.

    Parameters
    ----------
    regions
        Tables of a task.
    positions : (N, d)
        Nodes of the lattice, mm.
    spacing
        Distance of neighbouring nodes, mm.
    key
        Name of the regions, for errors.

    Raises
    ------
    InvalidProblem
        If a region has no node; says where the nearest one is.
    """
    found = []
    for index, region in enumerate(regions):
        name = f"{key}[{index}]" if len(regions) > 1 else key
        nodes = _nodes(region, positions, spacing, name)
        if region.without is not None:
            within = _contains(region.without, positions[nodes], spacing, f"{name}.without")
            if within.all():
                raise InvalidProblem(f"{name}.without: all nodes of the region lie in this shape")
            nodes = nodes[~within]
        found.append(nodes)
    return np.unique(np.concatenate(found))


def _contains(
    shape: Shape, positions: NDArray[np.float64], spacing: float, key: str
) -> NDArray[np.bool_]:
    """Return (n,) which positions lie in a shape."""
    if positions.shape[1] == 3:
        return shape_in_space(shape, key, ROUNDING * spacing)(positions)
    area = shape_of(shape, key).buffer(ROUNDING * spacing)
    return np.asarray(shapely.contains_xy(area, positions[:, 0], positions[:, 1]))


def _nodes(
    region: NodeRegion, positions: NDArray[np.float64], spacing: float, key: str
) -> NDArray[np.int64]:
    dimension = positions.shape[1]
    kind = kind_of(region, REGIONS[dimension], key)
    if region.between is not None and kind != "edge":
        raise InvalidProblem(f"{key}.between: expected with edge, got it with {kind}")
    if region.count != 1 and kind != "point":
        raise InvalidProblem(f"{key}.count: expected with point, got it with {kind}")
    if kind == "nodes":
        assert region.nodes is not None
        bad = [node for node in region.nodes if not 0 <= node < len(positions)]
        if bad or not region.nodes:
            raise InvalidProblem(
                f"{key}.nodes: expected numbers from 0 to {len(positions) - 1}, got "
                f"{bad[0] if bad else 'none'}"
            )
        return np.array(region.nodes, dtype=np.int64)
    if kind == "point":
        return _nearest(region, positions, spacing, key)
    if kind in {"edge", "face"}:
        return _side(region, positions, spacing, key)
    inside = np.flatnonzero(_contains(region, positions, spacing, key))
    if not len(inside) and dimension == 3:
        raise InvalidProblem(
            f"{key}: no node lies in this {kind}; the lattice extends from {_extent(positions)} mm"
        )
    if not len(inside):
        shape = shape_of(region, key).buffer(ROUNDING * spacing)
        gap = shapely.distance(shape, shapely.points(positions))
        near = positions[int(np.argmin(gap))]
        raise InvalidProblem(
            f"{key}: no node lies in this {kind}; the nearest one is at "
            f"[{near[0]:.4g}, {near[1]:.4g}] mm, {gap.min():.3g} mm outside"
        )
    return inside


def _nearest(
    region: NodeRegion, positions: NDArray[np.float64], spacing: float, key: str
) -> NDArray[np.int64]:
    assert region.point is not None
    axes = "xyz"[: positions.shape[1]]
    if len(region.point) != len(axes):
        raise InvalidProblem(f"{key}.point: expected [{', '.join(axes)}], got {list(region.point)}")
    if not 1 <= region.count <= len(positions):
        raise InvalidProblem(
            f"{key}.count: expected 1 to {len(positions)} nodes, got {region.count}"
        )
    gap = np.linalg.norm(positions - np.array(region.point), axis=1)
    order = np.argsort(gap.round(9), kind="stable")
    if gap[order[0]] > SNAP * spacing:
        near = ", ".join(f"{each:.4g}" for each in positions[order[0]])
        raise InvalidProblem(
            f"{key}.point: the node nearest to {list(region.point)} mm is at [{near}] mm, "
            f"{gap[order[0]]:.3g} mm away; expected a point within {SNAP * spacing:.3g} mm of a "
            f"node; the lattice extends from {_extent(positions)} mm"
        )
    return np.sort(order[: region.count])


def _extent(positions: NDArray[np.float64]) -> str:
    """Return from where to where nodes extend."""
    ends = zip("xyz", positions.min(axis=0), positions.max(axis=0), strict=False)
    return " and ".join(f"{axis} = {low:.4g} to {high:.4g}" for axis, low, high in ends)


def _side(
    region: NodeRegion, positions: NDArray[np.float64], spacing: float, key: str
) -> NDArray[np.int64]:
    """Return the nodes on an edge of a domain in the plane, or a face of one in space."""
    side = region.edge or region.face
    assert side is not None
    axis, most = SIDES[positions.shape[1]][side]
    across = positions[:, axis]
    at_low = side in {"left", "front", "bottom"}
    depth = across - across.min() if at_low else across.max() - across
    chosen = depth <= most * spacing
    if region.between is not None:
        low, high = region.between
        along = positions[:, 1 - axis]
        chosen &= (along >= low - ROUNDING * spacing) & (along <= high + ROUNDING * spacing)
        if not chosen.any():
            raise InvalidProblem(
                f"{key}.between: no node of the {side} edge lies between {low:g} and "
                f"{high:g} mm; the edge extends from {along.min():.4g} to {along.max():.4g} mm"
            )
    return np.flatnonzero(chosen)
