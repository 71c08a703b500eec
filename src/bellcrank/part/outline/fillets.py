"""From what lies within reach of struts back to their surface, with re-entrant corners filled."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.part.outline.boundary import LEAST_EDGE, border
from bellcrank.part.outline.curves import Loop, Outline

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.part.outline.boundary import Border
    from bellcrank.part.outline.struts import Struts

# Edges that should meet may miss each other by this part of the reach, where very short
# edges between them were left out.
_GREATEST_GAP = 1e-3


def filled(struts: Struts, width: float, fillet: float) -> Outline:
    """Return the outline of struts whose corners are filled, whatever becomes of the holes.

    A point is outside the part if a disc of radius `fillet` that touches no strut covers it.
    The centres of such discs are all points beyond ``width / 2 + fillet`` of the centre lines,
    and where they are bounded by a corner, the part is bounded by an arc about that corner.

    Raises
    ------
    InvalidSettings
        If rounding errors hide how the edges of the outline follow each other.
    """
    reach = 0.5 * width + fillet
    edges = border(struts, reach, width)
    if not edges.gap < _GREATEST_GAP * reach:
        raise InvalidSettings(
            f"width: at {width:g} mm with fillets of {fillet:g} mm the outline does not close, "
            "where surfaces of struts all but touch; choose a slightly different width"
        )
    points, bulge, loop = _surface(edges, 0.5 * width, reach, LEAST_EDGE * width)
    points, bulge, loop = _without_flat_corners(points, bulge, loop, 1e-3 * LEAST_EDGE * width)
    limits = np.searchsorted(loop, np.arange(len(edges.sizes) + 1)).tolist()
    outer, holes = [], []
    for begin, end in pairwise(limits):
        # What is left of a hole at the very moment when it closes.
        if end - begin < 2:
            continue
        curve = Loop(points[begin:end] + struts.origin, bulge[begin:end])
        if curve.area > 0.0:
            outer.append(curve)
        elif curve.area < 0.0:
            holes.append(curve)
    return Outline(tuple(outer), tuple(holes))


def _surface(
    edges: Border, half: float, reach: float, least: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Return corners, bulges and loop numbers of the surface, with an arc for each corner."""
    surface = edges.foot + half * edges.normal
    count = len(surface)
    sizes = np.array(edges.sizes)
    loop = np.repeat(np.arange(len(sizes)), sizes)
    onward = _onward(sizes)
    before = np.empty(count, dtype=np.int64)
    before[onward] = np.arange(count)
    leaving, entering = edges.normal[:, 1], edges.normal[onward, 0]
    cross = leaving[:, 0] * entering[:, 1] - leaving[:, 1] * entering[:, 0]
    fillet = np.arctan2(-cross, np.sum(leaving * entering, axis=1))
    gap = np.linalg.norm(surface[onward, 0] - surface[:, 1], axis=1)
    filled_corner = (gap > least) & (fillet > 0.0) & (reach > half)
    # Without a fillet between them, two edges share one corner.
    joint = np.where(
        filled_corner[:, None], surface[:, 1], 0.5 * (surface[:, 1] + surface[onward, 0])
    )
    start = np.where(filled_corner[before, None], surface[:, 0], joint[before])
    points = np.stack([start, joint], axis=1).reshape(-1, 2)
    bulge = np.column_stack([np.tan(0.25 * edges.turn), -np.tan(0.25 * fillet)]).ravel()
    kept = np.column_stack([np.ones(count, dtype=np.bool_), filled_corner]).ravel()
    return points[kept], bulge[kept], np.repeat(loop, 2)[kept]


def _without_flat_corners(
    points: NDArray[np.float64],
    bulge: NDArray[np.float64],
    loop: NDArray[np.int64],
    least: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Make one line of consecutive lines in the same direction."""
    _, sizes = np.unique(loop, return_counts=True)
    onward = _onward(sizes)
    before = np.empty_like(onward)
    before[onward] = np.arange(len(onward))
    arriving, leaving = points - points[before], points[onward] - points
    cross = np.abs(arriving[:, 0] * leaving[:, 1] - arriving[:, 1] * leaving[:, 0])
    chord = np.linalg.norm(arriving + leaving, axis=1)
    flat = (bulge[before] == 0.0) & (bulge == 0.0) & (cross <= least * chord)
    return points[~flat], bulge[~flat], loop[~flat]


def _onward(sizes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the number of the next element of each, round loops of the given sizes."""
    onward = np.arange(1, int(sizes.sum()) + 1)
    ends = np.cumsum(sizes)
    onward[ends - 1] = ends - sizes
    return onward
