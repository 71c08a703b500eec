"""Blocks of the inverse stiffness, each from the factor alone.

With K = L L', block (i, j) of the inverse is H_i' H_j, where H_i are the columns of L^-1 that
belong to node i. They vanish except at the node and its ancestors in the elimination tree (Liu,
SIAM J. Matrix Anal. Appl. 11, 134, 1990), so that only the ancestors of both nodes contribute. On
triangular lattices of n nodes these are at most about 1.9 n^0.71 (`bellcrank.mechanics.memory`), so
that the memory grows no faster than n^1.71; a dense inverse needs n^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bellcrank.mechanics.kernels._compile import entry, kernel
from bellcrank.mechanics.kernels.bundle import Bundle

if TYPE_CHECKING:
    from bellcrank.mechanics.kernels.arrays import Bytes, Floats, Ints, Scratch, Structure


@dataclass(frozen=True, eq=False)
class Inverse(Bundle):
    """Parts of the inverse stiffness that have been computed. n blocks, a tree of height h."""

    parent: Ints
    """(n,) parent of each block in the elimination tree, -1 for a root."""
    level: Ints
    """(n,) number of its ancestors."""
    columns: Floats
    """(n, h, 4) columns of L^-1: the blocks at the ancestors of a node, by level."""
    columns_are_known: Bytes
    """(n,)"""
    work: Floats
    """(n, 4) memory, zero between two calls."""
    near_start: Ints
    """(n + 1,) index in `near` at which the blocks near each block begin."""
    near: Ints
    """(k,) blocks at most three beams away, with no smaller number."""
    near_block: Floats
    """(k, 4) blocks of the inverse, rows by columns, the row being the smaller number."""
    near_is_known: Bytes
    """(k,)"""


@kernel
def reset(structure: Structure, inverse: Inverse) -> None:
    """Find the elimination tree of a new factor, and mark all parts of the inverse as unknown."""
    start = structure.column_start
    for column in range(len(inverse.parent) - 1, -1, -1):
        inverse.columns_are_known[column] = 0
        if start[column] < start[column + 1]:
            parent = structure.row[start[column]]
            inverse.parent[column] = parent
            inverse.level[column] = inverse.level[parent] + 1
        else:
            inverse.parent[column] = -1
            inverse.level[column] = 0
    for pair in range(len(inverse.near_is_known)):
        inverse.near_is_known[pair] = 0


@kernel
def find_columns(structure: Structure, scratch: Scratch, inverse: Inverse, node: int) -> None:
    """Compute the columns of L^-1 that belong to a node."""
    x, row = inverse.work, structure.row
    factor, diagonal = scratch.factor, scratch.factor_diagonal
    x[node, 0] = x[node, 3] = 1.0
    column = node
    while column >= 0:
        first, corner, second = diagonal[column, 0], diagonal[column, 1], diagonal[column, 3]
        a, b = x[column, 0] * first, x[column, 1] * first
        c = (x[column, 2] - corner * a) * second
        d = (x[column, 3] - corner * b) * second
        level = inverse.level[column]
        inverse.columns[node, level, 0], inverse.columns[node, level, 1] = a, b
        inverse.columns[node, level, 2], inverse.columns[node, level, 3] = c, d
        for k in range(4):
            x[column, k] = 0.0
        for t in range(structure.column_start[column], structure.column_start[column + 1]):
            i = row[t]
            f0, f1, f2, f3 = factor[t, 0], factor[t, 1], factor[t, 2], factor[t, 3]
            x[i, 0] -= f0 * a + f1 * c
            x[i, 1] -= f0 * b + f1 * d
            x[i, 2] -= f2 * a + f3 * c
            x[i, 3] -= f2 * b + f3 * d
        column = inverse.parent[column]
    inverse.columns_are_known[node] = 1


@kernel
def find_block(
    structure: Structure, scratch: Scratch, inverse: Inverse, row: int, column: int, out: Floats
) -> None:
    """Compute a block of the inverse."""
    if not inverse.columns_are_known[row]:
        find_columns(structure, scratch, inverse, row)
    if not inverse.columns_are_known[column]:
        find_columns(structure, scratch, inverse, column)
    # A parent has a larger number than its children.
    first, second = row, column
    while first != second and first >= 0 and second >= 0:
        if first < second:
            first = inverse.parent[first]
        else:
            second = inverse.parent[second]
    shared = inverse.level[first] + 1 if first == second else 0
    left, right = inverse.columns[row], inverse.columns[column]
    a = b = c = d = 0.0
    for k in range(shared):
        a += left[k, 0] * right[k, 0] + left[k, 2] * right[k, 2]
        b += left[k, 0] * right[k, 1] + left[k, 2] * right[k, 3]
        c += left[k, 1] * right[k, 0] + left[k, 3] * right[k, 2]
        d += left[k, 1] * right[k, 1] + left[k, 3] * right[k, 3]
    out[0], out[1], out[2], out[3] = a, b, c, d


@kernel
def near_index(
    structure: Structure, scratch: Scratch, inverse: Inverse, first: int, second: int
) -> int:
    """Return the index in `near` of two near blocks, of which `first` is no larger; compute it."""
    index = inverse.near_start[first]
    while inverse.near[index] != second:
        index += 1
    if not inverse.near_is_known[index]:
        find_block(structure, scratch, inverse, first, second, inverse.near_block[index])
        inverse.near_is_known[index] = 1
    return index


@entry
def find_blocks(
    structure: Structure,
    scratch: Scratch,
    inverse: Inverse,
    rows: Ints,
    columns: Ints,
    out: Floats,
) -> None:
    """Fill `out` (k, 4) with the blocks of the inverse at `rows` and `columns` (k,)."""
    for index in range(len(rows)):
        find_block(structure, scratch, inverse, rows[index], columns[index], out[index])
