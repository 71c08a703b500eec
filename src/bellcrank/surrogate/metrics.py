"""Accuracy of predictions."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Accuracy:
    """Agreement of predicted with actual efficiencies.

    Parameters
    ----------
    r_squared
        R² of the linear regression of predicted on actual values: the square of their
        correlation. The paper's measure; it ignores a wrong scale and offset. nan if one side is
        constant.
    determination
        Coefficient of determination, 1 - (mean squared error) / (variance of the actual values).
        nan if the actual values are constant.
    rms_error
        Root mean square error in units of the efficiency.
    count
        Number of designs.
    """

    r_squared: float
    determination: float
    rms_error: float
    count: int

    def to_dict(self) -> dict[str, Any]:
        """Return the measures as plain data; nan becomes None."""
        return {name: finite(value) for name, value in asdict(self).items()}


def accuracy(predicted: NDArray[np.floating[Any]], actual: NDArray[np.floating[Any]]) -> Accuracy:
    """Compare predicted with actual values, (n,) each.

    Examples
    --------
    >>> actual = np.array([0.0, 1.0, 2.0, 3.0])
    >>> found = accuracy(0.5 * actual + 1.0, actual)
    >>> round(found.r_squared, 6), round(found.determination, 6)
    (1.0, 0.7)
    """
    truth = np.asarray(actual, np.float64)
    guess = np.asarray(predicted, np.float64)
    error = float(np.mean((guess - truth) ** 2))
    varies = truth.min() < truth.max()  # a variance may be rounding noise
    return Accuracy(
        correlation(guess, truth) ** 2,
        1.0 - error / float(truth.var()) if varies else math.nan,
        error**0.5,
        len(truth),
    )


def correlation(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Return Pearson's correlation; nan if one side is constant."""
    if first.min() == first.max() or second.min() == second.max():
        return math.nan
    a, b = first - first.mean(), second - second.mean()
    scale = float(np.sqrt((a * a).sum() * (b * b).sum()))
    return float((a * b).sum()) / scale if scale > 0.0 else math.nan


def finite(value: float) -> float | None:
    """Return a number for JSON: None if it is nan or infinite."""
    return value if math.isfinite(value) else None
