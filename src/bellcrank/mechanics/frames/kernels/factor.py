"""Sparse Cholesky factorisation in square blocks, one for each node.

The pattern changes with every flip of a beam. The rows of a column are kept as bits, so that the
symbolic factorisation adds the bits of a column to those of its parent in the elimination tree.
The numeric factorisation is left-looking: a column gathers the contributions of earlier columns in
a dense column. It fails where the stiffness is not positive definite.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics.kernels._compile import kernel
from bellcrank.mechanics.kernels.bits import popcount, trailing_zeros

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics.kernels.arrays import Floats, Ints

    Bits = NDArray[np.uint64]

ONE = np.uint64(1)
SMALLEST_PIVOT = 1e-13
"""Pivot, relative to the diagonal, below which a stiffness counts as singular."""


@kernel
def couple(bits: Bits, first: int, second: int) -> None:
    """Mark two different blocks as coupled."""
    low, high = min(first, second), max(first, second)
    bits[low, high >> 6] |= ONE << np.uint64(high & 63)


@kernel
def fill_in(bits: Bits, start: Ints, word_start: Ints, row: Ints) -> int:
    """Symbolic factorisation: complete the bits, list the rows; return their number."""
    columns, width = bits.shape
    count = 0
    for column in range(columns):
        start[column] = count
        parent = -1
        for word in range(column >> 6, width):
            rest = bits[column, word]
            word_start[column, word] = count
            while rest:
                found = (word << 6) + trailing_zeros(rest)
                rest &= rest - ONE
                if parent < 0:
                    parent = found
                row[count] = found
                count += 1
        if parent >= 0:
            for word in range(parent >> 6, width):
                bits[parent, word] |= bits[column, word]
            bits[parent, parent >> 6] &= ~(ONE << np.uint64(parent & 63))
    start[columns] = count
    return count


@kernel
def entry_of(bits: Bits, word_start: Ints, first: int, second: int) -> int:
    """Return the entry of the block of two coupled nodes."""
    low, high = min(first, second), max(first, second)
    below = bits[low, high >> 6] & ((ONE << np.uint64(high & 63)) - ONE)
    return word_start[low, high >> 6] + popcount(below)


@kernel
def factorise(  # noqa: C901, PLR0912 - one flat loop nest, which is unrolled
    unit: tuple[float, ...],
    start: Ints,
    row: Ints,
    diagonal: Floats,
    entries: Floats,
    column: Floats,
    link: Ints,
) -> bool:
    """Factorise in place; False if the matrix is not positive definite.

    Parameters
    ----------
    unit
        Tuple as long as a block: its length is known when the function is compiled, so that loops
        over blocks are unrolled, which makes them six times as fast.
    start, row
        Pattern of the factor, from `fill_in`.
    diagonal
        (n, b, b) blocks; becomes the lower factor with inverse pivots.
    entries
        (k, b, b) blocks below the diagonal, rows by columns; become those of the factor.
    column
        (n, b, b) memory.
    link
        (n, 3) memory.
    """
    count = diagonal.shape[0]
    size = len(unit)
    for j in range(count):
        link[j, 0] = -1
    for j in range(count):
        first, last = start[j], start[j + 1]
        for t in range(first, last):
            i = row[t]
            for a in range(size):
                for b in range(size):
                    column[i, a, b] = entries[t, a, b]
        own = diagonal[j]
        earlier = link[j, 0]
        while earlier >= 0:
            following, entry = link[earlier, 1], link[earlier, 2]
            end = start[earlier + 1]
            left = entries[entry]
            for a in range(size):
                for b in range(a + 1):
                    total = 0.0
                    for c in range(size):
                        total += left[a, c] * left[b, c]
                    own[a, b] -= total
            for t in range(entry + 1, end):
                target = column[row[t]]
                for a in range(size):
                    for b in range(size):
                        total = 0.0
                        for c in range(size):
                            total += entries[t, a, c] * left[b, c]
                        target[a, b] -= total
            if entry + 1 < end:
                i = row[entry + 1]
                link[earlier, 2] = entry + 1
                link[earlier, 1] = link[i, 0]
                link[i, 0] = earlier
            earlier = following
        for a in range(size):
            for b in range(a):
                total = own[a, b]
                for c in range(b):
                    total -= own[a, c] * own[b, c]
                own[a, b] = total * own[b, b]
            pivot = own[a, a]
            smallest = SMALLEST_PIVOT * abs(pivot)
            for c in range(a):
                pivot -= own[a, c] * own[a, c]
            if not pivot > smallest:
                return False
            own[a, a] = 1.0 / math.sqrt(pivot)
        for t in range(first, last):
            source = column[row[t]]
            for a in range(size):
                for b in range(size):
                    total = source[a, b]
                    for c in range(b):
                        total -= entries[t, a, c] * own[b, c]
                    entries[t, a, b] = total * own[b, b]
        if first < last:
            i = row[first]
            link[j, 2] = first
            link[j, 1] = link[i, 0]
            link[i, 0] = j
    return True


@kernel
def solve(  # noqa: C901 - as above
    unit: tuple[float, ...], start: Ints, row: Ints, diagonal: Floats, entries: Floats, x: Floats
) -> None:
    """Replace the right-hand side (n, b) by the solution."""
    count = diagonal.shape[0]
    size = len(unit)
    for j in range(count):
        own = diagonal[j]
        for a in range(size):
            total = x[j, a]
            for c in range(a):
                total -= own[a, c] * x[j, c]
            x[j, a] = total * own[a, a]
        for t in range(start[j], start[j + 1]):
            i = row[t]
            for a in range(size):
                for c in range(size):
                    x[i, a] -= entries[t, a, c] * x[j, c]
    for j in range(count - 1, -1, -1):
        own = diagonal[j]
        for t in range(start[j], start[j + 1]):
            i = row[t]
            for a in range(size):
                for c in range(size):
                    x[j, c] -= entries[t, a, c] * x[i, a]
        for a in range(size - 1, -1, -1):
            total = x[j, a]
            for c in range(a + 1, size):
                total -= own[c, a] * x[j, c]
            x[j, a] = total * own[a, a]
