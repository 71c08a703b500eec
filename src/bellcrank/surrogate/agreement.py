"""How well changes were foreseen, in numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.surrogate.metrics import correlation, finite, recall

if TYPE_CHECKING:
    from numpy.typing import NDArray

TOP = 30
"""Flips that a search would try first."""
ENOUGH = 4 * TOP
"""Flips from which on it means something to find the `TOP` best: a guess finds a quarter."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """Changes that were foreseen against those that came.

    Parameters
    ----------
    pearson, spearman
        Correlation of the values, and of their ranks; nan where one side is constant.
    recall
        Fraction of the `TOP` most favourable flips among as many that were foreseen to be; nan
        if there are fewer than `ENOUGH` flips.
    count
        Flips that were looked at.
    """

    pearson: float
    spearman: float
    recall: float
    count: int

    def to_dict(self) -> dict[str, float | int | None]:
        """Return the measures as plain data; what is not a number becomes None."""
        return {
            "pearson": finite(self.pearson),
            "spearman": finite(self.spearman),
            "recall": finite(self.recall),
            "count": self.count,
        }


def rank_correlation(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Spearman's correlation: that of the ranks, equals sharing theirs; nan if one is constant.

    Examples
    --------
    >>> rank_correlation(np.array([1.0, 2.0, 3.0]), np.array([1.0, 10.0, 1000.0]))
    1.0
    """
    from scipy.stats import rankdata

    return correlation(rankdata(first), rankdata(second))


def agreement(foreseen: NDArray[np.float64], exact: NDArray[np.float64]) -> Agreement:
    """Compare changes that were foreseen with those that came; what has no number is left out.

    Parameters
    ----------
    foreseen, exact : (n,)

    Examples
    --------
    >>> found = agreement(np.array([1.0, 2.0, 3.0, 9.0]), np.array([2.0, 4.0, 6.0, np.nan]))
    >>> found.pearson, found.count
    (1.0, 3)
    """
    known = np.isfinite(foreseen) & np.isfinite(exact)
    guess, truth = np.asarray(foreseen)[known], np.asarray(exact)[known]
    count = len(truth)
    if count < 2:
        return Agreement(math.nan, math.nan, math.nan, count)
    named = recall(guess, truth, TOP) if count >= ENOUGH else math.nan
    return Agreement(correlation(guess, truth), rank_correlation(guess, truth), named, count)
