"""Geometry of points and segments in the plane and in space."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def distances_to_segments(
    points: NDArray[np.float64], starts: NDArray[np.float64], ends: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (n,) the distances of (n, d) points from segments, one segment for each point.

    Examples
    --------
    >>> points = np.array([[0.5, 2.0], [4.0, 4.0]])
    >>> distances_to_segments(points, np.zeros((2, 2)), np.array([[1.0, 0.0]] * 2))
    array([2., 5.])
    """
    along, offset = ends - starts, points - starts
    square = np.maximum((along * along).sum(axis=1), 1e-300)
    part = np.clip((offset * along).sum(axis=1) / square, 0.0, 1.0)
    distance: NDArray[np.float64] = np.linalg.norm(offset - part[:, None] * along, axis=1)
    return distance


def inner_distances(
    first: NDArray[np.float64], second: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the distances of segments whose nearest points are both between their ends.

    Parameters
    ----------
    first, second : (n, 2, d)
        End points of the segments.

    Returns
    -------
    distance : (n,)
        Infinite if one of the nearest points is an end. In the plane only segments that cross
        have a finite distance, which is 0.
    fraction : (n,)
        Place of the nearest point on the first segment, from 0 to 1.

    Examples
    --------
    >>> bar = np.array([[[0.0, 0.0, 0.0], [4.0, 0.0, 0.0]]])
    >>> across = np.array([[[1.0, -2.0, 3.0], [1.0, 2.0, 3.0]]])
    >>> inner_distances(bar, across)
    (array([3.]), array([0.25]))
    """
    start, along, other = first[:, 0], first[:, 1] - first[:, 0], second[:, 1] - second[:, 0]
    apart = second[:, 0] - start
    aa, ab, bb = (along * along).sum(1), (along * other).sum(1), (other * other).sum(1)
    ac, bc = (along * apart).sum(1), (other * apart).sum(1)
    determinant = aa * bb - ab * ab
    parallel = determinant <= 1e-14 * aa * bb
    scale = 1.0 / np.where(parallel, 1.0, determinant)
    one, two = scale * (bb * ac - ab * bc), scale * (ab * ac - aa * bc)
    inside = ~parallel & (one > 0.0) & (one < 1.0) & (two > 0.0) & (two < 1.0)
    between = np.linalg.norm(one[:, None] * along - apart - two[:, None] * other, axis=1)
    between[between < 1e-12 * np.sqrt(aa + bb)] = 0.0
    return np.where(inside, between, np.inf), np.clip(one, 0.0, 1.0)
