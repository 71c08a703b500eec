"""In which order the free nodes are eliminated, and how much room their factor can take."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix
from scipy.sparse.linalg import splu

from bellcrank.mechanics.kernels.arrays import Bytes, Ints, System


def _coupled_nodes(
    beams: Ints, start: Ints, ring: Ints, local: Ints, *, neighbours_only: bool
) -> csc_matrix:
    """Pattern of which free nodes share an angular spring, in any design or in the full one."""
    pairs: set[tuple[int, int]] = set()
    for node in range(len(start) - 1):
        around = ring[start[node] : start[node + 1]]
        far = beams[around].sum(axis=1) - node
        pairs.update((node, int(end)) for end in far)
        for shift in range(1, 2 if neighbours_only else len(far)):
            pairs.update(zip(far.tolist(), np.roll(far, shift).tolist(), strict=True))
    ends = local[np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2)]
    ends = ends[(ends >= 0).all(axis=1)]
    count = int(local.max(initial=-1)) + 1
    rows = np.concatenate([ends[:, 0], ends[:, 1], np.arange(count)])
    columns = np.concatenate([ends[:, 1], ends[:, 0], np.arange(count)])
    return csc_matrix(coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(count, count)))


def elimination_order(beams: Ints, ring_start: Ints, ring_beam: Ints, fully_held: Bytes) -> Ints:
    """Number the free nodes so that their factor stays sparse (multiple minimum degree).

    The order is found once, on the full lattice, and serves all designs: a design's
    graph is close to a part of it.

    Returns
    -------
    (N,) int64
        Elimination index of each free node, -1 for held ones.
    """
    free = np.flatnonzero(~fully_held)
    local = np.full(len(fully_held), -1)
    local[free] = np.arange(len(free))
    if len(free) == 0:
        return local
    pattern = _coupled_nodes(beams, ring_start, ring_beam, local, neighbours_only=True)
    pattern.data[:] = 1.0
    dominant = pattern + len(free) * csc_matrix(np.eye(len(free)))
    factor = splu(
        dominant,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    local[free] = factor.perm_c
    return local


def factor_capacity(system: System) -> int:
    """Upper bound on the blocks below the diagonal of the factor of any design.

    Removing beams makes farther beams neighbours around a node, so the bound comes
    from a lattice in which all beams around a node are coupled.
    """
    pattern = _coupled_nodes(
        system.beams, system.ring_start, system.ring_beam, system.block, neighbours_only=False
    )
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
