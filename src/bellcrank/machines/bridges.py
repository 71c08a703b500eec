"""Bridges: beams between two ports that do not lie on one another."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

MIN_DISTANCE = 0.6
"""Smallest distance of a new node from a port node, in lattice spacings."""
MAX_LENGTH = 1.6
"""Length of the longest new beam, in lattice spacings."""
HULL_TOLERANCE = 1e-9
"""Distance from the hull of two ports, relative to its length, within which a beam belongs to
their bridge."""


def bridge(
    positions: NDArray[np.float64],
    beams: NDArray[np.int64],
    ports: Sequence[NDArray[np.int64]],
    spacing: float,
    name: str,
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Fill the convex hull of two ports with beams.

    New nodes continue the triangular lattice of the first port. The beams are the edges of a
    Delaunay triangulation of the new nodes and the port nodes, so that ports of rotated or scaled
    parts can be joined too.

    Parameters
    ----------
    positions : (N, 2) float64
    beams : (M, 2) int64
        Existing nodes and beams.
    ports
        Node numbers of the two ports.
    spacing
        Lattice spacing of the first port.
    name
        Name of the bridge in error messages.

    Returns
    -------
    positions : (N + n, 2)
        All positions, the new ones last.
    beams : (m, 2)
        The new beams only.

    Raises
    ------
    InvalidFile
        If another node lies between the ports.
    """
    import shapely
    from scipy.spatial import Delaunay, cKDTree

    ends = np.concatenate(ports)
    hull = shapely.MultiPoint(positions[ends]).convex_hull
    inside = shapely.contains_xy(hull, *positions.T)
    inside[ends] = False
    if inside.any():
        x, y = positions[np.flatnonzero(inside)[0]]
        raise InvalidFile(f"{name}: the space between the ports is taken at ({x:.4g}, {y:.4g})")
    grid = _triangular_grid(hull.bounds, positions[ports[0][0]], spacing)
    grid = grid[shapely.contains_xy(hull, *grid.T)]
    distance, _ = cKDTree(positions[ends]).query(grid)
    grid = grid[distance > MIN_DISTANCE * spacing]
    corners = np.concatenate([ends, len(positions) + np.arange(len(grid))])
    extended = np.concatenate([positions, grid])
    triangles = corners[Delaunay(extended[corners]).simplices]
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    made = np.unique(np.sort(sides, axis=1), axis=0)
    length = np.linalg.norm(extended[made[:, 1]] - extended[made[:, 0]], axis=1)
    within = np.isin(made, ports[0]).all(axis=1) | np.isin(made, ports[1]).all(axis=1)
    made = made[(length <= MAX_LENGTH * spacing) & ~within]
    existing = {tuple(pair) for pair in np.sort(beams, axis=1).tolist()}
    made = np.array([pair for pair in made.tolist() if tuple(pair) not in existing]).reshape(-1, 2)
    return extended, made.astype(np.int64)


def between_ports(
    positions: NDArray[np.float64],
    beams: NDArray[np.int64],
    ports: Sequence[NDArray[np.int64]],
) -> NDArray[np.bool_]:
    """(m,) whether the middle of each beam lies in the convex hull of two ports."""
    import shapely

    hull = shapely.MultiPoint(positions[np.concatenate(ports)]).convex_hull
    middle = shapely.points(positions[beams].mean(axis=1))
    near: NDArray[np.bool_] = shapely.distance(middle, hull) < HULL_TOLERANCE * max(
        hull.length, 1.0
    )
    return near


def _triangular_grid(
    bounds: tuple[float, float, float, float], origin: NDArray[np.float64], spacing: float
) -> NDArray[np.float64]:
    """Return the nodes (n, 2) of the triangular lattice through a point, within bounds."""
    height = spacing * np.sqrt(3.0) / 2.0
    low, high = np.array(bounds[:2]) - origin, np.array(bounds[2:]) - origin
    rows = np.arange(np.floor(low[1] / height), np.ceil(high[1] / height) + 1)
    columns = np.arange(np.floor(low[0] / spacing) - 1, np.ceil(high[0] / spacing) + 2)
    row, column = (each.ravel() for each in np.meshgrid(rows, columns, indexing="ij"))
    grid: NDArray[np.float64] = origin + np.column_stack(
        [(column + 0.5 * (row % 2)) * spacing, row * height]
    )
    return grid
