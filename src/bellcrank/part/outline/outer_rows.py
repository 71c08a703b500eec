"""Rows of nodes outside of a part, for plates and pads of supports and inputs in a single row."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.part.outline.grips import read_nodes

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Reals = NDArray[np.float64]
    Ids = NDArray[np.int64]

_ROW_WIDTH = 1e-3
"""Width of a row of nodes on a line over its length."""


def with_outer_rows(
    positions: ArrayLike,
    beams: ArrayLike,
    nodes: ArrayLike,
    depth: float,
    reach: float,
    margin: float = 0.0,
) -> tuple[Reals, Ids, Ids]:
    """Return nodes and beams with a row of nodes outside of each row of given nodes.

    Nodes in a row at the boundary enclose no holes. A second row of nodes outside, joined to them
    by struts, encloses holes that `filled` makes a plate. Rows are of two or more nodes on a line;
    a row with struts on both sides gets none.

    Parameters
    ----------
    positions : (N, 2) array_like, mm
        Nodes.
    beams : (M, 2) array_like of int
        The two nodes of each strut.
    nodes : (k,) array_like of int
        Nodes of the block, for example all supports.
    depth : float, mm
        Distance of the new rows.
    reach : float, mm
        Largest distance of neighbours in a row.
    margin : float, mm
        Distance to be left between the new row and other nodes.

    Returns
    -------
    (N + n, 2) float64, mm, and (M + m, 2) int64
        Arguments for `strut_outline`.
    (k + n,) int64
        Nodes of the block with the new ones.

    Raises
    ------
    InvalidSettings
        If a node does not exist.

    Examples
    --------
    >>> positions, beams, block = with_outer_rows(
    ...     [[0, 0], [10, 0], [5, 8]], [[0, 2], [1, 2]], [0, 1], depth=6.0, reach=12.0
    ... )
    >>> positions[3:].tolist(), block.tolist()
    ([[0.0, -6.0], [10.0, -6.0]], [0, 1, 3, 4])
    >>> beams[2:].tolist()
    [[0, 1], [0, 3], [1, 4], [3, 4], [0, 4]]
    """
    from scipy.sparse.csgraph import connected_components

    places, pairs = np.asarray(positions, dtype=np.float64), np.asarray(beams, dtype=np.int64)
    block = read_nodes(nodes, len(places))
    apart = np.linalg.norm(places[block][:, None] - places[block], axis=2)
    count, row_of = connected_components(apart <= reach, directed=False)
    known = {tuple(sorted(pair)) for pair in pairs.tolist()}
    whole, added = [places], []
    first = len(places)
    for row in range(count):
        line = _outer_line(places, pairs, block[row_of == row], depth, margin)
        if line is None:
            continue
        own, outward = line
        whole.append(places[own] + depth * outward)
        inner, outer = own.tolist(), list(range(first, first + len(own)))
        first += len(own)
        added += [pair for pair in pairwise(inner) if tuple(sorted(pair)) not in known]
        added += [*zip(inner, outer, strict=True), *pairwise(outer)]
        added += zip(inner[:-1], outer[1:], strict=True)
    struts = np.array(added, dtype=np.int64).reshape(-1, 2)
    more = np.arange(len(places), first)
    return np.vstack(whole), np.vstack([pairs, struts]), np.concatenate([block, more])


def _outer_line(
    places: Reals, pairs: Ids, nodes: Ids, depth: float, margin: float
) -> tuple[Ids, Reals] | None:
    """Return nodes in their order on a line, and the side on which there is room for a row.

    None if they are not on a line, or there are other nodes on both sides, or struts to them.
    """
    if len(nodes) < 2:
        return None
    centre = places[nodes].mean(axis=0)
    _, sizes, axes = np.linalg.svd(places[nodes] - centre)
    if sizes[1] > _ROW_WIDTH * sizes[0]:
        return None
    along, across = axes
    order = nodes[np.argsort(places[nodes] @ along)]
    used, joined = np.unique(pairs), np.unique(pairs[np.isin(pairs, nodes).any(axis=1)])
    away = places[used].mean(axis=0) - centre
    outward = -across if away @ across > 0.0 else across
    others = places - centre
    ends = others[nodes] @ along
    low, high = ends.min() - margin, ends.max() + margin
    for side in (outward, -outward):
        above = others @ side > _ROW_WIDTH * sizes[0]
        within = (others @ along > low) & (others @ along < high)
        near = np.isin(np.arange(len(places)), used) & (others @ side < depth + margin)
        near[joined] = True
        if not (above & within & near).any():
            return order, side
    return None
