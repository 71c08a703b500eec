"""A responder that lies now and then."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import Evaluator, Response, Screening, Status

if TYPE_CHECKING:
    from bellcrank.model import Problem


class Snapping:
    """Finds the first neighbour of each few to snap.

    Parameters
    ----------
    every
        How many.
    """

    def __init__(self, problem: Problem, every: int) -> None:
        self.problem = problem
        self._inner = Evaluator(problem)
        self._every = every
        self._asked = 0

    def respond(self, mask: np.ndarray, largest_increment: float = 1.0) -> Response:
        return self._inner.respond(mask, largest_increment)

    def respond_nearby(self, mask: np.ndarray, least: float = -np.inf) -> Response:
        self._asked += 1
        response = self._inner.respond_nearby(mask, least)
        snaps = self._asked % self._every == 1
        return replace(response, status=Status.SNAPPED) if snaps else response

    def screen(self, mask: np.ndarray) -> Screening | None:
        return self._inner.screen(mask)

    def remember(self) -> None:
        self._inner.remember()
