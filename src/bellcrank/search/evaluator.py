"""Interface between searches and the models that evaluate designs."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import (
    FlipPrediction,
    Response,
    Status,
    check_memory,
    model_evaluator,
)
from bellcrank.search.constraints import (
    ConstrainedEvaluator,
    at_strokes,
    mirror_axes,
    parse_goal,
)
from bellcrank.search.relaxation import relaxed
from bellcrank.search.specification import RESERVE, SpecificationEvaluator
from bellcrank.search.symmetry import SymmetryGroups

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.search.settings import SearchSettings


class Evaluator(Protocol):
    """A model that computes the efficiency of designs: springs, frames, a network."""

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


def make_evaluator(
    problem: Problem,
    settings: SearchSettings,
    elements: int | None = None,
    reserve: float = RESERVE,
) -> Evaluator:
    """Return the evaluator of a search.

    Without goals and with a single stroke it is the plain evaluator of the mechanical model
    (`bellcrank.mechanics.model_evaluator`), which is faster.

    Parameters
    ----------
    problem
        A problem with a section is evaluated as a frame.
    settings
        Settings of the search.
    elements : int, optional
        As in `bellcrank.mechanics.model_evaluator`.
    reserve
        Part of their size by which the bounds of a specification are tightened.

    Raises
    ------
    InvalidSettings, UnknownName
        If the problem needs more memory than is available, or the objective or a goal does not
        apply to it.
    """
    # Frames predict flips without additional memory.
    inverse = settings.predicts_flips and problem.section is None
    check_memory(problem, evaluators=len(settings.strokes), predict_flips=inverse)
    options = settings.objective, settings.unloaded_beams, elements
    if problem.is_specified:
        if settings.goals or settings.strokes != (1.0,):
            raise InvalidSettings(
                f"goals and strokes: problem {problem.name!r} has a specification; change the "
                "items of its task instead"
            )
        wanted = relaxed(problem) if settings.before_refinement else problem
        return SpecificationEvaluator(wanted, elements, reserve)
    if not settings.goals and settings.strokes == (1.0,):
        return model_evaluator(problem, *options)
    cases = at_strokes(problem, settings.strokes)
    return ConstrainedEvaluator(cases, settings.goals, *options)


def symmetry_groups(problem: Problem, settings: SearchSettings) -> SymmetryGroups:
    """Return the groups of images in which a search flips the beams of a problem.

    Parameters
    ----------
    problem
        Problem of the search.
    settings
        Its settings, whose goals may demand mirror symmetry.
    """
    if problem.specification is not None:
        return SymmetryGroups(problem, problem.specification.symmetry)
    return SymmetryGroups(problem, mirror_axes(map(parse_goal, settings.goals)))


def verification_evaluator(
    problem: Problem, settings: SearchSettings, elements: int | None = None, **changes: Any
) -> Evaluator:
    """Return the evaluator of finished designs: all beams count, and the goals of the search hold.

    Parameters
    ----------
    problem
        Lattice, supports, input and output.
    settings
        Settings of the search.
    elements : int, optional
        As in `bellcrank.mechanics.model_evaluator`.
    changes
        Settings that differ from those of the search.
    """
    changed = replace(settings, **{"unloaded_beams": "keep", **changes})
    return make_evaluator(problem, changed, elements, reserve=0.0)


DENSITIES = (0.9, 0.8, 0.7, 0.6, 0.5)
"""Probabilities with which beams of initial designs are present, in order."""
TRIALS = 20
"""Number of initial designs that are tried with each."""


def with_stable_initial(problem: Problem, settings: SearchSettings) -> Problem:
    """Return a problem whose initial design has a stable response in all load cases.

    If the full lattice snaps, designs with random beams are tried.

    Parameters
    ----------
    problem
        The problem.
    settings
        Settings of the search, with the seed of the random beams.

    Returns
    -------
    Problem
        Unchanged if its own initial design is stable, or if no stable one is found.
    """
    evaluator = make_evaluator(problem, settings)
    found = evaluator.evaluate(evaluator.problem.initial)
    # Fewer beams do not support a mechanism either.
    if found.is_admissible or found.status is Status.MECHANISM:
        return problem
    rng = np.random.default_rng(settings.seed)
    for density in DENSITIES:
        for _ in range(TRIALS):
            beams = evaluator.problem.designable
            mask = evaluator.problem.initial.copy()
            mask[beams] &= rng.random(len(beams)) < density
            if evaluator.evaluate(mask).is_admissible:
                groups = getattr(evaluator, "groups", None)
                return replace(problem, initial=mask if groups is None else groups.expand(mask))
    return problem
