"""Interface between searches and the models that evaluate designs."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

from bellcrank.mechanics import FlipPrediction, Response, SpringEvaluator, check_memory
from bellcrank.search.constraints import ConstrainedEvaluator, at_strokes

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.search.settings import SearchSettings


class Evaluator(Protocol):
    """A model that computes the efficiency of designs: springs, a network, finite elements."""

    problem: Problem

    def evaluate(
        self,
        mask: NDArray[np.bool_],
        largest_increment: float = 1.0,
        *,
        warm_start: bool = False,
        lower_bound: float = -math.inf,
    ) -> Response:
        """Return the response of a design.

        With a warm start the computation may begin at the reference, a similar design, and the
        result need not be exact where the score is at most `lower_bound`.
        """

    def set_reference(self) -> None:
        """Make the design evaluated last the reference of warm starts."""

    def predict_flips(self, mask: NDArray[np.bool_]) -> FlipPrediction | None:
        """Predict the effect of flipping each designable beam of the design evaluated last.

        None if no prediction is available.
        """


def make_evaluator(problem: Problem, settings: SearchSettings) -> Evaluator:
    """Return the evaluator of a search.

    Without goals and with a single stroke it is a plain `SpringEvaluator`, which is faster.

    Raises
    ------
    InvalidSettings, UnknownName
        If the problem needs more memory than is available, or the objective or a goal does not
        apply to it.
    """
    check_memory(problem, evaluators=len(settings.strokes), predict_flips=settings.predicts_flips)
    options = settings.objective, settings.unloaded_beams
    if not settings.goals and settings.strokes == (1.0,):
        return SpringEvaluator(problem, *options)
    return ConstrainedEvaluator(at_strokes(problem, settings.strokes), settings.goals, *options)


def verification_evaluator(problem: Problem, settings: SearchSettings, **changes: Any) -> Evaluator:
    """Return the evaluator of finished designs: all beams count, and the goals of the search hold.

    Parameters
    ----------
    problem
        Lattice, supports, input and output.
    settings
        Settings of the search.
    changes
        Settings that differ from those of the search.
    """
    return make_evaluator(problem, replace(settings, **{"unloaded_beams": "keep", **changes}))
