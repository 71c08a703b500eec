"""Distances of struts from the boundary of the domain of a task."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bellcrank.task.surfaces import Surface

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Values = NDArray[np.float64]

FACES = 3
"""Largest number of faces that bound a point."""


class Distances(NamedTuple):
    """Distances of points from faces of a boundary, the nearest face of each point first."""

    point: NDArray[np.int64]
    """(m,) numbers of the points, ascending."""
    face: NDArray[np.int64]
    """(m,) numbers of the faces."""
    value: Values
    """(m,) negative outside."""
    slopes: Values
    """(m, d) derivatives by the coordinates of the points; 0 for points on the boundary."""


def distances_inside(points: Values, boundary: Sequence[Values], reach: float) -> Distances:
    """Return how far points are inside a region.

    In a corner several faces bound a point: the smallest of their distances has a kink there, each
    of them has none.

    Parameters
    ----------
    points : (n, d)
        Points.
    boundary : sequence of (k, 2) or (k, 3, 3)
        Closed rings around the region, with edges as faces; in space triangles of closed surfaces.
        A point is inside if a ray from it crosses them an odd number of times.
    reach
        Distance up to which other faces than the nearest one count, those on which a perpendicular
        from the point ends. There are at most three faces of a point, and one of a point outside.

    Examples
    --------
    A square with a square hole:

    >>> square = np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]])
    >>> boundary = [square, 0.25 * square + 3.0]
    >>> points = np.array([[1.0, 1.0], [4.0, 3.5], [9.0, 4.0]])
    >>> found = distances_inside(points, boundary, 2.0)
    >>> found.point.tolist(), found.value.tolist()
    ([0, 0, 1, 2], [1.0, 1.0, -0.5, -1.0])
    """
    nearest = _from_surfaces if points.shape[1] == 3 else _from_rings
    across, face, is_inside = nearest(points, boundary, reach)
    face[~is_inside, 1:] = -1
    point, column = np.nonzero(face >= 0)
    across = across[point, column]
    size = np.linalg.norm(across, axis=1)
    sign = np.where(is_inside[point], 1.0, -1.0)
    unit = np.divide(across, size[:, None], out=np.zeros_like(across), where=size[:, None] > 0.0)
    return Distances(point, face[point, column], sign * size, sign[:, None] * unit)


def _from_rings(
    points: Values, boundary: Sequence[Values], reach: float
) -> tuple[Values, NDArray[np.int64], NDArray[np.bool_]]:
    """Return vectors (n, m, 2) from edges of rings, their numbers, and which points are inside."""
    starts = np.concatenate(boundary)
    along = np.concatenate([np.roll(ring, -1, axis=0) for ring in boundary]) - starts
    apart = points[:, None] - starts
    square = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    share = (apart * along).sum(axis=2) / square
    across = apart - np.clip(share, 0.0, 1.0)[..., None] * along
    size = np.linalg.norm(across, axis=2)
    counts = (share > 0.0) & (share < 1.0) & (size < reach)
    counts[np.arange(len(points)), size.argmin(axis=1)] = True
    face = np.where(counts, size, np.inf).argsort(axis=1, kind="stable")[:, :FACES]
    every = np.arange(len(points))[:, None]
    across, face = across[every, face], np.where(counts[every, face], face, -1)
    # Edges that a ray to the right crosses.
    is_level = (apart[..., 1] >= 0.0) != (apart[..., 1] >= along[:, 1])
    part = np.divide(apart[..., 1], along[:, 1], out=np.zeros_like(share), where=is_level)
    crossed = is_level & (apart[..., 0] < part * along[:, 0])
    return across, face, crossed.sum(axis=1) % 2 == 1


def _from_surfaces(
    points: Values, surfaces: Sequence[Values], reach: float
) -> tuple[Values, NDArray[np.int64], NDArray[np.bool_]]:
    """Return vectors (n, m, 3) from triangles, their numbers, and which points are inside."""
    from bellcrank.mechanics.kernels.surface import find_nearest

    corners = np.concatenate(surfaces)
    centre = corners.mean(axis=1)
    radius = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    balls = np.column_stack([centre, radius])
    count = len(points)
    across, distance = np.zeros((count, FACES, 3)), np.empty((count, FACES))
    face = np.empty((count, FACES), dtype=np.int64)
    find_nearest(points, corners, balls, reach, across, distance, face)
    return across, face, Surface(corners).contains(points)
