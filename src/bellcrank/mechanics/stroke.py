"""Equilibria along the stroke."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics.evaluator import VERIFICATION_INCREMENT
from bellcrank.mechanics.frames.evaluator import FrameEvaluator

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from bellcrank.mechanics.models import ModelEvaluator
    from bellcrank.model import Problem

STATES = 16
"""Number of states along the stroke, the full input included, at which contact is checked."""


def at_fraction(problem: Problem, fraction: float) -> Problem:
    """Return a problem with a fraction of its input and of its loads, which grow with the input.

    Raises
    ------
    InvalidSettings
        If an input or a load grows in a part of the stroke (`Problem.has_ranges`): they then have
        different fractions of their sizes. Equilibria of the whole stroke show those at a fraction
        (`FrameEvaluator.equilibrium`).

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> round(at_fraction(find_problem("crane"), 0.5).input.amount, 3)
    0.217
    """
    if problem.has_ranges and fraction != 1.0:
        raise InvalidSettings(
            f"problem {problem.name!r}: expected inputs and loads that grow along the whole "
            "stroke, got 'during'; a fraction of such a stroke is not a problem with a smaller "
            "input"
        )
    given, loads = problem.input, problem.loads
    forces = tuple(replace(each, force=fraction * each.force) for each in loads.forces)
    weight = None if loads.weight is None else fraction * loads.weight
    return replace(
        problem,
        input=replace(given, amount=fraction * given.amount),
        loads=replace(loads, forces=forces, weight=weight),
    )


def increment_at(fraction: float) -> float:
    """Return the largest load increment, a fraction of the load, at a fraction of the input.

    It is a power of two, so that the increments add up to the load without a remainder.

    Examples
    --------
    >>> increment_at(1.0), increment_at(0.25)
    (0.03125, 0.125)
    """
    return min(1.0, 2.0 ** math.floor(math.log2(VERIFICATION_INCREMENT / fraction)))


class StrokeEvaluator:
    """Displacements of designs at equal fractions of the full input.

    Those of frames are equilibria of the path of one response, those of springs are computed from
    rest.

    Parameters
    ----------
    evaluator
        Evaluator of the problem with the full input. Its own response is left as it is if it is
        that of the design.
    states
        Number of states, the full input included.

    Examples
    --------
    >>> from bellcrank.mechanics import SpringEvaluator
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> stroke = StrokeEvaluator(SpringEvaluator(crane), states=4)
    >>> [load for load, _ in stroke.displacements(crane.initial)]
    [0.25, 0.5, 0.75, 1.0]
    """

    def __init__(self, evaluator: ModelEvaluator, states: int = STATES) -> None:
        self._evaluator = evaluator
        self._loads = [state / states for state in range(1, states + 1)]
        self._springs: list[ModelEvaluator] = []
        if not isinstance(evaluator, FrameEvaluator):
            problem = evaluator.problem
            self._springs = [
                evaluator.for_problem(at_fraction(problem, load)) for load in self._loads
            ]

    def displacements(self, mask: ArrayLike) -> Iterator[tuple[float, NDArray[np.float64]]]:
        """Yield fractions of the full input and (N, d) displacements, in ascending order.

        A frame that loses stability has none beyond.
        """
        frame = self._evaluator
        if not isinstance(frame, FrameEvaluator):
            for load, evaluator in zip(self._loads, self._springs, strict=True):
                yield load, evaluator.evaluate(mask, increment_at(load)).displacement
            return
        if frame.response_of(mask) is None:
            frame.evaluate(mask, VERIFICATION_INCREMENT)
        nodes, dimension = frame.problem.lattice.positions.shape
        for load in self._loads:
            if (found := frame.equilibrium(load)) is not None:
                yield load, found.state.u[:nodes, :dimension]
