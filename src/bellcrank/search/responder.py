"""What a search asks about designs, and who answers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

from bellcrank.mechanics import Evaluator, Response, Screening
from bellcrank.search.goals import GoalResponder, at_strokes

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.search.settings import SearchSettings


class Responder(Protocol):
    """Whatever can tell the efficiency of a design: mechanics, a network, finite elements."""

    problem: Problem

    def respond(self, mask: NDArray[np.bool_], largest_increment: float = 1.0) -> Response:
        """Response of a design, from nothing."""

    def respond_nearby(self, mask: NDArray[np.bool_], least: float = -math.inf) -> Response:
        """Response of a design similar to the remembered one.

        One of no higher score than `least` is of no interest and need not be right.
        """

    def remember(self) -> None:
        """Keep the design evaluated last as the one to start from."""

    def screen(self, mask: NDArray[np.bool_]) -> Screening | None:
        """Predict what each flip of a designable beam would do to the design evaluated last.

        None where nothing can be predicted.
        """


def make_responder(problem: Problem, settings: SearchSettings) -> Responder:
    """Return what answers the questions of a search, as its settings want it answered.

    Plain mechanics where there are neither goals nor several strokes: searches are faster then.

    Raises
    ------
    InvalidSettings, UnknownName
        If the problem has not got the objective, or a goal makes no sense for it.
    """
    told = settings.objective, settings.dangling, settings.minimiser
    if not settings.goals and settings.strokes == (1.0,):
        return Evaluator(problem, *told)
    return GoalResponder(at_strokes(problem, settings.strokes), settings.goals, *told)
