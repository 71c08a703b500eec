"""Largest strut width and fillet radius at which the topology of the outline is kept.

No hole closes or splits, and no struts without a common node join.

Consider the distance of a point to the nearest centre line, for a wider strut less its `extra`.
When the width of all struts increases by the same length, the topology of the outline changes only
at half-widths of the narrowest struts equal to the values of this distance at its maxima and saddle
points. At a maximum a hole closes. At a saddle point, midway between a node and
the node or strut opposite to it and with no strut nearer, two surfaces meet: a hole splits, or a
new one is enclosed. Below these widths fillets of different corners do not touch either, since
touching fillets would enclose a new hole.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.part.outline.fillets import filled
from bellcrank.part.outline.struts import read_struts

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from bellcrank.part.outline.curves import Outline
    from bellcrank.part.outline.struts import Struts

# Half-width, relative to the size of the part, so small that all holes are open. Struts whose
# surfaces meet below it count as touching.
_HAIR = 1e-5

# Relative margin to the critical radius, at which holes would be too small to draw.
_MARGIN = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class Limits:
    """Half-widths of the narrowest struts at which holes close or surfaces meet.

    Parameters
    ----------
    depths : (H,) float64, mm
        Radius of the largest circle in each hole.
    bottlenecks : (B,) float64, mm
        Half-widths at which surfaces of struts without a common node meet, ascending; not all of
        them, see `find_limits`.
    points : (B, 2) float64, mm
        Points at which they meet.
    """

    depths: NDArray[np.float64]
    bottlenecks: NDArray[np.float64]
    points: NDArray[np.float64]

    @property
    def least(self) -> float:
        """Smallest half-width at which the topology changes, mm; inf if there is none."""
        return float(min(self.depths.min(initial=np.inf), self.bottlenecks.min(initial=np.inf)))


def room_for_fillet(positions: ArrayLike, beams: ArrayLike, width: ArrayLike) -> float:
    """Return the largest fillet radius at which no hole closes, splits or is added.

    Parameters
    ----------
    positions : (N, 2) array_like, mm
        Nodes.
    beams : (M, 2) array_like of int
        The two nodes of each strut.
    width : float or (M,) array_like, mm
        Width of the struts.

    Returns
    -------
    float, mm
        Never too large; too small by at most 0.1 % of half the width plus this radius; inf if
        there is no limit.

    Raises
    ------
    InvalidSettings
        As for `strut_outline`.

    Examples
    --------
    The inscribed circle of an equilateral triangle with sides of 12 mm has a radius of 3.46 mm.
    Half a strut covers 1 mm of it.

    >>> triangle = [[0.0, 0.0], [12.0, 0.0], [6.0, 108.0**0.5]], [[0, 1], [1, 2], [2, 0]]
    >>> round(room_for_fillet(*triangle, width=2.0), 2)
    2.46
    """
    narrowest = check_sizes(width, 0.0)
    struts = read_struts(positions, beams, width)
    limits = find_limits(struts)
    check_room(limits, narrowest, 0.0)
    return _allowed(limits.least) - 0.5 * narrowest


def check_sizes(width: ArrayLike, fillet: float) -> float:
    """Check that widths are above 0 and a fillet radius is not negative; return the least width."""
    widths = np.asarray(width, dtype=np.float64)
    for each in widths.ravel().tolist():
        if not 0.0 < each < math.inf:
            raise InvalidSettings(f"width: expected a length above 0 mm, got {each!r}")
    if not 0.0 <= fillet < math.inf:
        raise InvalidSettings(f"fillet: expected a radius of 0 mm or more, got {fillet!r}")
    return float(widths.min(initial=math.inf))


def check_room(limits: Limits, width: float, fillet: float) -> None:
    """Check that width and fillet radius stay below `limits`: no hole closes, splits or is added.

    Parameters
    ----------
    limits
        Half-widths at which the topology changes.
    width, fillet : float, mm
        Width of the narrowest struts and radius of the fillets.

    Raises
    ------
    InvalidSettings
        If the width or radius is too large; the message gives the largest possible one.
    """
    half, most = 0.5 * width, _allowed(limits.least)
    if half >= most:
        if most <= 0.0:
            raise InvalidSettings(
                f"width: struts of these widths would {_change(limits, half)}; choose narrower ones"
            )
        raise InvalidSettings(
            f"width: struts {width:g} mm wide would {_change(limits, half)}; "
            f"choose at most {_floored(2.0 * most)} mm"
        )
    # The result of `room_for_fillet` is accepted despite rounding errors.
    if fillet > 0.0 and half + fillet > (1.0 + 1e-12) * most:
        raise InvalidSettings(
            f"fillet: a radius of {fillet:g} mm would {_change(limits, half + fillet)}; "
            f"at most {_floored(most - half)} mm leaves room"
        )


def find_limits(struts: Struts, reach: float = math.inf) -> Limits:
    """Return the half-widths at which holes close and surfaces meet.

    All holes are listed; of the surfaces, at least those that meet first, if this is before the
    smallest hole closes and before `reach`.

    Parameters
    ----------
    struts
        Struts.
    reach : float, mm
        Largest half-width considered.
    """
    import shapely

    depths = _depths(struts)
    most = min(1.001 * reach, float(depths.min(initial=struts.extent)))
    # The distance is increased step by step: there are many pairs of distant nodes, and they are
    # seldom those that meet first.
    limit = min(most, float(shapely.length(struts.tree.geometries).mean()))
    values, points = _bottlenecks(struts, limit)
    while not len(values) and limit < most:
        limit = min(2.0 * limit, most)
        values, points = _bottlenecks(struts, limit)
    return Limits(depths, values, points)


def find_joins(struts: Struts, half: float, reach: float) -> Limits:
    """Return all half-widths from `half` to `reach` at which surfaces meet, and their points.

    `depths` is empty: holes are not considered.
    """
    values, points = _bottlenecks(struts, 1.001 * reach)
    later = values > half
    return Limits(np.empty(0), values[later], points[later])


def _hairlines(struts: Struts) -> tuple[float, Outline]:
    """Return half the width of very narrow struts, and their outline.

    Where rounding hides the order of the edges at one width, it does not at another.
    """
    hairs = [factor * _HAIR * struts.extent for factor in (1.0, 1.3, 1.7)]
    for hair in hairs[:-1]:
        try:
            return hair, filled(struts, 2.0 * hair, 0.0)
        except InvalidSettings:
            continue
    return hairs[-1], filled(struts, 2.0 * hairs[-1], 0.0)


def _depths(struts: Struts) -> NDArray[np.float64]:
    """Return the radius of the largest circle in each hole between very narrow struts."""
    import shapely

    hair, outline = _hairlines(struts)
    if struts.extra.any():
        same = filled(replace(struts, extra=np.zeros(len(struts.beams))), 2.0 * hair, 0.0)
        if (same.piece_count, same.hole_count) != (outline.piece_count, outline.hole_count):
            raise InvalidSettings(
                "width: struts of these widths close holes or join, however narrow the narrowest "
                "is; choose widths that differ less"
            )
    polygons = np.array(
        [shapely.Polygon(loop.flattened(0.1 * hair)) for loop in outline.holes], object
    )
    if not len(polygons):
        return np.empty(0)
    if outline.piece_count > 1:
        # A piece inside a hole of another covers a part of it.
        pieces = np.array([shapely.Polygon(loop.flattened(0.1 * hair)) for loop in outline.outer])
        around, within = shapely.STRtree(pieces).query(polygons, "contains")
        for index in np.unique(around):
            inside = shapely.union_all(pieces[within[around == index]])
            polygons[index] = shapely.difference(polygons[index], inside)
    # Area divided by length is a lower bound of the radius in a convex hole.
    fine = 2e-4 * shapely.area(polygons) / shapely.length(polygons)
    circles = shapely.maximum_inscribed_circle(polygons, fine)
    return _distances(
        struts, shapely.get_coordinates(shapely.get_point(circles, 0)) - struts.origin
    )


def _distances(struts: Struts, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance of (n, 2) points from the nearest centre line, less its `extra`."""
    import shapely

    places = shapely.points(points)
    which, nearest = struts.tree.query_nearest(places, all_matches=False, return_distance=True)
    widest = float(struts.extra.max())
    distances: NDArray[np.float64] = nearest - struts.extra[which[1]]
    if widest > 0.0:
        point, strut = struts.tree.query(places, "dwithin", nearest + widest)
        away = shapely.distance(places[point], struts.tree.geometries[strut])
        np.minimum.at(distances, point, away - struts.extra[strut])
    return distances


def _bottlenecks(struts: Struts, limit: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the half-widths up to `limit` at which surfaces meet, ascending, and the points."""
    import shapely
    from scipy.spatial import cKDTree

    nodes, extra = struts.positions, struts.extra_of_nodes
    points, furthest = shapely.points(nodes), 2.0 * (limit + float(extra.max()))
    node, strut = struts.tree.query(points, "dwithin", furthest)
    tail, head = nodes[struts.beams[strut, 0]], nodes[struts.beams[strut, 1]]
    axis = head - tail
    share = np.sum((nodes[node] - tail) * axis, axis=1) / np.sum(axis * axis, axis=1)
    facing = (share > 0.0) & (share < 1.0) & ~np.any(struts.beams[strut] == node[:, None], axis=1)
    across = (tail + share[:, None] * axis)[facing]
    pairs = cKDTree(nodes).query_pairs(furthest, output_type="ndarray")
    one = np.concatenate([nodes[node[facing]], nodes[pairs[:, 0]]])
    two = np.concatenate([across, nodes[pairs[:, 1]]])
    near = np.concatenate([extra[node[facing]], extra[pairs[:, 0]]])
    far = np.concatenate([struts.extra[strut[facing]], extra[pairs[:, 1]]])
    gap = np.linalg.norm(two - one, axis=1)
    half = 0.5 * (gap - near - far)
    # Points nearer than this are the same point, except for rounding errors. Of struts that share
    # a node, one may lie within the round end of the other.
    apart = (gap > 2.0 * _HAIR * struts.extent) & (half <= limit) & (half + near > 0.0)
    one, two, gap, near, half = (each[apart] for each in (one, two, gap, near, half))
    middle = one + ((near + half) / gap)[:, None] * (two - one)
    found = np.flatnonzero(_distances(struts, middle) > half - 1e-9 * gap)
    found = found[np.argsort(half[found], kind="stable")]
    return half[found], middle[found] + struts.origin


def _allowed(critical: float) -> float:
    """Return the largest half-width allowed for a critical one."""
    return (1.0 - _MARGIN) * critical


def _change(limits: Limits, reach: float) -> str:
    """Return the change of topology at a half-width, as text."""
    closed = int(np.count_nonzero(reach > _allowed(1.0) * limits.depths))
    if closed:
        return f"close {closed} of {len(limits.depths)} holes"
    x, y = limits.points[0]
    return f"join struts without a common node, first at ({x:.4g}, {y:.4g}) mm"


def _floored(length: float) -> str:
    """Return a length with three digits, rounded down."""
    step = 10.0 ** (math.floor(math.log10(length)) - 2)
    return f"{math.floor(length / step) * step:.3g}"
