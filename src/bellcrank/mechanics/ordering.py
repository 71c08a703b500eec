"""Elimination order of the free nodes, and the size of their factor."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.sparse import csc_matrix

    from bellcrank.mechanics.kernels.arrays import Ints

STORED = 32
"""Number of lattices whose order and size are stored."""


def one_beam_apart(beams: Ints, count: int) -> csc_matrix:
    """Return the (N, N) matrix with ones on the diagonal and where a beam joins two nodes."""
    from scipy.sparse import csc_matrix

    nodes = np.arange(count)
    rows = np.concatenate([nodes, beams[:, 0], beams[:, 1]])
    columns = np.concatenate([nodes, beams[:, 1], beams[:, 0]])
    return csc_matrix((np.ones(len(rows)), (rows, columns)), shape=(count, count))


def coupled_nodes(beams: Ints, held: NDArray[np.bool_], *, springs: bool = True) -> csc_matrix:
    """Return the pattern of the nodes that share a beam or an angular spring in some design.

    Removing beams makes more distant beams neighbours around a node. With angular springs, all
    nodes that have a beam to the same node are therefore taken as coupled.

    Parameters
    ----------
    beams : (M, 2) int64
    held : (N,) bool
        Nodes that are not unknowns; they are left out.
    springs
        Whether there are angular springs.

    Returns
    -------
    (n, n) sparse matrix of ones
        Over the n free nodes.
    """
    from scipy.sparse import csc_matrix

    free = np.flatnonzero(~held)
    around = one_beam_apart(beams, len(held))[:, free]
    pattern = csc_matrix(around.T @ around if springs else around[free])
    pattern.sum_duplicates()
    pattern.sort_indices()
    pattern.data[:] = 1.0
    return pattern


def elimination_order(beams: Ints, held: NDArray[np.bool_], *, springs: bool = True) -> Ints:
    """Order the free nodes so that their factor stays sparse (multiple minimum degree).

    The order is computed once for each problem, on the pattern that covers all designs. With
    the order of the full lattice alone, the factors of designs with few beams, which couple
    nodes across the gaps, would be ten times larger at a thousand beams.

    Parameters
    ----------
    beams : (M, 2) int64
    held : (N,) bool
        Nodes that are not unknowns.
    springs
        Whether there are angular springs.

    Returns
    -------
    (N,) int64
        Elimination index of each free node, -1 for held nodes.
    """
    return _elimination_order(*_bytes_of(beams, held), springs=springs).copy()


def _bytes_of(beams: Ints, of_nodes: NDArray[Any]) -> tuple[bytes, bytes, str]:
    """Return arrays as bytes, by which results are stored: geometries of one design share them."""
    beams = np.ascontiguousarray(beams, dtype=np.int64)
    return beams.tobytes(), of_nodes.tobytes(), of_nodes.dtype.str


@lru_cache(maxsize=STORED)
def _elimination_order(of_beams: bytes, of_held: bytes, kind: str, *, springs: bool) -> Ints:
    """Compute the order of the free nodes."""
    from scipy.sparse import csc_matrix, identity
    from scipy.sparse.linalg import splu

    beams = np.frombuffer(of_beams, dtype=np.int64).reshape(-1, 2)
    held = np.frombuffer(of_held, dtype=kind)
    block = np.full(len(held), -1)
    pattern = coupled_nodes(beams, held, springs=springs)
    count = pattern.shape[0]
    if count:
        # A dominant diagonal keeps the pivots on the diagonal.
        matrix = csc_matrix(pattern + count * identity(count, format="csc"))
        factor = splu(
            matrix,
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        block[~held] = factor.perm_c
    return block


class FactorSize(NamedTuple):
    """Upper bounds on the factor of any design."""

    entries: int
    """Blocks below the diagonal."""
    height: int
    """Blocks on the longest path of the elimination tree."""


def factor_size(beams: Ints, block: Ints, *, springs: bool = True) -> FactorSize:
    """Return upper bounds on the size of the factor of any design.

    For each row of the factor, the nonzero entries are the columns on the paths from the entries
    of the pattern to the row in the elimination tree (Liu, SIAM J. Matrix Anal. Appl. 11, 134,
    1990). The ancestors of a node in the tree of a design are ancestors in this tree, too.

    Parameters
    ----------
    beams : (M, 2) int64
    block : (N,) int64
        Elimination index of each node, -1 for held nodes.
    springs
        Whether there are angular springs.
    """
    return _factor_size(*_bytes_of(beams, block), springs=springs)


@lru_cache(maxsize=STORED)
def _factor_size(of_beams: bytes, of_block: bytes, kind: str, *, springs: bool) -> FactorSize:
    """Compute the size of the factor."""
    beams = np.frombuffer(of_beams, dtype=np.int64).reshape(-1, 2)
    block = np.frombuffer(of_block, dtype=kind)
    pattern = coupled_nodes(beams, block < 0, springs=springs)
    order = block[block >= 0]
    node_at = np.argsort(order)
    starts, entries = pattern.indptr.tolist(), order[pattern.indices].tolist()
    parent = [-1] * len(node_at)
    visited = [-1] * len(node_at)
    total = 0
    for row, index in enumerate(node_at.tolist()):
        visited[row] = row
        for entry in entries[starts[index] : starts[index + 1]]:
            column = entry
            while column < row and visited[column] != row:
                if parent[column] < 0:
                    parent[column] = row
                visited[column] = row
                column = parent[column]
                total += 1
    height = [0] * (len(parent) + 1)  # the last one is above the roots, whose parent is -1
    for column in range(len(parent) - 1, -1, -1):
        height[column] = height[parent[column]] + 1
    return FactorSize(total, max(height))


def near_blocks(beams: Ints, block: Ints) -> tuple[Ints, Ints]:
    """List the free nodes at most three beams away from each free node.

    Parameters
    ----------
    beams : (M, 2) int64
    block : (N,) int64
        Elimination index of each node, -1 for held nodes.

    Returns
    -------
    start : (n + 1,) int64
    near : (k,) int64
        The blocks near block i with no smaller number are ``near[start[i]:start[i + 1]]``.

    Examples
    --------
    >>> near_blocks(np.array([[0, 1], [1, 2]]), np.array([1, -1, 0]))
    (array([0, 2, 3]), array([0, 1, 1]))
    """
    from scipy.sparse import csr_matrix, triu

    free = np.flatnonzero(block >= 0)
    free = free[np.argsort(block[free])]
    one_beam = one_beam_apart(beams, len(block))
    found = csr_matrix(triu(one_beam[free] @ one_beam @ one_beam[:, free]))
    found.sort_indices()
    return found.indptr.astype(np.int64), found.indices.astype(np.int64)
