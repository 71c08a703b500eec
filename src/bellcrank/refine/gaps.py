"""Gaps between struts, and their derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bellcrank.mechanics import BentStruts, near_pairs

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem

    Values = NDArray[np.float64]


PARALLEL = 1e-12
"""Square of the sine of the angle between struts below which they are parallel."""


class Gaps(NamedTuple):
    """Gaps between struts that are near each other.

    In the plane, the gaps between the ends of a piece of a strut and another piece, up to four for
    each pair: the smallest of them has a kink where struts are parallel.
    """

    keys: NDArray[np.int64]
    """(g, 3) both pieces, and which of their gaps."""
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

    Struts are bent as in `bellcrank.mechanics.BentStruts`: two straight pieces each in the plane.
    Of struts that cross, the derivatives are 0.

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
    struts = BentStruts(problem, beams)
    points, pieces = struts.points(u), struts.pieces
    pairs, distance = near_pairs(points, pieces, float(width.max()) + reach)
    # Struts that meet in a node overlap there; angles between them are constraints of their own.
    ends = problem.lattice.beams[beams[pairs % count]]
    apart = np.flatnonzero(~(ends[:, 0, :, None] == ends[:, 1, None, :]).any(axis=(1, 2)))
    apart = apart[np.lexsort((pairs[apart, 1], pairs[apart, 0]))]
    pairs, distance = pairs[apart], distance[apart]
    nodes, dimension = problem.lattice.positions.shape
    corners = np.moveaxis(points[pieces[pairs]].reshape(-1, 4, dimension), 1, 0)
    s, t = nearest_to_ends(*corners) if dimension == 2 else nearest_points(*corners)
    weights = np.stack([1.0 - s, s, t - 1.0, -t], axis=2)
    across = np.einsum("pkc,cpd->pkd", weights, corners)
    size = np.linalg.norm(across, axis=2)
    crossing = distance == 0.0
    size[crossing] = 0.0
    strut = pairs % count
    gap = size - 0.5 * width[strut].sum(axis=1)[:, None]
    near = gap < reach
    near[crossing, 1:] = False
    pair, which = np.nonzero(near)
    size = size[pair, which]
    normal = across[pair, which] / np.where(size > 0.0, size, np.inf)[:, None]
    motion = weights[pair, which][:, :, None] * normal[:, None]
    point, row = pieces[pairs[pair]].reshape(-1, 4), np.arange(len(pair))[:, None]
    at_node, rows = point < nodes, np.broadcast_to(row, point.shape)
    fields = np.zeros((len(pair), nodes, 3 * (dimension - 1)))
    np.add.at(fields[..., :dimension], (rows[at_node], point[at_node]), motion[at_node])
    if not at_node.all():
        bent = beams[point[~at_node] - nodes]
        _add_middles(problem, u, bent, motion[~at_node], rows[~at_node], fields)
    widths = np.zeros((len(pair), problem.lattice.beam_count))
    widths[row, beams[strut[pair]]] = -0.5
    return Gaps(np.column_stack([pairs[pair], which]), gap[pair, which], fields, widths)


def _add_middles(
    problem: Problem,
    u: NDArray[np.float64],
    beams: NDArray[np.int64],
    vectors: NDArray[np.float64],
    rows: NDArray[np.int64],
    fields: NDArray[np.float64],
) -> None:
    """Add the derivatives of the motions of the middles of bent struts along vectors.

    Parameters
    ----------
    beams : (n,) int64
        The struts.
    vectors : (n, 2) float64
    rows : (n,) int64
        Rows of the fields to which they are added.
    fields : (g, N, 3) float64
    """
    first, second = problem.lattice.beams[beams].T
    places = problem.lattice.positions + u[:, :2]
    chord = places[second] - places[first]
    bend = (u[first, 2] - u[second, 2] + np.pi) % (2.0 * np.pi) - np.pi
    # The middle is that of the chord, and the chord turned by 90 degrees times bend / 8.
    turned = bend[:, None] / 8.0 * np.column_stack([vectors[:, 1], -vectors[:, 0]])
    slope = (chord[:, 0] * vectors[:, 1] - chord[:, 1] * vectors[:, 0])[:, None] / 8.0
    np.add.at(fields, (rows, first), np.column_stack([0.5 * vectors - turned, slope]))
    np.add.at(fields, (rows, second), np.column_stack([0.5 * vectors + turned, -slope]))


def nearest_to_ends(a: Values, b: Values, c: Values, d: Values) -> tuple[Values, Values]:
    """Return where segments are nearest to the ends of each other, as parts of their lengths.

    Parameters
    ----------
    a, b, c, d : (m, d)
        Ends of the segments a b and c d.

    Returns
    -------
    s, t : (m, 4)
        Of a b and of c d: for the ends a, b, c and d.

    Examples
    --------
    >>> origin, x, y = np.zeros((1, 2)), np.array([[2.0, 0.0]]), np.array([[1.0, 1.0]])
    >>> s, t = nearest_to_ends(origin, x, y, 2.0 * y)
    >>> s.tolist(), t.tolist()
    ([[0.0, 1.0, 0.5, 1.0]], [[0.0, 0.0, 0.0, 1.0]])
    """

    def part(point: Values, start: Values, end: Values) -> Values:
        along = end - start
        share = ((point - start) * along).sum(axis=1) / (along * along).sum(axis=1)
        return np.asarray(np.clip(share, 0.0, 1.0))

    zero, one = np.zeros(len(a)), np.ones(len(a))
    s = np.column_stack([zero, one, part(c, a, b), part(d, a, b)])
    t = np.column_stack([part(a, c, d), part(b, c, d), zero, one])
    return s, t


def nearest_points(a: Values, b: Values, c: Values, d: Values) -> tuple[Values, Values]:
    """Return where segments in space are nearest to each other, as parts of their lengths.

    Parameters
    ----------
    a, b, c, d : (m, 3)
        Ends of the segments a b and c d.

    Returns
    -------
    s, t : (m, 1)
        Of a b and of c d.

    Examples
    --------
    >>> x, y, z = np.eye(3)[:, None]
    >>> s, t = nearest_points(-x, x, z - y, z + 3.0 * y)
    >>> s.tolist(), t.tolist()
    ([[0.5]], [[0.25]])
    """
    s, t = nearest_to_ends(a, b, c, d)
    one, two, apart = b - a, d - c, a - c
    size = np.linalg.norm(
        apart[:, None] + s[..., None] * one[:, None] - t[..., None] * two[:, None], axis=2
    )
    best = size.argmin(axis=1)[:, None]
    s, t = (np.take_along_axis(each, best, axis=1) for each in (s, t))
    square, other, both = ((u * v).sum(axis=1) for u, v in ((one, one), (two, two), (one, two)))
    first, second = (one * apart).sum(axis=1), (two * apart).sum(axis=1)
    product = square * other - both * both
    skew = product > PARALLEL * square * other
    product = np.where(skew, product, 1.0)
    within = np.stack([both * second - other * first, square * second - both * first]) / product
    inside = skew & (within >= 0.0).all(axis=0) & (within <= 1.0).all(axis=0)
    s[inside, 0], t[inside, 0] = within[:, inside]
    return s, t
