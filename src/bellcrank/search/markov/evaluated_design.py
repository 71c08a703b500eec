"""A design of a Markov chain with its response."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import FlipPrediction
from bellcrank.model import unpack_mask
from bellcrank.search.markov.costs import costs

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics import Response
    from bellcrank.model import Problem
    from bellcrank.search.evaluator import Evaluator
    from bellcrank.search.markov.costs import Cost


@dataclass(slots=True, eq=False)
class EvaluatedDesign:
    """A current or proposed design of a chain, with its response.

    Parameters
    ----------
    evaluator
        The evaluator that computed the response.
    cost_function
        The cost that the chain minimises.
    temperature
        Temperature of the chain.
    mask : (M,) bool
    response
        Response of the design.
    """

    evaluator: Evaluator
    cost_function: Cost
    temperature: float
    mask: NDArray[np.bool_]
    response: Response
    is_last: bool = True
    """Whether the evaluator evaluated this design last, as predictions require."""
    _prediction: FlipPrediction | None = field(default=None, repr=False)

    @property
    def problem(self) -> Problem:
        """The problem of the evaluator."""
        return self.evaluator.problem

    @property
    def cost(self) -> float:
        """Cost of the design."""
        return self.cost_function.of(self.response.score)

    def flip_prediction(self) -> FlipPrediction:
        """Predict the effect of each flip, once; zero where no prediction is available."""
        if self._prediction is None:
            if not self.is_last:
                self.evaluator.evaluate(self.mask, warm_start=True)
            beams = self.problem.designable
            unknown = FlipPrediction(beams, np.zeros(len(beams)), np.zeros(len(beams)))
            self._prediction = self.evaluator.predict_flips(self.mask) or unknown
        return self._prediction

    def predicted_log_ratios(self) -> NDArray[np.float64]:
        """Return (D,) the predicted logarithm of the ratio of probabilities of each flip."""
        increase = self.cost_function.change(self.response.score, self.flip_prediction().change)
        ratio: NDArray[np.float64] = np.clip(-increase / self.temperature, -1e3, 1e3)
        return ratio


def evaluated_design(
    evaluator: Evaluator, cost: str, temperature: float, mask: str
) -> EvaluatedDesign:
    """Evaluate a packed design from rest and make it the reference of warm starts."""
    bits = unpack_mask(mask, evaluator.problem.lattice.beam_count).copy()
    response = evaluator.evaluate(bits)
    evaluator.set_reference()
    return EvaluatedDesign(evaluator, costs[cost], temperature, bits, response)


def reached_from(current: EvaluatedDesign, first: EvaluatedDesign) -> EvaluatedDesign:
    """Return the design at which some steps ended; the first one if it has no response from rest.

    Warm starts may lead to equilibria that the path from rest does not lead to. They would stop a
    chain, whose next steps begin with a response from rest.
    """
    if current is first or current.evaluator.evaluate(current.mask).is_admissible:
        return current
    return first
