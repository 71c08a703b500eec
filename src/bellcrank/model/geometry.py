"""Geometry of points and segments in the plane."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def distances_to_segments(
    points: NDArray[np.float64], starts: NDArray[np.float64], ends: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (n,) the distances of (n, 2) points from segments, one segment for each point.

    Examples
    --------
    >>> points = np.array([[0.5, 2.0], [4.0, 4.0]])
    >>> distances_to_segments(points, np.zeros((2, 2)), np.array([[1.0, 0.0]] * 2))
    array([2., 5.])
    """
    along, offset = ends - starts, points - starts
    square = np.maximum((along * along).sum(axis=1), 1e-300)
    part = np.clip((offset * along).sum(axis=1) / square, 0.0, 1.0)
    apart = offset - part[:, None] * along
    distance: NDArray[np.float64] = np.hypot(apart[:, 0], apart[:, 1])
    return distance
