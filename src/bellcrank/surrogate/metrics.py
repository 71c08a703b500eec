"""How good predictions are, by several measures that are easily confused."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Accuracy:
    """Predictions against the truth.

    Parameters
    ----------
    r_squared
        Of the linear regression of predicted on actual: the square of their correlation. The
        paper's measure; it forgives a wrong scale and a wrong zero. nan if one is constant.
    determination
        1 - (mean squared error) / (variance of the truth); forgives nothing. nan if the truth is
        constant.
    rms_error
        Root of the mean squared error, in units of the efficiency.
    count
        Designs that were looked at.
    """

    r_squared: float
    determination: float
    rms_error: float
    count: int

    def to_dict(self) -> dict[str, Any]:
        """Return the measures as plain data; what is not a number becomes None."""
        return {name: finite(value) for name, value in asdict(self).items()}

    @classmethod
    def from_dict(cls, told: dict[str, Any]) -> Self:
        """Rebuild the measures from `to_dict`.

        Raises
        ------
        TypeError, ValueError
            If they are none.
        """
        numbers: dict[str, Any] = {
            name: math.nan if each is None else each for name, each in told.items()
        }
        return cls(**numbers)


def accuracy(predicted: NDArray[np.floating[Any]], actual: NDArray[np.floating[Any]]) -> Accuracy:
    """Compare predictions with the truth.

    Parameters
    ----------
    predicted, actual : (n,)

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
    varies = truth.min() < truth.max()  # a variance may be a remnant of rounding
    return Accuracy(
        correlation(guess, truth) ** 2,
        1.0 - error / float(truth.var()) if varies else math.nan,
        error**0.5,
        len(truth),
    )


def correlation(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Pearson's correlation; nan where one of them is constant."""
    if first.min() == first.max() or second.min() == second.max():
        return math.nan
    a, b = first - first.mean(), second - second.mean()
    scale = float(np.sqrt((a * a).sum() * (b * b).sum()))
    return float((a * b).sum()) / scale if scale > 0.0 else math.nan


def finite(value: float) -> float | None:
    """Return a number as JSON can have it: None if it is nan or infinite."""
    return value if math.isfinite(value) else None


def recall(predicted: NDArray[np.float64], actual: NDArray[np.float64], count: int) -> float:
    """Fraction of the `count` largest actual values among the `count` largest predicted ones.

    Where there are fewer, of all; nan where there are none.

    Examples
    --------
    >>> recall(np.array([3.0, 2.0, 1.0, 0.0]), np.array([3.0, 0.0, 1.0, 2.0]), 2)
    0.5
    """
    wanted = min(count, len(actual))
    if wanted < 1:
        return math.nan
    best = np.argsort(-actual, kind="stable")[:wanted]
    named = np.argsort(-predicted, kind="stable")[:wanted]
    return len(np.intersect1d(best, named)) / wanted
