"""In which order the free nodes are eliminated, and how much room their factor can take."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix
from scipy.sparse.linalg import splu

if TYPE_CHECKING:
    from bellcrank.mechanics.kernels.arrays import Bytes, Ints, System


def _coupled_nodes(beams: Ints, start: Ints, ring: Ints, block: Ints) -> csc_matrix:
    """Pattern of which free nodes can share a beam or an angular spring in some design.

    Removing beams makes farther beams neighbours around a node, so all nodes around a
    node are taken as coupled.
    """
    pairs: set[tuple[int, int]] = set()
    for node in range(len(start) - 1):
        around = ring[start[node] : start[node + 1]]
        members = [node, *(beams[around].sum(axis=1) - node).tolist()]
        pairs.update((a, b) for a in members for b in members)
    ends = block[np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2)]
    ends = ends[(ends >= 0).all(axis=1)]
    count = int(block.max(initial=-1)) + 1
    entries = (np.ones(len(ends)), (ends[:, 0], ends[:, 1]))
    return csc_matrix(coo_matrix(entries, shape=(count, count)))


def elimination_order(beams: Ints, ring_start: Ints, ring_beam: Ints, held: Bytes) -> Ints:
    """Order the free nodes so that their factor stays sparse (multiple minimum degree).

    The order is found once for each problem, on the pattern that covers all designs.
    Ordering for the full lattice alone would let the factors of late designs, which
    couple nodes across the gaps, grow tenfold at a thousand beams.

    Parameters
    ----------
    held : (N,) bool
        Nodes that are no unknowns.

    Returns
    -------
    (N,) int64
        Elimination index of each free node, -1 for held ones.
    """
    free = np.flatnonzero(~held)
    block = np.full(len(held), -1)
    block[free] = np.arange(len(free))
    if len(free):
        pattern = _coupled_nodes(beams, ring_start, ring_beam, block)
        factor = splu(
            pattern + len(free) * csc_matrix(np.eye(len(free))),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        block[free] = factor.perm_c
    return block


def factor_capacity(system: System) -> int:
    """Upper bound on the blocks below the diagonal of the factor of any design."""
    pattern = _coupled_nodes(system.beams, system.ring_start, system.ring_beam, system.block)
    below = [set(column[column > k].tolist()) for k, column in enumerate(_columns(pattern))]
    total = 0
    for column in range(len(below)):
        rows = below[column]
        total += len(rows)
        if rows:
            parent = min(rows)
            below[parent] |= rows - {parent}
    return total


def _columns(pattern: csc_matrix) -> list[Ints]:
    return np.split(pattern.indices.astype(np.int64), pattern.indptr[1:-1])
