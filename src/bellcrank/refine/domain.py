"""Distances of struts from the boundary of the domain of a task."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Values = NDArray[np.float64]


def distances_inside(points: Values, boundary: Sequence[Values]) -> tuple[Values, Values]:
    """Return how far points are inside a region, and the derivatives by their coordinates.

    Parameters
    ----------
    points : (n, 2)
        Points.
    boundary : sequence of (k, 2)
        Closed rings around the region. A point is inside if a ray from it crosses them an odd
        number of times.

    Returns
    -------
    distance : (n,)
        Distance from the nearest ring, negative outside.
    slopes : (n, 2)
        0 for points on a ring.

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
    starts = np.concatenate(boundary)
    along = np.concatenate([np.roll(ring, -1, axis=0) for ring in boundary]) - starts
    apart = points[:, None] - starts
    square = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    share = np.clip((apart * along).sum(axis=2) / square, 0.0, 1.0)
    across = apart - share[..., None] * along
    nearest = (across**2).sum(axis=2).argmin(axis=1)
    across = across[np.arange(len(points)), nearest]
    size = np.linalg.norm(across, axis=1)
    # Edges that a ray to the right crosses.
    is_level = (apart[..., 1] >= 0.0) != (apart[..., 1] >= along[:, 1])
    part = np.divide(apart[..., 1], along[:, 1], out=np.zeros_like(share), where=is_level)
    crossed = is_level & (apart[..., 0] < part * along[:, 0])
    sign = np.where(crossed.sum(axis=1) % 2, 1.0, -1.0)
    unit = np.divide(across, size[:, None], out=np.zeros_like(across), where=size[:, None] > 0.0)
    return sign * size, sign[:, None] * unit
