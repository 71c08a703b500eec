"""Struts that cross or come nearer to each other than a width."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def near_pairs(
    positions: NDArray[np.float64], beams: NDArray[np.int64], width: float
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Find the pairs of struts without a common node that cross or are nearer than a width.

    Parameters
    ----------
    positions : (N, d)
    beams : (n, 2)
    width
        0 for crossings only.

    Returns
    -------
    pairs : (p, 2) int64
        Indices into `beams`.
    distance : (p,)
    """
    from bellcrank.mechanics.kernels.contact import find_near_pairs

    ends = positions[beams]
    left, right = ends.min(axis=1), ends.max(axis=1)
    order = np.argsort(left[:, 0])
    count = len(beams)
    while True:
        pairs, distance = np.empty((count, 2), np.int64), np.empty(count)
        found = find_near_pairs(positions, beams, order, left, right, width, pairs, distance)
        if found <= count:
            return pairs[:found], distance[:found]
        count = found
