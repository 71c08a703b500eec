"""An evaluator that reports some designs as snapping."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bellcrank.mechanics import FlipPrediction, Response, SpringEvaluator, Status

if TYPE_CHECKING:
    import numpy as np

    from bellcrank.model import Problem


class Snapping:
    """Reports the first of every few warm starts as snapping.

    Parameters
    ----------
    every
        Number of warm starts per reported snap.
    """

    def __init__(self, problem: Problem, every: int) -> None:
        self.problem = problem
        self._inner = SpringEvaluator(problem)
        self._every = every
        self._count = 0

    def evaluate(self, mask: np.ndarray, largest_increment: float = 1.0, **start: Any) -> Response:
        response = self._inner.evaluate(mask, largest_increment, **start)
        if not start:
            return response
        self._count += 1
        snaps = self._count % self._every == 1
        return replace(response, status=Status.SNAPPED) if snaps else response

    def predict_flips(self, mask: np.ndarray) -> FlipPrediction | None:
        return self._inner.predict_flips(mask)

    def set_reference(self) -> None:
        self._inner.set_reference()
