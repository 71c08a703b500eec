"""Pairs of struts that cross or are nearer to each other than a width."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.mechanics.kernels._compile import entry, kernel

if TYPE_CHECKING:
    from bellcrank.mechanics.kernels.arrays import Floats, Ints

PARALLEL = 1e-14
"""Squared sine of the angle between segments below which they count as parallel."""
CROSSING = 1e-24
"""Squared distance, as a part of the sum of squared lengths, below which segments cross."""


@kernel
def limited(value: float) -> float:
    """Return a value limited to the range from 0 to 1."""
    return min(1.0, max(0.0, value))


@kernel
def segment_distance(positions: Floats, a: int, b: int, c: int, d: int) -> float:
    """Return the distance of the segments from node a to b and from c to d, 0 where they cross.

    The nearest points are a + s (b - a) and c + t (d - c).
    """
    along = other = cross = from_first = from_second = apart = 0.0
    for axis in range(positions.shape[1]):
        first = positions[b, axis] - positions[a, axis]
        second = positions[d, axis] - positions[c, axis]
        between = positions[a, axis] - positions[c, axis]
        along += first * first
        other += second * second
        cross += first * second
        from_first += first * between
        from_second += second * between
        apart += between * between
    determinant = along * other - cross * cross
    s = 0.0
    if determinant > PARALLEL * along * other:
        s = limited((cross * from_second - from_first * other) / determinant)
    t = limited((cross * s + from_second) / max(other, 1e-300))
    s = limited((cross * t - from_first) / max(along, 1e-300))
    square = 0.0
    for axis in range(positions.shape[1]):
        first = positions[a, axis] + s * (positions[b, axis] - positions[a, axis])
        second = positions[c, axis] + t * (positions[d, axis] - positions[c, axis])
        square += (first - second) ** 2
    return math.sqrt(square) if square > CROSSING * (along + other) else 0.0


@entry
def find_near_pairs(
    positions: Floats, beams: Ints, order: Ints, left: Floats, right: Floats, width: float,
    pairs: Ints, distance: Floats,
) -> int:  # fmt: skip
    """Fill the pairs of struts without a common node that cross or are nearer than a width.

    Parameters
    ----------
    positions : (N, d)
    beams : (n, 2)
    order : (n,)
        The struts in ascending order of `left`.
    left, right : (n, d)
        Lowest and highest coordinates of each strut.
    width
        0 for crossings only.
    pairs, distance : (m, 2) and (m,)
        Filled as far as they suffice.

    Returns
    -------
    int
        Number of pairs, which may exceed m.
    """
    count = 0
    for first in range(len(order)):
        i = order[first]
        for second in range(first + 1, len(order)):
            j = order[second]
            if left[j, 0] > right[i, 0] + width:
                break
            apart = False
            for axis in range(1, positions.shape[1]):
                apart |= left[j, axis] > right[i, axis] + width
                apart |= left[i, axis] > right[j, axis] + width
            a, b, c, d = beams[i, 0], beams[i, 1], beams[j, 0], beams[j, 1]
            if apart or a in (c, d) or b in (c, d):
                continue
            found = segment_distance(positions, a, b, c, d)
            if found < width or found == 0.0:
                if count < len(pairs):
                    pairs[count, 0], pairs[count, 1] = i, j
                    distance[count] = found
                count += 1
    return count
