"""Beams between two ports that do not lie on one another."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely
from scipy.spatial import Delaunay, cKDTree

from bellcrank.errors import InvalidFile

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

CLEAR = 0.6
"""Of the spacing: how near a new node may come to one that is there."""
LONGEST = 1.6
"""Of the spacing: longer beams than this are not made."""


def bridge(
    positions: NDArray[np.float64],
    beams: NDArray[np.int64],
    ports: Sequence[NDArray[np.int64]],
    spacing: float,
    name: str,
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Fill the convex hull of two ports with beams.

    New nodes stand where the triangular lattice of the first port goes on; beams are those of
    Delaunay's triangulation of them and the nodes of the ports, so that it joins ports of parts
    that are turned or scaled against each other too.

    Parameters
    ----------
    positions : (N, 2) float64
    beams : (M, 2) int64
        What is there.
    ports
        Nodes of the two.
    spacing
        Of the first port's lattice.
    name
        What to call it in an error.

    Returns
    -------
    positions (N + n, 2), beams (m, 2)
        With the new nodes; the new beams only.

    Raises
    ------
    InvalidFile
        If something stands between the ports.
    """
    ends = np.concatenate(ports)
    hull = shapely.MultiPoint(positions[ends]).convex_hull
    inside = shapely.contains_xy(hull, *positions.T)
    inside[ends] = False
    if inside.any():
        x, y = positions[np.flatnonzero(inside)[0]]
        raise InvalidFile(f"{name}: something is in its way at ({x:.4g}, {y:.4g})")
    grid = _grid(hull.bounds, positions[ports[0][0]], spacing)
    grid = grid[shapely.contains_xy(hull, *grid.T)]
    far, _ = cKDTree(positions[ends]).query(grid)
    grid = grid[far > CLEAR * spacing]
    corners = np.concatenate([ends, len(positions) + np.arange(len(grid))])
    everything = np.concatenate([positions, grid])
    triangles = corners[Delaunay(everything[corners]).simplices]
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    made = np.unique(np.sort(sides, axis=1), axis=0)
    length = np.linalg.norm(everything[made[:, 1]] - everything[made[:, 0]], axis=1)
    within = np.isin(made, ports[0]).all(axis=1) | np.isin(made, ports[1]).all(axis=1)
    made = made[(length <= LONGEST * spacing) & ~within]
    there = {tuple(pair) for pair in np.sort(beams, axis=1).tolist()}
    made = np.array([pair for pair in made.tolist() if tuple(pair) not in there]).reshape(-1, 2)
    return everything, made.astype(np.int64)


def _grid(
    bounds: tuple[float, float, float, float], origin: NDArray[np.float64], spacing: float
) -> NDArray[np.float64]:
    """Return the nodes (n, 2) of the triangular lattice through a point, within bounds."""
    height = spacing * np.sqrt(3.0) / 2.0
    low, high = np.array(bounds[:2]) - origin, np.array(bounds[2:]) - origin
    rows = np.arange(np.floor(low[1] / height), np.ceil(high[1] / height) + 1)
    columns = np.arange(np.floor(low[0] / spacing) - 1, np.ceil(high[0] / spacing) + 2)
    row, column = (each.ravel() for each in np.meshgrid(rows, columns, indexing="ij"))
    found: NDArray[np.float64] = origin + np.column_stack(
        [(column + 0.5 * (row % 2)) * spacing, row * height]
    )
    return found
