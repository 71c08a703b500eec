"""Gaps between struts, and their derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bellcrank.mechanics import bent_pieces, near_pairs

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem


PARALLEL = 1e-12
"""Square of the sine of the angle between struts below which they are parallel."""


class Gaps(NamedTuple):
    """Gaps between pairs of struts that are near each other."""

    pairs: NDArray[np.int64]
    """(g, 2) the pieces of struts that are near each other."""
    value: NDArray[np.float64]
    """(g,) gaps, lattice units."""
    fields: NDArray[np.float64]
    """(g, N, b) derivatives by displacements and rotations of the nodes."""
    widths: NDArray[np.float64]
    """(g, M) derivatives by the widths of the beams."""


def gaps_of(
    problem: Problem, beams: NDArray[np.int64], u: NDArray[np.float64], reach: float
) -> Gaps:
    """Return the gaps between struts without a common node that are below a reach.

    Struts are bent as in `bellcrank.mechanics.bent_pieces`: two straight pieces each in the plane.

    Parameters
    ----------
    beams : (n,) int64
        The struts.
    u : (N, 3) float64
        Displacements and rotations of the nodes in the plane, displacements in space.
    reach
        Largest gap that is returned, lattice units.
    """
    count, width = len(beams), problem.beam_widths[beams]
    points, pieces = bent_pieces(problem, beams, u)
    pairs, distance = near_pairs(points, pieces, float(width.max()) + reach)
    strut = pairs % count
    gap = distance - 0.5 * width[strut].sum(axis=1)
    # Struts that meet in a node overlap there; angles between them are constraints of their own.
    ends = problem.lattice.beams[beams[strut]]
    apart_at_rest = ~(ends[:, 0, :, None] == ends[:, 1, None, :]).any(axis=(1, 2))
    chosen = np.flatnonzero((gap < reach) & apart_at_rest)
    chosen = chosen[np.lexsort((pairs[chosen, 1], pairs[chosen, 0]))]
    nodes, dimension = problem.lattice.positions.shape
    fields = np.zeros((len(chosen), nodes, 3 * (dimension - 1)))
    widths = np.zeros((len(chosen), problem.lattice.beam_count))
    for row, index in enumerate(chosen.tolist()):
        widths[row, beams[strut[index]]] = -0.5
        (a, b), (c, d) = (points[pieces[piece]] for piece in pairs[index])
        s, t = nearest_points(a, b, c, d)
        apart = a + s * (b - a) - c - t * (d - c)
        size = float(np.linalg.norm(apart))
        if size == 0.0:
            continue
        normal = apart / size
        for piece, share, sign in ((pairs[index, 0], s, 1.0), (pairs[index, 1], t, -1.0)):
            for point, weight in zip(pieces[piece].tolist(), (1.0 - share, share), strict=True):
                vector = sign * weight * normal
                if point < nodes:
                    fields[row, point, :dimension] += vector
                else:
                    _add_middle(problem, u, int(beams[point - nodes]), vector, fields[row])
    return Gaps(pairs[chosen], gap[chosen], fields, widths)


def _add_middle(
    problem: Problem,
    u: NDArray[np.float64],
    beam: int,
    vector: NDArray[np.float64],
    field: NDArray[np.float64],
) -> None:
    """Add the derivatives of the motion of the middle of a bent strut along a vector."""
    first, second = problem.lattice.beams[beam].tolist()
    positions = problem.lattice.positions
    chord = positions[second] + u[second, :2] - positions[first] - u[first, :2]
    bend = (u[first, 2] - u[second, 2] + np.pi) % (2.0 * np.pi) - np.pi
    # The middle is that of the chord, and the chord turned by 90 degrees times bend / 8.
    turned = bend / 8.0 * np.array([vector[1], -vector[0]])
    field[first, :2] += 0.5 * vector - turned
    field[second, :2] += 0.5 * vector + turned
    slope = float(-chord[1] * vector[0] + chord[0] * vector[1]) / 8.0
    field[first, 2] += slope
    field[second, 2] -= slope


def nearest_points(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    c: NDArray[np.float64],
    d: NDArray[np.float64],
) -> tuple[float, float]:
    """Return where the segments a b and c d are nearest to each other, as parts of their lengths.

    Examples
    --------
    >>> origin, x, y = np.zeros(2), np.array([2.0, 0.0]), np.array([1.0, 1.0])
    >>> nearest_points(origin, x, y, 2.0 * y)
    (0.5, 0.0)
    """
    best, found = np.inf, (0.0, 0.0)
    for start, end, point, swap, share in (
        (a, b, c, False, 0.0), (a, b, d, False, 1.0), (c, d, a, True, 0.0), (c, d, b, True, 1.0),
    ):  # fmt: skip
        along = end - start
        part = float(np.clip((point - start) @ along / (along @ along), 0.0, 1.0))
        distance = float(np.linalg.norm(start + part * along - point))
        if distance < best:
            best, found = distance, (share, part) if swap else (part, share)
    return found if len(a) == 2 else _within(a, b, c, d, best, found)


def _within(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    c: NDArray[np.float64],
    d: NDArray[np.float64],
    best: float,
    found: tuple[float, float],
) -> tuple[float, float]:
    """Return the nearest points of two lines in space if both are within the segments.

    Else those that are at an end of one of them, whose distance is `best`.
    """
    one, two, apart = b - a, d - c, a - c
    square, other, both = one @ one, two @ two, one @ two
    size = square * other - both * both
    if size <= PARALLEL * square * other:
        return found
    s = float((both * (two @ apart) - other * (one @ apart)) / size)
    t = float((square * (two @ apart) - both * (one @ apart)) / size)
    inside = 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0
    nearer = float(np.linalg.norm(apart + s * one - t * two)) < best
    return (s, t) if inside and nearer else found
