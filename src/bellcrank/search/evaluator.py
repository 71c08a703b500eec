"""What a search asks about designs, and who answers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

from bellcrank.mechanics import FlipPrediction, Response, SpringEvaluator, check_memory
from bellcrank.search.goals import GoalEvaluator, at_strokes

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.search.settings import SearchSettings


class Evaluator(Protocol):
    """Whatever can tell the efficiency of a design: mechanics, a network, finite elements."""

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

        With a warm start it may be computed from the reference, a similar design, and need not
        be right where the score is at most `lower_bound`.
        """

    def set_reference(self) -> None:
        """Keep the design evaluated last as the reference of warm starts."""

    def predict_flips(self, mask: NDArray[np.bool_]) -> FlipPrediction | None:
        """Predict what each flip of a designable beam would do to the design evaluated last.

        None where nothing can be predicted.
        """


def make_evaluator(problem: Problem, settings: SearchSettings) -> Evaluator:
    """Return what answers the questions of a search, as its settings want it answered.

    Plain mechanics where there are neither goals nor several strokes: searches are faster then.

    Raises
    ------
    InvalidSettings, UnknownName
        If the problem needs more memory than is available, has not got the objective, or a goal
        makes no sense for it.
    """
    check_memory(problem, evaluators=len(settings.strokes), predict_flips=settings.predicts_flips)
    told = settings.objective, settings.unloaded_beams
    if not settings.goals and settings.strokes == (1.0,):
        return SpringEvaluator(problem, *told)
    return GoalEvaluator(at_strokes(problem, settings.strokes), settings.goals, *told)
