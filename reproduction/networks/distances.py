"""How far designs are from all that a network has learnt from.

The distance of two designs is the number of beams that one has and the other has not
(Hamming). Packed into words of 64 beams, that is an exclusive or and a count of bits: a
billion words take a second or two on one core.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

CHUNK = 8192
"""Designs compared at a time: their words stay in the cache."""
WORD = 8
"""Bytes of a word."""


def smallest_distances(
    made: NDArray[np.uint8], known: NDArray[np.uint8]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return, for each design, in how many beams it differs from the nearest known one.

    Parameters
    ----------
    made : (n, bytes) uint8
        Packed masks.
    known : (k, bytes) uint8
        Packed masks over the same beams; at least one.

    Returns
    -------
    distance : (n,) int64
    nearest : (n,) int64
        Index of the first of the known designs that is so near.

    Examples
    --------
    >>> made = np.packbits([[1, 1, 0], [0, 0, 0]], axis=1)
    >>> known = np.packbits([[1, 1, 1], [0, 0, 1], [0, 1, 1]], axis=1)
    >>> distance, nearest = smallest_distances(made, known)
    >>> distance.tolist(), nearest.tolist()
    ([1, 1], [0, 1])
    """
    wanted, there = _words(made), _words(known)
    distance = np.full(len(made), WORD * WORD * len(there), np.int64)
    nearest = np.zeros(len(made), np.int64)
    for first in range(0, there.shape[1], CHUNK):
        part = np.ascontiguousarray(there[:, first : first + CHUNK])
        differs, count = np.empty(part.shape[1], np.uint64), np.empty(part.shape[1], np.uint8)
        total = np.empty(part.shape[1], np.int32)
        for number in range(len(made)):
            total[:] = 0
            for word, row in zip(wanted[:, number], part, strict=True):
                np.bitwise_xor(row, word, out=differs)
                np.bitwise_count(differs, out=count)
                total += count
            place = int(total.argmin())
            if total[place] < distance[number]:
                distance[number], nearest[number] = total[place], first + place
    return distance, nearest


def _words(packed: NDArray[np.uint8]) -> NDArray[np.uint64]:
    """Return (words, n): the bits in words of 64, filled up with zeros."""
    count, width = packed.shape
    padded = np.zeros((count, -(-width // WORD) * WORD), np.uint8)
    padded[:, :width] = packed
    return np.ascontiguousarray(padded.view(np.uint64).T)
