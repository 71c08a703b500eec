"""What chains ask in place of the mechanics, and what such chains can be told."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.search.costs import LARGEST_EXPONENT, costs

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.search.evaluator import Evaluator
    from bellcrank.search.metropolis import MetropolisSettings

PLAIN = {
    "moves": ("flip",),
    "minimum_degree": 0,
    "patience": None,
    "goals": (),
    "strokes": (1.0,),
}
"""Settings of the paper's search that chains with a scorer cannot have otherwise."""


class Scorer(Protocol):
    """Whatever can tell efficiencies, right or nearly so, of many designs at once."""

    def score(self, masks: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Return the efficiency (n,) of designs (n, M); nan for those to keep away from."""


class MechanicsScorer:
    """The mechanics as a scorer, one design after the other.

    Parameters
    ----------
    evaluator
        Who computes; designs without a unique, stable response are to keep away from.
    """

    def __init__(self, evaluator: Evaluator) -> None:
        self.evaluator = evaluator

    def score(self, masks: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Return the efficiencies (n,) of designs (n, M), each loaded from rest."""
        found = [self.evaluator.evaluate(mask) for mask in masks]
        return np.array([each.score if each.is_admissible else math.nan for each in found])


def costs_of(name: str, score: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return registered costs (n,) of efficiencies (n,); nan stays nan.

    Examples
    --------
    >>> costs_of("exponential", np.array([0.0, -np.log(2.0)])).round(6)
    array([1., 2.])
    """
    of = costs[name].of
    return np.array([of(each) for each in np.maximum(score, -LARGEST_EXPONENT).tolist()])


def require_plain_flips(settings: MetropolisSettings) -> None:
    """Refuse settings of the paper's search that need the mechanics at each step.

    Raises
    ------
    InvalidSettings
    """
    for name, plain in PLAIN.items():
        given = getattr(settings, name)
        if given != plain:
            raise InvalidSettings(
                f"{name}: chains that ask a stand-in for the mechanics know only {plain!r}, got "
                f"{given!r}"
            )
