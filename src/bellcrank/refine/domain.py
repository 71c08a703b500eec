"""Distances of struts from the boundary of the domain of a task."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Values = NDArray[np.float64]

TILT = np.array([[1.0, -3.1e-5, -7.3e-5], [3.1e-5, 1.0, -4.7e-5], [7.3e-5, 4.7e-5, 1.0]])
"""A small turn, so that no ray meets an edge of a regular surface."""


def distances_inside(points: Values, boundary: Sequence[Values]) -> tuple[Values, Values]:
    """Return how far points are inside a region, and the derivatives by their coordinates.

    Parameters
    ----------
    points : (n, d)
        Points.
    boundary : sequence of (k, 2) or (k, 3, 3)
        Closed rings around the region; in space triangles of closed surfaces. A point is inside if
        a ray from it crosses them an odd number of times.

    Returns
    -------
    distance : (n,)
        Distance from the boundary, negative outside.
    slopes : (n, d)
        0 for points on the boundary.

    Examples
    --------
    A square with a square hole:

    >>> square = np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]])
    >>> boundary = [square, 0.25 * square + 3.0]
    >>> points = np.array([[1.0, 4.0], [4.0, 3.5], [9.0, 4.0]])
    >>> distance, slopes = distances_inside(points, boundary)
    >>> distance.tolist(), slopes[0].tolist()
    ([1.0, -0.5, -1.0], [1.0, 0.0])
    """
    nearest = _from_surfaces if points.shape[1] == 3 else _from_rings
    across, is_inside = nearest(points, boundary)
    size = np.linalg.norm(across, axis=1)
    sign = np.where(is_inside, 1.0, -1.0)
    unit = np.divide(across, size[:, None], out=np.zeros_like(across), where=size[:, None] > 0.0)
    return sign * size, sign[:, None] * unit


def _from_rings(points: Values, rings: Sequence[Values]) -> tuple[Values, NDArray[np.bool_]]:
    """Return (n, 2) vectors from the nearest points of rings, and (n,) which points are inside."""
    starts = np.concatenate(rings)
    along = np.concatenate([np.roll(ring, -1, axis=0) for ring in rings]) - starts
    apart = points[:, None] - starts
    square = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    share = np.clip((apart * along).sum(axis=2) / square, 0.0, 1.0)
    across = apart - share[..., None] * along
    nearest = (across**2).sum(axis=2).argmin(axis=1)
    # Edges that a ray to the right crosses.
    is_level = (apart[..., 1] >= 0.0) != (apart[..., 1] >= along[:, 1])
    part = np.divide(apart[..., 1], along[:, 1], out=np.zeros_like(share), where=is_level)
    crossed = is_level & (apart[..., 0] < part * along[:, 0])
    return across[np.arange(len(points)), nearest], crossed.sum(axis=1) % 2 == 1


def _from_surfaces(points: Values, surfaces: Sequence[Values]) -> tuple[Values, NDArray[np.bool_]]:
    """Return (n, 3) vectors from the nearest points of surfaces, and (n,) which are inside."""
    from bellcrank.mechanics.kernels.surface import find_nearest

    corners = np.concatenate(surfaces)
    centre = corners.mean(axis=1)
    radius = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    balls = np.column_stack([centre, radius])
    across, inside = np.empty_like(points), np.empty(len(points), dtype=bool)
    find_nearest(points, corners, balls, points @ TILT, corners @ TILT, across, inside)
    return across, inside
