"""Plates, pads and pointers: exact changes of an outline.

Filling the holes between the nodes of a block makes a plate for clamping or a pad for pushing. An
additional strut at the output makes its motion visible. Lines and arcs remain exact.
`bellcrank.part.outline.screws` adds screw holes to plates.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.part.outline.curves import Loop, Outline
from bellcrank.part.outline.struts import read_widths

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Reals = NDArray[np.float64]
    Ids = NDArray[np.int64]

_CLOSE = 1e-6
"""Relative tolerance of equal distances."""


def filled(
    outline: Outline,
    positions: ArrayLike,
    beams: ArrayLike,
    nodes: ArrayLike,
    width: ArrayLike = 0.0,
) -> Outline:
    """Return an outline without the holes between given nodes.

    A hole is filled, with its content, if every strut along it connects two of the nodes.

    Parameters
    ----------
    outline
        Outline of the struts.
    positions : (N, 2) array_like, mm
        Nodes.
    beams : (M, 2) array_like of int
        The two nodes of each strut.
    nodes : (k,) array_like of int
        Nodes of the block, for example all supports.
    width : float or (M,) array_like, mm
        Width of the struts, needed where they differ.

    Raises
    ------
    InvalidSettings
        If a node does not exist.

    Examples
    --------
    >>> from bellcrank.part.outline import strut_outline
    >>> square = [[0, 0], [10, 0], [10, 10], [0, 10]]
    >>> beams = [[0, 1], [1, 2], [2, 3], [3, 0], [0, 2]]
    >>> outline = strut_outline(square, beams, width=1.0, fillet=0.2)
    >>> filled(outline, square, beams, [0, 1, 2]).hole_count
    1
    >>> filled(outline, square, beams, [0, 1, 2, 3]).hole_count
    0
    """
    import shapely

    places, pairs = np.asarray(positions, dtype=np.float64), np.asarray(beams)
    block = read_nodes(nodes, len(places))
    if not outline.holes:
        return outline
    ends = np.isin(pairs, block)
    inner = np.all(ends, axis=1)
    probes = [_probes(hole) for hole in outline.holes]
    hole = np.repeat(np.arange(len(probes)), [len(probe) for probe in probes])
    corners = np.concatenate(probes)
    points = shapely.points(corners)
    tree = shapely.STRtree(shapely.linestrings(places[pairs]))
    half = 0.5 * read_widths(width, len(pairs))
    _, nearest = tree.query_nearest(points, all_matches=False, return_distance=True)
    probe, strut = tree.query(points, "dwithin", nearest * (1.0 + _CLOSE) + np.ptp(half))
    distance = shapely.distance(points[probe], tree.geometries[strut])
    beyond = distance - half[strut]
    least = np.full(len(points), np.inf)
    np.minimum.at(least, probe, beyond)
    bounds = beyond <= least[probe] + _CLOSE * distance
    # A strut that leaves the block bounds its holes next to its node where it is wide.
    chord = places[pairs[strut, 1]] - places[pairs[strut, 0]]
    length = np.linalg.norm(chord, axis=1)
    along = ((corners[probe] - places[pairs[strut, 0]]) * chord).sum(axis=1) / length
    at_node = ((along <= half[strut]) & ends[strut, 0]) | (
        (along >= length - half[strut]) & ends[strut, 1]
    )
    gone = np.ones(len(probes), dtype=np.bool_)
    gone[hole[probe[bounds & ~inner[strut] & ~at_node]]] = False
    return _without_holes(outline, gone)


def with_pointer(
    positions: ArrayLike, beams: ArrayLike, node: int, direction: ArrayLike, length: float
) -> tuple[Reals, Ids]:
    """Return nodes and beams with an additional strut from a node in a given direction.

    Parameters
    ----------
    positions : (N, 2) array_like, mm
        Nodes.
    beams : (M, 2) array_like of int
        The two nodes of each strut.
    node
        Node at which the pointer begins, for example an output node.
    direction : (2,) array_like
        Direction of the pointer, not normalised.
    length : float, mm
        Length of the pointer.

    Returns
    -------
    (N + 1, 2) float64, mm, and (M + 1, 2) int64
        Arguments for `strut_outline`.

    Raises
    ------
    InvalidSettings
        If the node does not exist, or the direction or the length is not valid.

    Examples
    --------
    >>> positions, beams = with_pointer([[0, 0], [10, 0]], [[0, 1]], 1, [0, -3], 5.0)
    >>> positions[2].tolist(), beams.tolist()
    ([10.0, -5.0], [[0, 1], [1, 2]])
    """
    places, pairs = np.asarray(positions, dtype=np.float64), np.asarray(beams, dtype=np.int64)
    start = int(read_nodes([node], len(places))[0])
    along = np.asarray(direction, dtype=np.float64)
    size = float(np.linalg.norm(along))
    if along.shape != (2,) or not 0.0 < size < np.inf:
        raise InvalidSettings(f"direction: expected two numbers, not both 0, got {direction!r}")
    if not 0.0 < length < np.inf:
        raise InvalidSettings(f"length: expected a length above 0 mm, got {length!r}")
    tip = places[start] + length / size * along
    return np.vstack([places, tip]), np.vstack([pairs, [start, len(places)]])


def _probes(hole: Loop) -> Reals:
    """Return a point for each edge of a hole to which the bounding struts are nearest.

    The point of a fillet is its centre, which has the same distance from two struts.
    """
    chords = hole.chords
    left = np.column_stack([-chords[:, 1], chords[:, 0]])
    middle: Reals = hole.points + 0.5 * chords - 0.5 * hole.bulge[:, None] * left
    middle[hole.bulge < 0.0] = hole.centres[hole.bulge < 0.0]
    return middle


def _without_holes(outline: Outline, gone: NDArray[np.bool_]) -> Outline:
    """Return an outline without some of its holes and their content."""
    import shapely

    holes = [hole for hole, away in zip(outline.holes, gone, strict=True) if not away]
    outer = list(outline.outer)
    if len(outer) > 1 and gone.any():
        plates = [
            shapely.Polygon(hole.flattened(1e-4 * hole.length))
            for hole, away in zip(outline.holes, gone, strict=True)
            if away
        ]
        plate = shapely.union_all(plates)
        outer = [loop for loop in outer if not shapely.contains_xy(plate, *loop.points[0])]
        holes = [hole for hole in holes if not shapely.contains_xy(plate, *hole.points[0])]
    return Outline(tuple(outer), tuple(holes))


def read_nodes(nodes: ArrayLike, count: int) -> Ids:
    """Return valid node numbers, (k,) int64; InvalidSettings if a node does not exist."""
    ids = np.asarray(nodes)
    if ids.ndim != 1 or not len(ids) or not np.issubdtype(ids.dtype, np.integer):
        raise InvalidSettings(f"nodes: expected one or more numbers of nodes, got {nodes!r}")
    bad = np.flatnonzero((ids < 0) | (ids >= count))
    if len(bad):
        raise InvalidSettings(
            f"nodes[{bad[0]}]: got node {ids[bad[0]]}, but nodes are 0 to {count - 1}"
        )
    return ids.astype(np.int64)
