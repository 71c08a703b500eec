"""The exact boundary of all points within a distance (reach) of a set of struts.

The reach of a wider strut is larger by its `extra`, that of a node is the largest of its struts.
The boundary consists of lines parallel to struts and of arcs around nodes. The points of such a
line that another strut covers form an interval, since the set of points within reach of a strut is
convex; those of such a circle form intervals between its intersections with the lines and circles
of the other strut. The boundary is what no interval covers.
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

# Lines shorter than this fraction of the strut width are left out of an outline.
MIN_EDGE = 1e-5
# Arcs that turn by less are left out too, rad.
MIN_TURN = 2.0 * MIN_EDGE


@dataclass(frozen=True, slots=True, eq=False)
class Border:
    """The boundary of all points within reach of struts, as edges in the order of its loops.

    The material is to the left. The edge e runs from ``foot[e, 0] + r * normal[e, 0]`` to
    ``foot[e, 1] + r * normal[e, 1]``, where r is ``reach + extra[e]``.

    Parameters
    ----------
    foot : (E, 2, 2) float64, mm
        Points of the centre lines nearest to start and end of each edge.
    normal : (E, 2, 2) float64
        Outward unit normals at start and end of each edge.
    extra : (E,) float64, mm
        Reach of each edge beyond that of the narrowest struts.
    turn : (E,) float64
        Angle by which each edge turns: 0 along a strut, positive around a node.
    sizes : tuple of int
        Number of edges of each loop; the edges of a loop are consecutive.
    gap : float, mm
        Largest distance between the end of an edge and the start of the next.
    """

    foot: Reals
    normal: Reals
    extra: Reals
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
        Half the width of the narrowest struts plus the fillet radius.
    width : float, mm
        Width of the narrowest struts; the shortest lines are `MIN_EDGE` times as long.
    """
    sides = _sides(struts, reach, MIN_EDGE * width)
    rounds = _rounds(struts, reach, MIN_TURN)
    foot, normal, extra, turn = (np.concatenate(both) for both in zip(sides, rounds, strict=True))
    starts, ends = (foot + (reach + extra)[:, None, None] * normal).transpose(1, 0, 2)
    following, gap = _followers(starts, ends)
    order, sizes = _cycles(following)
    return Border(foot[order], normal[order], extra[order], turn[order], sizes, gap)


def _sides(struts: Struts, reach: float, least: float) -> tuple[Reals, Reals, Reals, Reals]:
    """Return foot, normal, extra and turn of all lines of the boundary."""
    count, own = len(struts.beams), reach + struts.extra
    start, end = struts.positions[struts.beams[:, 0]], struts.positions[struts.beams[:, 1]]
    length = np.linalg.norm(end - start, axis=1)
    along = (end - start) / length[:, None]
    near, other = struts.tree.query(struts.tree.geometries, "dwithin", own + own.max())
    near, other = near[near != other], other[near != other]
    foot, normal, extra = [], [], []
    # The right-hand side of a strut, and of the reversed strut.
    for ends, begin, axis in (
        (struts.beams, start, along),
        (struts.beams[:, ::-1], end, -along),
    ):
        right = np.column_stack([axis[:, 1], -axis[:, 0]])
        low, high = _covered_lines(
            begin + own[:, None] * right, axis, length, ends, near, other, struts, own
        )
        line, low, high = _uncovered(near, low, high, np.zeros(count), length)
        long_enough = high - low > least
        line, span = line[long_enough], np.column_stack([low, high])[long_enough]
        foot.append(begin[line, None] + span[:, :, None] * axis[line, None])
        normal.append(np.repeat(right[line, None], 2, axis=1))
        extra.append(struts.extra[line])
    feet = np.concatenate(foot)
    return feet, np.concatenate(normal), np.concatenate(extra), np.zeros(len(feet))


def _covered_lines(
    origin: Reals,
    axis: Reals,
    length: Reals,
    ends: Ids,
    near: Ids,
    other: Ids,
    struts: Struts,
    reach: Reals,
) -> tuple[Reals, Reals]:
    """Return the interval of the line along strut `near` that strut `other` covers."""
    wide = reach[other]
    tail = struts.positions[struts.beams[other, 0]]
    head = struts.positions[struts.beams[other, 1]]
    span = length[other]
    forward = (head - tail) / span[:, None]
    ahead = axis[near]
    offset = origin[near] - tail
    across, slope = _cross(forward, offset), _cross(forward, ahead)
    low, high = _between(across, slope, -wide, wide)
    bottom, top = _between(_dot(forward, offset), _dot(forward, ahead), 0.0, span)
    low, high = np.maximum(low, bottom), np.minimum(high, top)
    empty = low >= high
    low[empty], high[empty] = np.inf, -np.inf
    for column, centre in enumerate((tail, head)):
        towards = centre - origin[near]
        off = np.abs(_cross(ahead, towards))
        square = (wide - off) * (wide + off)
        node = struts.beams[other, column]
        # A circle of the same radius around a node of the strut itself is tangent to the line.
        own = (node == ends[near, 0]) | (node == ends[near, 1])
        covers = (~own | (wide > reach[near])) & (square > 0.0)
        half, middle = np.sqrt(np.where(covers, square, 0.0)), _dot(ahead, towards)
        low = np.where(covers, np.minimum(low, middle - half), low)
        high = np.where(covers, np.maximum(high, middle + half), high)
    return low, high


def _rounds(struts: Struts, reach: float, least: float) -> tuple[Reals, Reals, Reals, Reals]:
    """Return foot, normal, extra and turn of all arcs of the boundary."""
    import shapely

    count, extra = len(struts.positions), struts.extra_of_nodes
    radii, widths = reach + extra, reach + struts.extra
    points = shapely.points(struts.positions)
    node, strut = struts.tree.query(points, "dwithin", radii + widths.max())
    first, second = (struts.positions[struts.beams[strut, end]] for end in (0, 1))
    centre = struts.positions[node]
    begins, stops = struts.beams[strut, 0] == node, struts.beams[strut, 1] == node
    # One of the widest struts that end at the node covers exactly the half circle on its side.
    half = (begins | stops) & (struts.extra[strut] == extra[node])
    away = np.where(begins[:, None], second - first, first - second)[half]
    middle = np.arctan2(away[:, 1], away[:, 0])
    low, high = _covered_circles(
        centre[~half], radii[node[~half]], first[~half], second[~half], widths[strut[~half]]
    )
    # Angles are measured from one of these struts, so that no arc contains the angle 0.
    zero = np.zeros(count)
    zero[node[half]] = middle
    arcs = np.concatenate([node[half], np.repeat(node[~half], low.shape[1])])
    low = np.concatenate([middle - 0.5 * np.pi, low.ravel()]) - zero[arcs]
    high = np.concatenate([middle + 0.5 * np.pi, high.ravel()]) - zero[arcs]
    shift = 2.0 * np.pi * (np.array([[-1.0], [0.0], [1.0]]) - np.floor(low / (2.0 * np.pi)))
    arc, low, high = _uncovered(
        np.tile(arcs, 3),
        (low + shift).ravel(),
        (high + shift).ravel(),
        np.full(count, 0.5 * np.pi),
        np.full(count, 1.5 * np.pi),
    )
    long_enough = high - low > least
    arc, angle = arc[long_enough], np.column_stack([low, high])[long_enough]
    turn = angle[:, 1] - angle[:, 0]
    angle += zero[arc, None]
    foot = np.repeat(struts.positions[arc, None], 2, axis=1)
    return foot, np.stack([np.cos(angle), np.sin(angle)], axis=2), extra[arc], turn


def _covered_circles(
    centre: Reals, radius: Reals, first: Reals, second: Reals, wide: Reals
) -> tuple[Reals, Reals]:
    """Return the angles of circles that are within reach of struts, one strut for each circle.

    Parameters
    ----------
    centre, radius : (n, 2), (n,) float64
        The circles.
    first, second, wide : (n, 2), (n, 2), (n,) float64
        Ends and reach of the struts.

    Returns
    -------
    low, high : (n, 8) float64
        Limits of intervals, both 0 if the interval is not covered.
    """
    axis = second - first
    length = np.linalg.norm(axis, axis=1)
    axis /= length[:, None]
    along, across = _dot(axis, centre - first), _cross(axis, centre - first)
    with np.errstate(invalid="ignore", divide="ignore"):
        sides = [np.arcsin((side * wide - across) / radius) for side in (1.0, -1.0)]
        crossings = [*sides, *(np.pi - side for side in sides)]
        for end in (along, along - length):
            distance = np.hypot(end, across)
            towards = np.arctan2(-across, -end)
            half = np.arccos((radius**2 + distance**2 - wide**2) / (2.0 * radius * distance))
            crossings += [towards - half, towards + half]
    angle = np.sort(np.mod(np.nan_to_num(np.stack(crossings, axis=1)), 2.0 * np.pi), axis=1)
    following = np.column_stack([angle[:, 1:], angle[:, :1] + 2.0 * np.pi])
    middle = 0.5 * (angle + following)
    beyond = along[:, None] + radius[:, None] * np.cos(middle)
    beyond -= np.clip(beyond, 0.0, length[:, None])
    within = np.hypot(beyond, across[:, None] + radius[:, None] * np.sin(middle)) < wide[:, None]
    turned = np.arctan2(axis[:, 1], axis[:, 0])[:, None]
    return np.where(within, angle + turned, 0.0), np.where(within, following + turned, 0.0)


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
