"""Struts as they come in: checked, and cut wherever a node lies on them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from shapely import STRtree

# Nodes closer to each other than this part of the whole are in one place, and those closer
# to a strut lie on it.
_ONE_PLACE = 1e-8


@dataclass(frozen=True, slots=True, eq=False)
class Struts:
    """Straight struts between nodes, none of which coincides with another or lies on a strut.

    Struts may cross, but no two of them share more than a point.

    Parameters
    ----------
    positions : (N, 2) float64, mm
        Nodes, all of them touched by a strut, measured from `origin`.
    beams : (M, 2) int64
        The two nodes of each strut.
    tree
        Their centre lines, in the order of `beams`.
    origin : (2,) float64, mm
        A point amid the nodes: coordinates from there lose the fewest digits.
    extent : float, mm
        Size of the whole, against which rounding errors are measured.
    """

    positions: NDArray[np.float64]
    beams: NDArray[np.int64]
    tree: STRtree
    origin: NDArray[np.float64]
    extent: float


def read_struts(positions: ArrayLike, beams: ArrayLike) -> Struts:
    """Check nodes and beams, leave out nodes that no beam touches, and cut beams at nodes.

    Parameters
    ----------
    positions : (N, 2) array_like, mm
    beams : (M, 2) array_like of int

    Raises
    ------
    InvalidSettings
        If a shape is wrong, a number is not finite, or a beam names a node that does not
        exist or has no length.
    """
    import shapely

    nodes, pairs = _read_positions(positions), _read_beams(beams)
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
    place = _places(nodes, _ONE_PLACE * extent)
    without = np.flatnonzero(place[pairs[:, 0]] == place[pairs[:, 1]])
    if len(without):
        a, b = touched[pairs[without[0]]]
        raise InvalidSettings(
            f"beams[{without[0]}]: has no length, nodes {a} and {b} are in one place; leave it out"
        )
    _, first = np.unique(place, return_index=True)
    nodes = nodes[first] - origin
    pairs = _cut_at_nodes(nodes, place[pairs], _ONE_PLACE * extent)
    tree = shapely.STRtree(shapely.linestrings(nodes[pairs]))
    return Struts(nodes, pairs, tree, origin, extent)


def pieces_of(beams: NDArray[np.int64], node_count: int) -> NDArray[np.int64]:
    """Return a number for each node that it shares with all nodes that beams lead to."""
    graph = coo_array((np.ones(len(beams)), (beams[:, 0], beams[:, 1])), (node_count,) * 2)
    labels: NDArray[np.int64] = connected_components(graph, directed=False)[1].astype(np.int64)
    return labels


def expected_holes(positions: ArrayLike, beams: ArrayLike) -> int:
    """Count the holes between struts that are very narrow and cross nowhere.

    By Euler's formula these are beams - touched nodes + separate pieces.

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
    nodes: NDArray[np.float64], pairs: NDArray[np.int64], tolerance: float
) -> NDArray[np.int64]:
    """Return the struts between neighbouring nodes along each strut, each of them once."""
    import shapely

    tree = shapely.STRtree(shapely.linestrings(nodes[pairs]))
    node, strut = tree.query(shapely.points(nodes), "dwithin", tolerance)
    # Both ends of every strut belong, whatever rounding says of their distance.
    node = np.concatenate([pairs[:, 0], pairs[:, 1], node])
    strut = np.concatenate([np.tile(np.arange(len(pairs)), 2), strut])
    strut, node = np.unique(np.column_stack([strut, node]), axis=0).T
    tail, head = nodes[pairs[strut, 0]], nodes[pairs[strut, 1]]
    place = np.sum((nodes[node] - tail) * (head - tail), axis=1)
    order = np.lexsort((place, strut))
    strut, node = strut[order], node[order]
    parts = np.column_stack([node[:-1], node[1:]])[strut[:-1] == strut[1:]]
    return np.unique(np.sort(parts, axis=1), axis=0)


def _places(nodes: NDArray[np.float64], tolerance: float) -> NDArray[np.int64]:
    """Return a number for each node that nodes in one place have in common."""
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
        raise InvalidSettings("beams: expected one or more, got none; there is no part to outline")
    if pairs.ndim != 2 or pairs.shape[1] != 2:
        raise InvalidSettings(f"beams: expected shape (M, 2), got shape {pairs.shape}")
    if not np.issubdtype(pairs.dtype, np.integer):
        raise InvalidSettings(f"beams: expected integers, got values of type {pairs.dtype}")
    return pairs.astype(np.int64)
