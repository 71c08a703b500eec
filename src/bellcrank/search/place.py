"""A design that a chain is at or considers, as moves see it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import FlipPrediction

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics import Response
    from bellcrank.model import Problem
    from bellcrank.search.costs import Cost
    from bellcrank.search.evaluator import Evaluator


@dataclass(slots=True, eq=False)
class Place:
    """A design, what it costs, and what its flips would.

    Parameters
    ----------
    evaluator
        Who evaluated it.
    cost_function
        What the search lowers.
    temperature
        At which the chain is.
    mask : (M,) bool
    response
        Of the design.
    """

    evaluator: Evaluator
    cost_function: Cost
    temperature: float
    mask: NDArray[np.bool_]
    response: Response
    is_last: bool = True
    """Whether it is the design that the evaluator evaluated last; else it must be remembered."""
    _screening: FlipPrediction | None = field(default=None, repr=False)

    @property
    def problem(self) -> Problem:
        """What the design is for."""
        return self.evaluator.problem

    @property
    def cost(self) -> float:
        """What the search lowers."""
        return self.cost_function.of(self.response.score)

    @property
    def is_admissible(self) -> bool:
        """Whether the design has a unique, stable response, so that a chain may go there."""
        return self.response.is_admissible

    def screening(self) -> FlipPrediction:
        """Predict what each flip would do, once; nothing where no prediction can be made."""
        if self._screening is None:
            if not self.is_last:
                self.evaluator.evaluate(self.mask, warm_start=True)
            beams = self.problem.designable
            nothing = FlipPrediction(beams, np.zeros(len(beams)), np.zeros(len(beams)))
            self._screening = self.evaluator.predict_flips(self.mask) or nothing
        return self._screening

    def log_gain(self, index: int | slice) -> NDArray[np.float64]:
        """Predicted change of the log of the probability by flips: minus cost over temperature.

        Parameters
        ----------
        index
            Into the designable beams.
        """
        change = np.atleast_1d(self.screening().change[index])
        rise = self.cost_function.rise(self.response.score, change)
        gain: NDArray[np.float64] = np.clip(-rise / self.temperature, -1e3, 1e3)
        return gain


def flipped(mask: NDArray[np.bool_], beams: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return a design with some beams flipped."""
    other = mask.copy()
    other[beams] ^= True
    return other


def accepts(log_ratio: float, uniform: float) -> bool:
    """Metropolis and Hastings' rule: with probability min(1, ratio)."""
    return log_ratio >= 0.0 or uniform < math.exp(log_ratio)
