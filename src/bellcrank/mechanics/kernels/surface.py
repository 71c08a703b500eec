"""Vectors from points to closed surfaces of triangles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.mechanics.kernels._compile import entry, kernel
from bellcrank.mechanics.kernels.contact import limited

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.mechanics.kernels.arrays import Floats

TINY = 1e-300
"""Lower bound of denominators."""


@kernel
def nearest_shares(corners: Floats, k: int, points: Floats, i: int) -> tuple[float, float]:
    """Return the shares s and t of the point a + s (b - a) + t (c - a) of a triangle abc.

    It is the nearest one to a point: the foot of its perpendicular, or a point of an edge.
    """
    bb = bc = cc = pb = pc = 0.0
    for axis in range(3):
        b = corners[k, 1, axis] - corners[k, 0, axis]
        c = corners[k, 2, axis] - corners[k, 0, axis]
        p = points[i, axis] - corners[k, 0, axis]
        bb, bc, cc = bb + b * b, bc + b * c, cc + c * c
        pb, pc = pb + p * b, pc + p * c
    size = bb * cc - bc * bc
    if size > 0.0:
        s, t = (cc * pb - bc * pc) / size, (bb * pc - bc * pb) / size
        if s >= 0.0 and t >= 0.0 and s + t <= 1.0:
            return s, t
    along = limited((pc - pb - bc + bb) / max(bb - 2.0 * bc + cc, TINY))
    edges = (
        (limited(pb / max(bb, TINY)), 0.0),
        (0.0, limited(pc / max(cc, TINY))),
        (1.0 - along, along),
    )
    best, least = edges[0], 0.0
    for number in range(3):
        s, t = edges[number]
        square = s * s * bb + 2.0 * s * t * bc + t * t * cc - 2.0 * (s * pb + t * pc)
        if number == 0 or square < least:
            best, least = edges[number], square
    return best


@kernel
def is_above(corners: Floats, k: int, points: Floats, i: int) -> bool:
    """Whether a vertical ray upward from a point meets a triangle."""
    x, y = points[i, 0] - corners[k, 0, 0], points[i, 1] - corners[k, 0, 1]
    bx, by = corners[k, 1, 0] - corners[k, 0, 0], corners[k, 1, 1] - corners[k, 0, 1]
    cx, cy = corners[k, 2, 0] - corners[k, 0, 0], corners[k, 2, 1] - corners[k, 0, 1]
    size = bx * cy - cx * by
    if size == 0.0:
        return False
    s, t = (x * cy - y * cx) / size, (y * bx - x * by) / size
    if s < 0.0 or t < 0.0 or s + t > 1.0:
        return False
    height = s * (corners[k, 1, 2] - corners[k, 0, 2]) + t * (corners[k, 2, 2] - corners[k, 0, 2])
    return corners[k, 0, 2] + height > points[i, 2]


@entry
def find_nearest(
    points: Floats, corners: Floats, balls: Floats, turned: Floats, turned_corners: Floats,
    across: Floats, inside: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Fill the vectors from the nearest points of a surface to points.

    Parameters
    ----------
    points : (n, 3)
    corners : (k, 3, 3)
        Corners of the triangles of closed surfaces.
    balls : (k, 4)
        Centre and radius of a ball around each triangle.
    turned, turned_corners : (n, 3) and (k, 3, 3)
        The same after a small turn, so that no ray meets an edge of a regular surface.
    across : (n, 3)
        Filled with the vectors.
    inside : (n,)
        Filled with whether a ray from the point meets the surface an odd number of times.
    """
    for i in range(len(points)):
        nearest = 1e300
        inside[i] = False
        for k in range(len(corners)):
            if is_above(turned_corners, k, turned, i):
                inside[i] = not inside[i]
            reach = nearest + balls[k, 3]
            square = 0.0
            for axis in range(3):
                square += (points[i, axis] - balls[k, axis]) ** 2
            if square >= reach * reach:
                continue
            s, t = nearest_shares(corners, k, points, i)
            square = 0.0
            for axis in range(3):
                a = corners[k, 0, axis]
                foot = a + s * (corners[k, 1, axis] - a) + t * (corners[k, 2, axis] - a)
                square += (points[i, axis] - foot) ** 2
            distance = math.sqrt(square)
            if distance < nearest:
                nearest = distance
                for axis in range(3):
                    a = corners[k, 0, axis]
                    foot = a + s * (corners[k, 1, axis] - a) + t * (corners[k, 2, axis] - a)
                    across[i, axis] = points[i, axis] - foot
