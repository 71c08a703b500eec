"""The surface of struts with filled re-entrant corners, from the boundary within reach of them."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.part.outline.boundary import MIN_EDGE, MIN_TURN, border
from bellcrank.part.outline.curves import Loop, Outline

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.part.outline.boundary import Border
    from bellcrank.part.outline.struts import Struts

# Largest gap between consecutive edges, relative to the reach; arcs that were left out between wide
# struts are added to it.
_MAX_GAP = 1e-3


def filled(struts: Struts, width: float, fillet: float) -> Outline:
    """Return the outline of struts with fillets, without checking whether holes close.

    A point is outside the part if it is inside a disc of radius `fillet` that touches no strut. The
    centres of such discs are the points farther from the centre lines than half the width of the
    struts plus `fillet`. Each corner of their boundary gives an arc of the outline around it.

    Parameters
    ----------
    struts
        The struts.
    width : float, mm
        Width of the narrowest of them.
    fillet : float, mm
        Fillet radius.

    Raises
    ------
    InvalidSettings
        If the order of the edges cannot be determined because of rounding errors.
    """
    reach = 0.5 * width + fillet
    edges = border(struts, reach, width)
    left_out = MIN_TURN * (reach + float(struts.extra.max()))
    if not edges.gap < _MAX_GAP * reach + left_out:
        raise InvalidSettings(
            f"width: at {width:g} mm with fillets of {fillet:g} mm the outline does not close, "
            "since surfaces of struts almost touch; choose a slightly different width"
        )
    points, bulge, loop = _surface(edges, 0.5 * width, fillet, MIN_EDGE * width)
    points, bulge, loop = _without_flat_corners(points, bulge, loop, 1e-3 * MIN_EDGE * width)
    limits = np.searchsorted(loop, np.arange(len(edges.sizes) + 1)).tolist()
    outer, holes = [], []
    for begin, end in pairwise(limits):
        # A hole that has just closed.
        if end - begin < 2:
            continue
        curve = Loop(points[begin:end] + struts.origin, bulge[begin:end])
        if curve.area > 0.0:
            outer.append(curve)
        elif curve.area < 0.0:
            holes.append(curve)
    return Outline(tuple(outer), tuple(holes))


def _surface(
    edges: Border, half: float, radius: float, least: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Return corners, bulges and loop numbers of the surface, with one arc for each fillet."""
    surface = edges.foot + (half + edges.extra)[:, None, None] * edges.normal
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
    filled_corner = (gap > least) & (fillet > 0.0) & (radius > 0.0)
    # Edges without a fillet between them share one corner.
    joint = np.where(
        filled_corner[:, None], surface[:, 1], 0.5 * (surface[:, 1] + surface[onward, 0])
    )
    start = np.where(filled_corner[before, None], surface[:, 0], joint[before])
    points = np.stack([start, joint], axis=1).reshape(-1, 2)
    bulge = np.column_stack([np.tan(0.25 * edges.turn), -np.tan(0.25 * fillet)]).ravel()
    used = np.column_stack([np.ones(count, dtype=np.bool_), filled_corner]).ravel()
    return points[used], bulge[used], np.repeat(loop, 2)[used]


def _without_flat_corners(
    points: NDArray[np.float64],
    bulge: NDArray[np.float64],
    loop: NDArray[np.int64],
    least: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Merge consecutive lines of the same direction."""
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
    """Return the index of the next element of each, in loops of the given sizes."""
    onward = np.arange(1, int(sizes.sum()) + 1)
    ends = np.cumsum(sizes)
    onward[ends - 1] = ends - sizes
    return onward
