"""The exact boundary of all points within a distance (reach) of a set of struts.

It consists of lines parallel to struts and of arcs around nodes. The points of such a line or
circle that are covered by another strut form a single interval, which has a closed form: the set of
points within reach of a strut is convex, and the covered angles of a circle of the same radius are
those of a disc that slides along the strut. The boundary is what no interval covers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.part.outline.struts import Struts

    Reals = NDArray[np.float64]
    Ids = NDArray[np.int64]

# Lines and arcs shorter than this fraction of the strut width are left out of an outline.
MIN_EDGE = 1e-5


@dataclass(frozen=True, slots=True, eq=False)
class Border:
    """The boundary of all points within reach of struts, as edges in the order of its loops.

    The material is to the left. The edge e runs from ``foot[e, 0] + reach * normal[e, 0]`` to
    ``foot[e, 1] + reach * normal[e, 1]``.

    Parameters
    ----------
    foot : (E, 2, 2) float64, mm
        Points of the centre lines nearest to start and end of each edge.
    normal : (E, 2, 2) float64
        Outward unit normals at start and end of each edge.
    turn : (E,) float64
        Angle by which each edge turns: 0 along a strut, positive around a node.
    sizes : tuple of int
        Number of edges of each loop; the edges of a loop are consecutive.
    gap : float, mm
        Largest distance between the end of an edge and the start of the next.
    """

    foot: Reals
    normal: Reals
    turn: Reals
    sizes: tuple[int, ...]
    gap: float


def border(struts: Struts, reach: float, width: float) -> Border:
    """Return the boundary of all points within `reach` of `struts`.

    Parameters
    ----------
    struts
        The struts.
    reach : float, mm
        Half the strut width plus the fillet radius.
    width : float, mm
        Strut width, which determines the length of the shortest edges (`MIN_EDGE`).
    """
    sides = _sides(struts, reach, MIN_EDGE * width)
    rounds = _rounds(struts, reach, 2.0 * MIN_EDGE)
    foot, normal, turn = (np.concatenate(both) for both in zip(sides, rounds, strict=True))
    starts, ends = (foot + reach * normal).transpose(1, 0, 2)
    following, gap = _followers(starts, ends)
    order, sizes = _cycles(following)
    return Border(foot[order], normal[order], turn[order], sizes, gap)


def _sides(struts: Struts, reach: float, least: float) -> tuple[Reals, Reals, Reals]:
    """Return foot, normal and turn of all lines of the boundary."""
    count = len(struts.beams)
    start, end = struts.positions[struts.beams[:, 0]], struts.positions[struts.beams[:, 1]]
    length = np.linalg.norm(end - start, axis=1)
    along = (end - start) / length[:, None]
    near, other = struts.tree.query(struts.tree.geometries, "dwithin", 2.0 * reach)
    near, other = near[near != other], other[near != other]
    foot, normal = [], []
    # The right-hand side of a strut, and of the reversed strut.
    for ends, begin, axis in (
        (struts.beams, start, along),
        (struts.beams[:, ::-1], end, -along),
    ):
        right = np.column_stack([axis[:, 1], -axis[:, 0]])
        low, high = _covered_lines(
            begin + reach * right, axis, length, ends, near, other, struts, reach
        )
        line, low, high = _uncovered(near, low, high, np.zeros(count), length)
        long_enough = high - low > least
        line, span = line[long_enough], np.column_stack([low, high])[long_enough]
        foot.append(begin[line, None] + span[:, :, None] * axis[line, None])
        normal.append(np.repeat(right[line, None], 2, axis=1))
    feet = np.concatenate(foot)
    return feet, np.concatenate(normal), np.zeros(len(feet))


def _covered_lines(
    origin: Reals,
    axis: Reals,
    length: Reals,
    ends: Ids,
    near: Ids,
    other: Ids,
    struts: Struts,
    reach: float,
) -> tuple[Reals, Reals]:
    """Return the interval of the line along strut `near` that strut `other` covers."""
    tail = struts.positions[struts.beams[other, 0]]
    head = struts.positions[struts.beams[other, 1]]
    span = length[other]
    forward = (head - tail) / span[:, None]
    ahead = axis[near]
    offset = origin[near] - tail
    across, slope = _cross(forward, offset), _cross(forward, ahead)
    low, high = _between(across, slope, -reach, reach)
    bottom, top = _between(_dot(forward, offset), _dot(forward, ahead), 0.0, span)
    low, high = np.maximum(low, bottom), np.minimum(high, top)
    empty = low >= high
    low[empty], high[empty] = np.inf, -np.inf
    for column, centre in enumerate((tail, head)):
        towards = centre - origin[near]
        off = np.abs(_cross(ahead, towards))
        square = (reach - off) * (reach + off)
        node = struts.beams[other, column]
        # The circle around a node of the strut itself is tangent to the line at its end.
        own = (node == ends[near, 0]) | (node == ends[near, 1])
        covers = ~own & (square > 0.0)
        half, middle = np.sqrt(np.where(covers, square, 0.0)), _dot(ahead, towards)
        low = np.where(covers, np.minimum(low, middle - half), low)
        high = np.where(covers, np.maximum(high, middle + half), high)
    return low, high


def _rounds(struts: Struts, reach: float, least: float) -> tuple[Reals, Reals, Reals]:
    """Return foot, normal and turn of all arcs of the boundary."""
    import shapely

    count = len(struts.positions)
    points = shapely.points(struts.positions)
    node, strut = struts.tree.query(points, "dwithin", 2.0 * reach)
    first, second = (struts.positions[struts.beams[strut, end]] for end in (0, 1))
    centre = struts.positions[node]
    begins, stops = struts.beams[strut, 0] == node, struts.beams[strut, 1] == node
    middle, low, high = _covered_circles(centre, first, second, reach)
    # A strut that ends at the node covers exactly the half circle on its side.
    away = np.where(begins[:, None], second - first, first - second)
    own = begins | stops
    middle = np.where(own, np.arctan2(away[:, 1], away[:, 0]), middle)
    low, high = np.where(own, -0.5 * np.pi, low), np.where(own, 0.5 * np.pi, high)
    # Angles are measured from one of these struts, so that no arc contains the angle 0.
    zero = np.zeros(count)
    zero[node[own]] = middle[own]
    middle = np.mod(middle - zero[node], 2.0 * np.pi)
    turns = 2.0 * np.pi * np.array([[-1.0], [0.0], [1.0]])
    arc, low, high = _uncovered(
        np.tile(node, 3),
        (middle + low + turns).ravel(),
        (middle + high + turns).ravel(),
        np.full(count, 0.5 * np.pi),
        np.full(count, 1.5 * np.pi),
    )
    long_enough = high - low > least
    arc, angle = arc[long_enough], np.column_stack([low, high])[long_enough]
    turn = angle[:, 1] - angle[:, 0]
    angle += zero[arc, None]
    foot = np.repeat(struts.positions[arc, None], 2, axis=1)
    return foot, np.stack([np.cos(angle), np.sin(angle)], axis=2), turn


def _covered_circles(
    centre: Reals, first: Reals, second: Reals, reach: float
) -> tuple[Reals, Reals, Reals]:
    """Return the angles of circles of radius `reach` that struts cover, one strut per circle.

    Returns
    -------
    middle, low, high : (n,) float64
        Direction towards the line of the strut, and the limits of the interval relative to it.
    """
    axis = second - first
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    right = np.column_stack([axis[:, 1], -axis[:, 0]])
    height = _dot(right, first - centre)
    # Direction towards the strut, and positions of its ends along it.
    front = np.where(height[:, None] >= 0.0, right, -right)
    sideways = np.where(height >= 0.0, 1.0, -1.0)
    height = np.abs(height)
    low, high = np.full(len(height), np.inf), np.full(len(height), -np.inf)
    left_end = sideways * _dot(axis, first - centre)
    right_end = sideways * _dot(axis, second - centre)
    for end in (left_end, right_end):
        distance = np.hypot(end, height)
        covers = distance < 2.0 * reach
        half = np.arccos(np.minimum(0.5 * distance / reach, 1.0))
        angle = np.arctan2(end, height)
        low = np.where(covers, np.minimum(low, angle - half), low)
        high = np.where(covers, np.maximum(high, angle + half), high)
    half = np.arccos(np.minimum(height / reach - 1.0, 1.0))
    for angle in (-half, half):
        offset = reach * np.sin(angle)
        covers = (height < 2.0 * reach) & (offset >= np.minimum(left_end, right_end))
        covers &= offset <= np.maximum(left_end, right_end)
        low = np.where(covers, np.minimum(low, angle), low)
        high = np.where(covers, np.maximum(high, angle), high)
    return np.arctan2(front[:, 1], front[:, 0]), low, high


def _uncovered(
    curve: Ids, low: Reals, high: Reals, begin: Reals, end: Reals
) -> tuple[Ids, Reals, Reals]:
    """Return the intervals of each curve from `begin` to `end` that are not covered."""
    every = np.arange(len(begin))
    some = low < high
    curve = np.concatenate([every, curve[some], every])
    low = np.concatenate([np.full(len(begin), -np.inf), low[some], end])
    high = np.concatenate([begin, high[some], np.full(len(begin), np.inf)])
    # Ranks increase from curve to curve, so that one running maximum is sufficient.
    by_end = np.lexsort((high, curve))
    rank = np.empty(len(curve), dtype=np.int64)
    rank[by_end] = np.arange(len(curve))
    order = np.lexsort((low, curve))
    reached = high[by_end][np.maximum.accumulate(rank[order])][:-1]
    resumed = low[order][1:]
    free = (reached < resumed) & (curve[order][1:] == curve[order][:-1])
    return curve[order][:-1][free], reached[free], resumed[free]


def _followers(starts: Reals, ends: Reals) -> tuple[Ids, float]:
    """Return the edge that follows each edge, and the largest gap between consecutive edges."""
    following = np.full(len(ends), -1, dtype=np.int64)
    edges, heads = np.arange(len(ends)), np.arange(len(starts))
    gap = 0.0
    while len(edges):
        there, onward = _nearest(starts[heads], ends[edges])
        _, back = _nearest(ends[edges], starts[heads])
        mutual = back[onward] == np.arange(len(edges))
        if not mutual.any():
            return following, np.inf
        following[edges[mutual]] = heads[onward[mutual]]
        gap = max(gap, float(there[mutual].max()))
        edges, heads = edges[~mutual], np.delete(heads, onward[mutual])
    return following, gap


def _nearest(targets: Reals, points: Reals) -> tuple[Reals, Ids]:
    """Return distance and index of the nearest of `targets` for each of `points`."""
    from scipy.spatial import cKDTree

    distance, which = cKDTree(targets).query(points)
    return np.asarray(distance, dtype=np.float64), np.asarray(which, dtype=np.int64)


def _cycles(following: Ids) -> tuple[Ids, tuple[int, ...]]:
    """Return all edges in order, loop by loop, and the number of edges of each loop."""
    order: list[int] = []
    sizes: list[int] = []
    successor = following.tolist()
    seen = [False] * len(successor)
    for first in range(len(successor)):
        edge, before = first, len(order)
        while edge >= 0 and not seen[edge]:
            seen[edge] = True
            order.append(edge)
            edge = successor[edge]
        if len(order) > before:
            sizes.append(len(order) - before)
    return np.array(order, dtype=np.int64), tuple(sizes)


def _between(
    value: Reals, slope: Reals, least: Reals | float, most: Reals | float
) -> tuple[Reals, Reals]:
    """Return the interval of t in which ``value + slope * t`` is between `least` and `most`."""
    steep = np.where(np.abs(slope) < 1e-15, 1e-15, slope)
    one, two = (least - value) / steep, (most - value) / steep
    return np.minimum(one, two), np.maximum(one, two)


def _cross(a: Reals, b: Reals) -> Reals:
    product: Reals = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return product


def _dot(a: Reals, b: Reals) -> Reals:
    product: Reals = a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1]
    return product
