"""Flip one beam, chosen by what its flip is predicted to do.

The chance of a flip grows with the square root of the predicted ratio of probabilities:
such proposals are locally balanced (Zanella, J. Am. Stat. Assoc. 115, 852, 2020; with
gradients for predictions, Grathwohl et al., ICML 2021). Predictions err; the acceptance
sets it right.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.search.moves.registry import moves

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.search.place import Place

LARGEST_LOG_WEIGHT = 3.0
"""Predictions of more than this are not believed any better."""
SMALLEST_LOG_WEIGHT = -5.0
"""No flip is ruled out by a prediction."""


class Balanced:
    """Flip a designable beam with a chance that its predicted effect balances locally."""

    def propose(self, here: Place, rng: np.random.Generator) -> NDArray[np.int64] | None:
        """Choose a beam."""
        weights = np.exp(_log_weights(here))
        index = int(np.searchsorted(np.cumsum(weights), rng.random() * weights.sum(), "right"))
        index = min(index, len(weights) - 1)
        return here.problem.designable[index : index + 1]

    def log_chance(self, here: Place, beams: NDArray[np.int64]) -> float:
        """Weight of the beam among all."""
        log_weights = _log_weights(here)
        index = int(np.searchsorted(here.problem.designable, beams[0]))
        return float(log_weights[index]) - math.log(np.exp(log_weights).sum())


def _log_weights(here: Place) -> NDArray[np.float64]:
    weights: NDArray[np.float64] = np.clip(
        0.5 * here.log_gain(slice(None)), SMALLEST_LOG_WEIGHT, LARGEST_LOG_WEIGHT
    )
    return weights


moves.register("balanced")(Balanced())
