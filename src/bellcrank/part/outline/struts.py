"""Validated struts, divided at every node that lies on them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from shapely import STRtree

# Nodes closer than this distance, relative to the size of the part, coincide; nodes closer to a
# strut lie on it.
_COINCIDENT = 1e-8
# Widths are multiples of this length, relative to the size of the part: those that differ by
# rounding errors are equal.
_EQUAL = 1e-11


@dataclass(frozen=True, slots=True, eq=False)
class Struts:
    """Straight struts between distinct nodes, none of which lies inside a strut.

    Struts may cross, but do not overlap.

    Parameters
    ----------
    positions : (N, 2) float64, mm
        Nodes relative to `origin`; each has a strut.
    beams : (M, 2) int64
        The two nodes of each strut.
    extra : (M,) float64, mm
        Half the width of each strut less that of the narrowest given one.
    tree
        Spatial index of the centre lines, in the order of `beams`.
    origin : (2,) float64, mm
        Centre of the bounding box, which minimises rounding errors of coordinates.
    extent : float, mm
        Size of the part, the reference of relative tolerances.
    """

    positions: NDArray[np.float64]
    beams: NDArray[np.int64]
    extra: NDArray[np.float64]
    tree: STRtree
    origin: NDArray[np.float64]
    extent: float

    @property
    def extra_of_nodes(self) -> NDArray[np.float64]:
        """Return (N,) the largest `extra` of the struts of each node, mm."""
        largest = np.zeros(len(self.positions))
        np.maximum.at(largest, self.beams, self.extra[:, None])
        return largest


def read_struts(positions: ArrayLike, beams: ArrayLike, width: ArrayLike = 0.0) -> Struts:
    """Validate nodes and beams, remove nodes without beams, and divide beams at nodes.

    Parameters
    ----------
    positions : (N, 2) array_like, mm
    beams : (M, 2) array_like of int
    width : float or (M,) array_like, mm
        Width of the struts. Where struts overlap, the largest counts.

    Raises
    ------
    InvalidSettings
        If a shape is wrong, a number is not finite, or a beam names an unknown node or has no
        length.
    """
    import shapely

    nodes, pairs = _read_positions(positions), _read_beams(beams)
    half = 0.5 * read_widths(width, len(pairs))
    bad = np.argwhere((pairs < 0) | (pairs >= len(nodes)))
    if len(bad):
        row, column = bad[0]
        raise InvalidSettings(
            f"beams[{row}]: names node {pairs[row, column]}, but nodes are 0 to {len(nodes) - 1}"
        )
    touched, pairs = np.unique(pairs, return_inverse=True)
    pairs = pairs.reshape(-1, 2)
    nodes = nodes[touched]
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    origin, extent = 0.5 * (low + high), float((high - low).max())
    label = _coincident(nodes, _COINCIDENT * extent)
    without = np.flatnonzero(label[pairs[:, 0]] == label[pairs[:, 1]])
    if len(without):
        a, b = touched[pairs[without[0]]]
        raise InvalidSettings(
            f"beams[{without[0]}]: has no length, nodes {a} and {b} coincide; remove it"
        )
    _, first = np.unique(label, return_index=True)
    nodes = nodes[first] - origin
    wider = _EQUAL * extent * np.round((half - half.min()) / (_EQUAL * extent))
    pairs, extra = _cut_at_nodes(nodes, label[pairs], wider, _COINCIDENT * extent)
    tree = shapely.STRtree(shapely.linestrings(nodes[pairs]))
    return Struts(nodes, pairs, extra, tree, origin, extent)


def read_widths(width: ArrayLike, count: int) -> NDArray[np.float64]:
    """Return (count,) the widths of struts, from one for all or one for each.

    Raises
    ------
    InvalidSettings
        If their number is wrong.
    """
    given = np.asarray(width, dtype=np.float64)
    if given.shape not in ((), (count,)):
        raise InvalidSettings(f"width: expected one, or {count}, got shape {given.shape}")
    return np.broadcast_to(given, (count,))


def pieces_of(beams: NDArray[np.int64], node_count: int) -> NDArray[np.int64]:
    """Return the number of the connected piece of each node."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(beams)), (beams[:, 0], beams[:, 1])), (node_count,) * 2)
    labels: NDArray[np.int64] = connected_components(graph, directed=False)[1].astype(np.int64)
    return labels


def expected_holes(positions: ArrayLike, beams: ArrayLike) -> int:
    """Return the number of holes between very narrow struts that do not cross.

    By Euler's formula it is beams - nodes with beams + pieces.

    Parameters
    ----------
    positions : (N, 2) array_like, mm
        Nodes.
    beams : (M, 2) array_like of int
        The two nodes of each strut.

    Raises
    ------
    InvalidSettings
        As for `strut_outline`.

    Examples
    --------
    >>> expected_holes([[0, 0], [9, 0], [9, 9], [0, 9]], [[0, 1], [1, 2], [2, 3], [3, 0], [0, 2]])
    2
    """
    struts = read_struts(positions, beams)
    count = len(struts.positions)
    return len(struts.beams) - count + int(pieces_of(struts.beams, count).max()) + 1


def _cut_at_nodes(
    nodes: NDArray[np.float64],
    pairs: NDArray[np.int64],
    extra: NDArray[np.float64],
    tolerance: float,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the distinct struts between neighbouring nodes along each strut, and their `extra`."""
    import shapely

    tree = shapely.STRtree(shapely.linestrings(nodes[pairs]))
    node, strut = tree.query(shapely.points(nodes), "dwithin", tolerance)
    # Both ends of every strut are included despite rounding errors.
    node = np.concatenate([pairs[:, 0], pairs[:, 1], node])
    strut = np.concatenate([np.tile(np.arange(len(pairs)), 2), strut])
    strut, node = np.unique(np.column_stack([strut, node]), axis=0).T
    tail, head = nodes[pairs[strut, 0]], nodes[pairs[strut, 1]]
    position = np.sum((nodes[node] - tail) * (head - tail), axis=1)
    order = np.lexsort((position, strut))
    strut, node = strut[order], node[order]
    same = strut[:-1] == strut[1:]
    parts = np.column_stack([node[:-1], node[1:]])[same]
    distinct, which = np.unique(np.sort(parts, axis=1), axis=0, return_inverse=True)
    largest = np.zeros(len(distinct))
    np.maximum.at(largest, which.ravel(), extra[strut[:-1][same]])
    return distinct, largest


def _coincident(nodes: NDArray[np.float64], tolerance: float) -> NDArray[np.int64]:
    """Return a label for each node, equal for coincident nodes."""
    from scipy.spatial import cKDTree

    close = cKDTree(nodes).query_pairs(tolerance, output_type="ndarray")
    return pieces_of(close, len(nodes))


def _read_positions(positions: ArrayLike) -> NDArray[np.float64]:
    try:
        nodes: NDArray[np.float64] = np.asarray(positions, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidSettings(f"positions: expected numbers, {error}") from error
    if nodes.ndim != 2 or nodes.shape[1] != 2:
        raise InvalidSettings(
            f"positions: expected shape (N, 2), in the plane, got shape {nodes.shape}"
        )
    bad = np.argwhere(~np.isfinite(nodes))
    if len(bad):
        row, column = bad[0]
        raise InvalidSettings(
            f"positions[{row}][{column}]: expected a finite number, got {nodes[row, column]}"
        )
    return nodes


def _read_beams(beams: ArrayLike) -> NDArray[np.int64]:
    pairs = np.asarray(beams)
    if pairs.size == 0:
        raise InvalidSettings("beams: expected one or more, got none")
    if pairs.ndim != 2 or pairs.shape[1] != 2:
        raise InvalidSettings(f"beams: expected shape (M, 2), got shape {pairs.shape}")
    if not np.issubdtype(pairs.dtype, np.integer):
        raise InvalidSettings(f"beams: expected integers, got values of type {pairs.dtype}")
    return pairs.astype(np.int64)
