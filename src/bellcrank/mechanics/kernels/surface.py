"""Vectors from points to closed surfaces of triangles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.mechanics.kernels._compile import entry, kernel
from bellcrank.mechanics.kernels.contact import limited

if TYPE_CHECKING:
    from bellcrank.mechanics.kernels.arrays import Floats, Ints

    Vector = tuple[float, float, float]

ROUNDING = 1e-9
"""Part of the size of a triangle by which a foot may lie outside of it."""
TINY = 1e-300
"""Lower bound of denominators."""


@kernel
def nearest_shares(corners: Floats, k: int, points: Floats, i: int) -> tuple[float, float, bool]:
    """Return the shares s and t of the point a + s (b - a) + t (c - a) of a triangle abc.

    It is the nearest one to a point: the foot of its perpendicular, or else a point of an edge; the
    last value is whether it is the foot.
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
        if s >= -ROUNDING and t >= -ROUNDING and s + t <= 1.0 + ROUNDING:
            return s, t, True
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
    return best[0], best[1], False


@kernel
def insert(
    across: Floats, distance: Floats, face: Ints, i: int, vector: Vector, away: float, k: int
) -> None:
    """Insert a face into the nearest ones of a point, in ascending order of the distance.

    A point on the edge of two triangles of a plane is inserted once.
    """
    most = len(distance[i])
    index = most
    for number in range(most):
        if face[i, number] < 0 or away < distance[i, number]:
            index = number
            break
        same = True
        for axis in range(3):
            same &= abs(across[i, number, axis] - vector[axis]) <= ROUNDING * (1.0 + away)
        if same:
            return
    if index == most:
        return
    for number in range(most - 1, index, -1):
        distance[i, number], face[i, number] = distance[i, number - 1], face[i, number - 1]
        for axis in range(3):
            across[i, number, axis] = across[i, number - 1, axis]
    distance[i, index], face[i, index] = away, k
    for axis in range(3):
        across[i, index, axis] = vector[axis]


@entry
def find_nearest(
    points: Floats, corners: Floats, balls: Floats, reach: float, across: Floats, distance: Floats,
    face: Ints,
) -> None:  # fmt: skip
    """Fill the vectors from the nearest points of triangles to points.

    Parameters
    ----------
    points : (n, 3)
    corners : (k, 3, 3)
        Corners of the triangles of closed surfaces.
    balls : (k, 4)
        Centre and radius of a ball around each triangle.
    reach
        Distance up to which all triangles count on which a perpendicular from the point ends.
        The nearest triangle counts anyway.
    across, distance, face : (n, m, 3), (n, m) and (n, m)
        Filled with the vectors, their lengths and the numbers of the triangles, in ascending order
        of the length; -1 is the number of none.
    """
    for i in range(len(points)):
        nearest, least = -1, 1e300
        first = (0.0, 0.0, 0.0)
        for number in range(len(distance[i])):
            face[i, number] = -1
        for k in range(len(corners)):
            farthest = max(least, reach) + balls[k, 3]
            square = 0.0
            for axis in range(3):
                square += (points[i, axis] - balls[k, axis]) ** 2
            if square >= farthest * farthest:
                continue
            s, t, is_foot = nearest_shares(corners, k, points, i)
            vector = (
                points[i, 0] - corners[k, 0, 0] * (1.0 - s - t) - corners[k, 1, 0] * s
                - corners[k, 2, 0] * t,
                points[i, 1] - corners[k, 0, 1] * (1.0 - s - t) - corners[k, 1, 1] * s
                - corners[k, 2, 1] * t,
                points[i, 2] - corners[k, 0, 2] * (1.0 - s - t) - corners[k, 1, 2] * s
                - corners[k, 2, 2] * t,
            )  # fmt: skip
            away = math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
            if is_foot and away < reach:
                insert(across, distance, face, i, vector, away, k)
            if away < least:
                nearest, least, first = k, away, vector
        insert(across, distance, face, i, first, least, nearest)
