"""Parts of the stroke in which inputs move and forces grow.

An input moves from rest to its full displacement, and a force grows from zero to its full size,
between two fractions of the stroke, in proportion to the stroke between them. Before, the input
rests and the force is zero; after, both are held.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.model.arrays import locked, real_array

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

WHOLE = (0.0, 1.0)
SHORTEST = 0.005
"""Smallest length of a range, as a part of the stroke."""
DIGITS = 6
"""Decimals to which the ends of ranges are rounded, so that nearly equal ones are equal."""


def stroke_range(name: str, values: ArrayLike, shortest: float = SHORTEST) -> tuple[float, float]:
    """Return the begin and the end of a range, fractions of the stroke.

    Raises
    ------
    InvalidProblem
        If they are not from 0 to 1, or not in this order and `shortest` apart.

    Examples
    --------
    >>> stroke_range("during", [0, 0.5])
    (0.0, 0.5)
    """
    given = real_array(name, values)
    if given.shape != (2,):
        raise InvalidProblem(
            f"{name}: expected two fractions of the stroke, from and to, got shape {given.shape}"
        )
    begin, end = (float(each) for each in given.round(DIGITS))
    shown = f"[{begin:g}, {end:g}]"
    if not (0.0 <= begin <= 1.0 and 0.0 <= end <= 1.0):
        raise InvalidProblem(
            f"{name}: expected fractions of the stroke from 0 to 1 (0% to 100%), got {shown}"
        )
    if end < begin + shortest:
        raise InvalidProblem(
            f"{name}: expected an end that is at least {shortest:g} of the stroke after the "
            f"begin, got {shown}"
        )
    return begin, end


def stroke_ranges(name: str, values: ArrayLike, count: int) -> NDArray[np.float64] | None:
    """Return (count, 2) the ranges of the nodes of an input; None if all move all the time.

    Parameters
    ----------
    name
        Name of the ranges in errors.
    values : (2,) or (count, 2)
        One range for all nodes, or one for each.
    count
        Number of nodes.

    Raises
    ------
    InvalidProblem
        If a range is not valid.
    """
    given = real_array(name, values)
    if given.shape not in {(2,), (count, 2)}:
        raise InvalidProblem(
            f"{name}: expected two fractions of the stroke, or two for each node, shape "
            f"({count}, 2), got shape {given.shape}"
        )
    given = np.broadcast_to(given, (count, 2))
    ranges = np.array([stroke_range(name, each) for each in given])
    return None if (ranges == WHOLE).all() else locked(ranges)


def check_cover(name: str, ranges: NDArray[np.float64]) -> None:
    """Check that some input moves, or some force grows, at every fraction of the stroke.

    Parameters
    ----------
    name
        Name of the ranges (n, 2) in errors.
    """
    reached = 0.0
    for begin, end in (*sorted(map(tuple, ranges.tolist())), (1.0, 1.0)):
        if begin > reached:
            raise InvalidProblem(
                f"{name}: no input moves and no force grows from {100.0 * reached:g}% to "
                f"{100.0 * begin:g}% of the stroke; expected ranges that together cover the whole "
                "stroke"
            )
        reached = max(reached, end)


def share_at(ranges: NDArray[np.float64], fraction: float) -> NDArray[np.float64]:
    """Return (n,) the part of its full size that each displacement or force has at a fraction.

    Examples
    --------
    >>> share_at(np.array([[0.0, 0.5], [0.5, 1.0]]), 0.75)
    array([1. , 0.5])
    """
    begin, end = ranges.T
    return np.asarray(np.clip((fraction - begin) / (end - begin), 0.0, 1.0))


def rate_at(ranges: NDArray[np.float64], fraction: float, toward: float) -> NDArray[np.float64]:
    """Return (n,) the derivative of `share_at` by the fraction, on the side of another fraction.

    Examples
    --------
    >>> ranges = np.array([[0.0, 0.5], [0.5, 1.0]])
    >>> rate_at(ranges, 0.5, toward=1.0), rate_at(ranges, 0.5, toward=0.0)
    (array([0., 2.]), array([2., 0.]))
    """
    begin, end = ranges.T
    if toward > fraction:
        moves = (begin <= fraction) & (fraction < end)
    else:
        moves = (begin < fraction) & (fraction <= end)
    return np.where(moves, 1.0 / (end - begin), 0.0)


def delayed(ranges: NDArray[np.float64], start: float) -> NDArray[np.float64]:
    """Return ranges (n, 2) compressed to the part of the stroke after a fraction.

    Examples
    --------
    >>> delayed(np.array([[0.0, 0.5], [0.5, 1.0]]), 0.2)
    array([[0.2, 0.6],
           [0.6, 1. ]])
    """
    return start + (1.0 - start) * ranges


def kinks_of(ranges: NDArray[np.float64]) -> tuple[float, ...]:
    """Return the fractions within the stroke at which a range begins or ends, ascending.

    Examples
    --------
    >>> kinks_of(np.array([[0.0, 0.5], [0.5, 1.0]]))
    (0.5,)
    """
    ends = np.unique(ranges)
    return tuple(ends[(ends > 0.0) & (ends < 1.0)].tolist())
