"""Splines through states along the stroke."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    Values = NDArray[np.float64]

STEPS = 48
"""Number of equal steps of the stroke at which a spline is evaluated."""


def stroke_spline(
    fractions: Values, values: Values, kinks: Sequence[float], at: ArrayLike
) -> Values:
    """Return (m, ...) a cubic spline through states along the stroke.

    At kinks, where an input starts or stops, only the value is continuous.

    Parameters
    ----------
    fractions : (F,)
        Fractions of the stroke, ascending; 0, 1 and the kinks are among them.
    values : (F, ...)
        Values there.
    kinks
        Fractions within the stroke, ascending.
    at : (m,)
        Fractions at which the spline is evaluated.

    Examples
    --------
    >>> roof = np.array([0.0, 0.5, 1.0, 0.5, 0.0])
    >>> stroke_spline(np.linspace(0.0, 1.0, 5), roof, [0.5], [0.125, 0.5, 0.625])
    array([0.25, 1.  , 0.75])
    """
    from scipy.interpolate import CubicSpline

    points = np.asarray(at, dtype=np.float64)
    found: Values = np.empty((len(points), *np.shape(values)[1:]))
    for begin, end in pairwise((fractions[0], *kinks, fractions[-1])):
        own = (fractions >= begin) & (fractions <= end)
        chosen = (points >= begin) & (points <= end)
        found[chosen] = CubicSpline(fractions[own], values[own])(points[chosen])
    return found


@lru_cache(maxsize=64)
def spline_basis(fractions: tuple[float, ...], kinks: tuple[float, ...] = ()) -> Values:
    """Return (m, F + 1) the values of a spline at `STEPS` equal steps of the stroke and at kinks.

    Its knots are the state at rest and those at the fractions.
    """
    knots = np.array([0.0, *fractions])
    at = np.union1d(np.arange(STEPS + 1) / STEPS, kinks)
    return stroke_spline(knots, np.eye(len(knots)), kinks, at)
