"""Sparse Cholesky factorisation in 2 x 2 blocks, for a pattern that changes with every flip.

Left-looking: each column gathers the contributions of earlier columns in a dense column that
stays in the first-level cache. A lattice without half of its beams is nearly a tree, for which a
sparse factorisation is faster than a banded or dense one: the full crane needs 25 thousand
multiplications, a band 320 thousand. The factorisation fails where the stiffness is not positive
definite; unstable equilibria are recognised by that.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.mechanics.kernels._compile import kernel

if TYPE_CHECKING:
    from bellcrank.mechanics.kernels.arrays import Scratch, Structure

SMALLEST_PIVOT = 1e-13
"""Pivot, relative to the diagonal, below which a stiffness counts as singular."""


@kernel
def gather_column(structure: Structure, column: int, scratch: Scratch) -> None:
    """Subtract the contributions of earlier columns of the factor from the dense column."""
    w, link, row, factor = scratch.column, scratch.link, structure.row, scratch.factor
    earlier = link[column, 0]
    w00, w10, w11 = w[column, 0], w[column, 1], w[column, 3]
    while earlier >= 0:
        following = link[earlier, 1]
        entry = link[earlier, 2]
        last = structure.column_start[earlier + 1]
        a, b, c, d = factor[entry, 0], factor[entry, 1], factor[entry, 2], factor[entry, 3]
        w00 -= a * a + b * b
        w10 -= c * a + d * b
        w11 -= c * c + d * d
        for t in range(entry + 1, last):
            i = row[t]
            w[i, 0] -= factor[t, 0] * a + factor[t, 1] * b
            w[i, 1] -= factor[t, 0] * c + factor[t, 1] * d
            w[i, 2] -= factor[t, 2] * a + factor[t, 3] * b
            w[i, 3] -= factor[t, 2] * c + factor[t, 3] * d
        if entry + 1 < last:
            target = row[entry + 1]
            link[earlier, 2] = entry + 1
            link[earlier, 1] = link[target, 0]
            link[target, 0] = earlier
        earlier = following
    w[column, 0], w[column, 1], w[column, 3] = w00, w10, w11


@kernel
def factorise(structure: Structure, scratch: Scratch) -> bool:
    """Factorise the assembled stiffness; False if it is not positive definite."""
    w, link, row = scratch.column, scratch.link, structure.row
    diagonal, off_diagonal = scratch.diagonal, scratch.off_diagonal
    factor, factor_diagonal = scratch.factor, scratch.factor_diagonal
    columns = len(diagonal)
    for column in range(columns):
        link[column, 0] = -1
    for column in range(columns):
        first, last = structure.column_start[column], structure.column_start[column + 1]
        w[column, 0], w[column, 1] = diagonal[column, 0], diagonal[column, 1]
        w[column, 3] = diagonal[column, 3]
        for t in range(first, last):
            i = row[t]
            for c in range(4):
                w[i, c] = off_diagonal[t, c]
        gather_column(structure, column, scratch)
        if not w[column, 0] > SMALLEST_PIVOT * diagonal[column, 0]:
            return False
        inverse0 = 1.0 / math.sqrt(w[column, 0])
        l10 = w[column, 1] * inverse0
        pivot = w[column, 3] - l10 * l10
        if not pivot > SMALLEST_PIVOT * diagonal[column, 3]:
            return False
        inverse1 = 1.0 / math.sqrt(pivot)
        factor_diagonal[column, 0] = inverse0
        factor_diagonal[column, 1] = l10
        factor_diagonal[column, 3] = inverse1
        for t in range(first, last):
            i = row[t]
            a = w[i, 0] * inverse0
            c = w[i, 2] * inverse0
            factor[t, 0] = a
            factor[t, 1] = (w[i, 1] - a * l10) * inverse1
            factor[t, 2] = c
            factor[t, 3] = (w[i, 3] - c * l10) * inverse1
        if first < last:
            target = row[first]
            link[column, 2] = first
            link[column, 1] = link[target, 0]
            link[target, 0] = column
    return True


@kernel
def solve(structure: Structure, scratch: Scratch) -> None:
    """Replace the right-hand side in `scratch.step` by the solution."""
    x, row = scratch.step, structure.row
    factor, diagonal = scratch.factor, scratch.factor_diagonal
    columns = len(diagonal)
    for column in range(columns):
        a = x[column, 0] * diagonal[column, 0]
        b = (x[column, 1] - diagonal[column, 1] * a) * diagonal[column, 3]
        x[column, 0], x[column, 1] = a, b
        for t in range(structure.column_start[column], structure.column_start[column + 1]):
            i = row[t]
            x[i, 0] -= factor[t, 0] * a + factor[t, 1] * b
            x[i, 1] -= factor[t, 2] * a + factor[t, 3] * b
    for column in range(columns - 1, -1, -1):
        a, b = x[column, 0], x[column, 1]
        for t in range(structure.column_start[column], structure.column_start[column + 1]):
            i = row[t]
            a -= factor[t, 0] * x[i, 0] + factor[t, 2] * x[i, 1]
            b -= factor[t, 1] * x[i, 0] + factor[t, 3] * x[i, 1]
        b *= diagonal[column, 3]
        x[column, 1] = b
        x[column, 0] = (a - diagonal[column, 1] * b) * diagonal[column, 0]
