"""Beams that cross where they should not."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely

if TYPE_CHECKING:
    from numpy.typing import NDArray

SHORTER = 1e-6
"""Of its length, that each beam is shortened by at both ends: beams that meet do not cross."""


def first_crossing(
    positions: NDArray[np.float64], beams: NDArray[np.int64], owner: NDArray[np.int64]
) -> tuple[int, int] | None:
    """Return two beams of different owners that cross; None if no two do.

    Parameters
    ----------
    positions : (N, 2) float64
    beams : (M, 2) int64
    owner : (M,) int64

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> first_crossing(square, np.array([[0, 2], [1, 3]]), np.array([0, 1]))
    (0, 1)
    >>> first_crossing(square, np.array([[0, 2], [2, 3]]), np.array([0, 1])) is None
    True
    """
    start, end = positions[beams[:, 0]], positions[beams[:, 1]]
    inset = SHORTER * (end - start)
    lines = shapely.linestrings(np.stack([start + inset, end - inset], axis=1))
    first, second = shapely.STRtree(lines).query(lines, predicate="intersects")
    bad = np.flatnonzero((first < second) & (owner[first] != owner[second]))
    return (int(first[bad[0]]), int(second[bad[0]])) if len(bad) else None
