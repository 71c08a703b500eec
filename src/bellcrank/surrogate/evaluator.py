"""A trained network as an evaluator of designs.

`NetworkEvaluator` has the methods of `bellcrank.search.Evaluator`, so that any search can use a
network in place of the mechanics.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import FlipPrediction, Response, Status

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.surrogate.predictor import Predictor


class NetworkEvaluator:
    """Responses of designs as a network predicts them.

    Each design has the status ``converged`` and the predicted efficiency; energy and
    displacements are nan. A network does not recognise designs without a unique, stable
    response: designs that a search finds must be evaluated by the mechanics.

    Parameters
    ----------
    predictor
        Network and problem.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> from bellcrank.search import MetropolisSettings, chain_blocks
    >>> from bellcrank.surrogate.predictor import load_predictor
    >>> evaluator = NetworkEvaluator(load_predictor(find_problem("crane"), device="cpu"))
    >>> (state, proposals), = chain_blocks(evaluator, MetropolisSettings(steps=20), 0)
    >>> state.step
    20
    """

    def __init__(self, predictor: Predictor) -> None:
        self.problem = predictor.problem
        self.predictor = predictor
        self._displacement = np.full((self.problem.lattice.node_count, 2), np.nan)
        self._displacement.setflags(write=False)

    def evaluate(
        self,
        mask: NDArray[np.bool_],
        largest_increment: float = 1.0,  # noqa: ARG002
        *,
        warm_start: bool = False,  # noqa: ARG002
        lower_bound: float = -math.inf,  # noqa: ARG002
    ) -> Response:
        """Predict the response of a design; the options of the mechanics have no effect."""
        (efficiency,) = self.predictor.predict(mask[None]).tolist()
        return Response(Status.CONVERGED, efficiency, math.nan, self._displacement)

    def set_reference(self) -> None:
        """Do nothing: predictions need no reference."""

    def predict_flips(self, mask: NDArray[np.bool_]) -> FlipPrediction:
        """Predict the change of efficiency for each flip of a designable beam.

        Parameters
        ----------
        mask : (M,) bool
            The design before the flips.
        """
        beams = np.asarray(self.problem.designable, np.int64)
        masks = np.repeat(mask[None], len(beams) + 1, axis=0)
        masks[np.arange(len(beams)) + 1, beams] ^= True
        predicted = self.predictor.predict(masks)
        return FlipPrediction(beams, predicted[1:] - predicted[0], np.zeros(len(beams)))
