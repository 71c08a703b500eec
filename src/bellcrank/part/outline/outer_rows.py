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

_ROW_WIDTH = 0.3
"""Largest width of a row over the largest distance of neighbours: that of the left or right side of
a triangular lattice, whose nodes are alternately half a spacing inside."""
_ON_LINE = 1e-3
"""Distance from a line over its length within which nodes lie on it."""


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
    by struts, encloses holes that `filled` makes a plate. Rows are of two or more nodes on a line,
    or alternately up to 0.3 of `reach` beside it; a row with struts on both sides gets none. The
    new rows are straight.

    Parameters
    ----------
    positions : (N, 2) array_like, mm
        Nodes.
    beams : (M, 2) array_like of int
        The two nodes of each strut.
    nodes : (k,) array_like of int
        Nodes of the block, for example all supports.
    depth : float, mm
        Distance of the new rows from the outermost nodes.
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
        line = _outer_line(places, pairs, block[row_of == row], _ROW_WIDTH * reach, depth, margin)
        if line is None:
            continue
        own, outward = line
        heights = places[own] @ outward
        whole.append(places[own] + np.outer(heights.max() + depth - heights, outward))
        inner, outer = own.tolist(), list(range(first, first + len(own)))
        first += len(own)
        added += [pair for pair in pairwise(inner) if tuple(sorted(pair)) not in known]
        added += [*zip(inner, outer, strict=True), *pairwise(outer)]
        added += zip(inner[:-1], outer[1:], strict=True)
    struts = np.array(added, dtype=np.int64).reshape(-1, 2)
    more = np.arange(len(places), first)
    return np.vstack(whole), np.vstack([pairs, struts]), np.concatenate([block, more])


def _outer_line(
    places: Reals, pairs: Ids, nodes: Ids, width: float, depth: float, margin: float
) -> tuple[Ids, Reals] | None:
    """Return nodes in their order along a row, and the side on which there is room for another.

    None if the row is wider than `width`, or there are other nodes on both sides, or struts to
    them.
    """
    if len(nodes) < 2:
        return None
    centre = places[nodes].mean(axis=0)
    order, along = _along(places, nodes)
    across = np.array([-along[1], along[0]])
    own, others = (places[nodes] - centre) @ across, places - centre
    if np.ptp(own) > width:
        return None
    used, joined = np.unique(pairs), np.unique(pairs[np.isin(pairs, nodes).any(axis=1)])
    away = places[used].mean(axis=0) - centre
    outward = -across if away @ across > 0.0 else across
    ends = others[nodes] @ along
    low, high = ends.min() - margin, ends.max() + margin
    for side in (outward, -outward):
        top = float((others[nodes] @ side).max())
        # Nodes between those of the row are beside it, unless they are on its inner side.
        above = others @ side > top - np.ptp(own) + _ON_LINE * np.ptp(ends)
        above[nodes] = False
        within = (others @ along > low) & (others @ along < high)
        near = np.isin(np.arange(len(places)), used) & (others @ side < top + depth + margin)
        near[joined] = True
        if not (above & within & near).any():
            return order, side
    return None


def _along(places: Reals, nodes: Ids) -> tuple[Ids, Reals]:
    """Return nodes in their order along a row, and its unit direction.

    The direction joins two nodes near the ends, such that the row is narrowest: nodes that lie
    alternately on two lines have an end on each, and their principal axis is inclined.
    """
    centred = places[nodes] - places[nodes].mean(axis=0)
    order = nodes[np.argsort(centred @ np.linalg.svd(centred)[2][0])]
    first, last = places[order[:2]], places[order[-2:]]
    chords = [b - a for a in first for b in last if np.linalg.norm(b - a) > 0.0]
    lines = [chord / np.linalg.norm(chord) for chord in chords]
    widths = [np.ptp(centred @ np.array([-y, x])) for x, y in lines]
    return order, lines[int(np.argmin(np.round(widths, 9)))]
