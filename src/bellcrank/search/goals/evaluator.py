"""Answers the questions of a search that has goals, several strokes or several load cases."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import (
    VERIFICATION_INCREMENT,
    Core,
    FlipPrediction,
    Response,
    SpringEvaluator,
    Status,
    UnloadedBeams,
)
from bellcrank.search.goals.cases import Case, check_alike
from bellcrank.search.goals.mirror import orbits_of
from bellcrank.search.goals.terms import SMALLEST_EXCESS, Moved, read_goal
from bellcrank.search.verdict import Verdict

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bellcrank.search.goals.terms import Term
    from bellcrank.storage import Proposals

BROKEN = 100.0
"""Penalty of any broken goal: no efficiency outweighs it."""
WEIGHT = 30.0
"""Penalty of an excess of 1, on top of that: how the way to the goals is weighed against
efficiency as long as they are broken."""
PROHIBITIVE = -100.0
"""Predicted change of a flip that is known to break a goal."""


def penalty_of(excess: float) -> float:
    """Return what is taken off the efficiency of a design that breaks goals.

    Examples
    --------
    >>> penalty_of(0.0), penalty_of(0.25)
    (0.0, 107.5)
    """
    return BROKEN + WEIGHT * excess if excess > SMALLEST_EXCESS else 0.0


class GoalEvaluator:
    """The weighted mean of the efficiencies of one design in several cases, and its goals.

    A design that breaks goals by some excess loses ``100 + 30 excess`` of its score, so that a
    search first finds its way to the goals and never leaves them for efficiency. On the way,
    a warm start forbids what has a larger excess than the reference design: first by the beams
    alone, without a response, and then with it, dear terms last.

    Mirror images are flipped together: the lowest beam of each group stands for all, and is the
    only one that `problem` calls designable. `expanded` gives the design that is meant.

    Parameters
    ----------
    cases
        What is asked of a design; response and screening are those of the first.
    goals
        Texts such as ``"mass <= 0.6"``.
    objective, unloaded_beams
        As in `SpringEvaluator`.

    Raises
    ------
    InvalidSettings, UnknownName
        If the cases are not about the same designs, or a goal makes no sense.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> evaluator = GoalEvaluator([Case(find_problem("crane"))], ["mass <= 0.75"])
    >>> response = evaluator.evaluate(evaluator.problem.initial)
    >>> response.status.label, round(response.efficiency, 6), round(response.score, 6)
    ('unmet', -0.064086, -107.564086)
    """

    def __init__(
        self,
        cases: Sequence[Case],
        goals: Sequence[str] = (),
        objective: str | None = None,
        unloaded_beams: UnloadedBeams = "keep",
    ) -> None:
        check_alike(cases)
        self.cases = list(cases)
        self.goals = tuple(goals)
        self.weights = [case.weight / sum(case.weight for case in cases) for case in cases]
        self.evaluators = [
            SpringEvaluator(case.problem, objective, unloaded_beams) for case in cases
        ]
        self._cores = [Core(evaluator) for evaluator in self.evaluators]
        original = cases[0].problem
        read = [read_goal(goal) for goal in goals]
        # One term for each case, since regions may differ.
        made = [(goal.text, [goal.term(case.problem) for case in cases]) for goal in read]
        self._terms: list[tuple[str, list[Term]]] = sorted(made, key=lambda pair: pair[1][0].price)
        axes = [goal.value for goal in read if goal.name == "mirror"]
        self._members = original.designable
        self._orbits = orbits_of(original, axes) if axes else original.designable
        self.problem = original
        if axes:
            closed = self.closed(original.initial)
            self.problem = replace(original, initial=closed, designable=np.unique(self._orbits))
        self._excess = self._remembered = math.inf
        self._value = [math.nan] * len(cases)
        self._moved_last: list[Moved] = []

    def expanded(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return the design that is meant: each beam as the lowest of its mirror images."""
        design = np.asarray(mask, dtype=bool).copy()
        design[..., self._members] = design[..., self._orbits]
        return design

    def closed(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return a design with all mirror images of the beams that it has."""
        design = mask.copy()
        chosen = np.unique(self._orbits[mask[self._members]])
        design[self._members] = np.isin(self._orbits, chosen)
        return design

    def as_meant(self, proposals: Proposals) -> Proposals:
        """Return recorded proposals with the designs that were meant."""
        if np.array_equal(self._members, self._orbits):
            return proposals
        count = self.problem.lattice.beam_count
        bits = np.unpackbits(proposals.mask, axis=1)[:, :count].astype(bool)
        return proposals._replace(mask=np.packbits(self.expanded(bits), axis=1))

    def evaluate(
        self,
        mask: NDArray[np.bool_],
        largest_increment: float = 1.0,
        *,
        warm_start: bool = False,
        lower_bound: float = -math.inf,
    ) -> Response:
        """Return the response of a design; its status is UNMET if it violates goals.

        With a warm start, a design that violates goals more than the reference is FORBIDDEN.

        Parameters
        ----------
        mask : (M,) bool
        largest_increment
            Upper bound on the load increments, as a fraction of the full load.
        warm_start
            Start from the reference (`set_reference`).
        lower_bound
            With a warm start, a design of no higher score has the status UNVERIFIED.
        """
        design = self.expanded(mask)
        core = self._core(design)
        if warm_start:
            return self._evaluate_warm(design, core, lower_bound)
        return self._judged(
            design,
            core,
            self._excess_of_beams(design, core),
            lambda evaluator: evaluator.evaluate(design, largest_increment),
            verified=largest_increment <= VERIFICATION_INCREMENT,
        )

    def _evaluate_warm(
        self, design: NDArray[np.bool_], core: NDArray[np.bool_], lower_bound: float
    ) -> Response:
        excess = self._excess_of_beams(design, core)
        if excess > self._remembered + SMALLEST_EXCESS:
            nowhere = np.zeros_like(self.problem.lattice.positions)
            return Response(Verdict.FORBIDDEN, math.nan, math.nan, nowhere, penalty_of(excess))
        alone = len(self.cases) == 1 and self.cases[0].wanted is None
        floor = lower_bound + penalty_of(excess) if alone else -math.inf
        return self._judged(
            design,
            core,
            excess,
            lambda evaluator: evaluator.evaluate(design, warm_start=True, lower_bound=floor),
            self._remembered,
            lower_bound,
        )

    def set_reference(self) -> None:
        """Keep the design evaluated last as the one to start from, and to be no worse than."""
        for evaluator in self.evaluators:
            evaluator.set_reference()
        self._remembered = self._excess

    def predict_flips(self, mask: NDArray[np.bool_]) -> FlipPrediction | None:
        """Predict what each flip would do to the score of the design evaluated last.

        Mirror images are flipped together, and what each does alone is added up. Of the goals
        only those whose terms foresee something count, once each.
        """
        design = self.expanded(mask)
        change, strain = np.zeros(len(self._members)), np.zeros(len(self._members))
        for index, evaluator in enumerate(self.evaluators):
            screening = evaluator.predict_flips(design, self._members)
            if screening is None:
                return None
            value = self.cases[index].change(self._value[index], screening.change)
            change += self.weights[index] * value
            strain = np.maximum(strain, np.abs(screening.strain))
        beams, place = np.unique(self._orbits, return_inverse=True)
        total: NDArray[np.float64] = np.bincount(place, change).astype(float)
        together = np.zeros(len(beams))
        np.maximum.at(together, place, strain)
        if self._terms:
            total = total + self._foreseen(design, place, total)
        return FlipPrediction(beams, total, together)

    def broken(self, mask: NDArray[np.bool_]) -> list[str]:
        """Return the goals that a design with a stable response breaks."""
        design = self.expanded(mask)
        core = self._core(design)
        responses = [
            evaluator.evaluate(design, VERIFICATION_INCREMENT) for evaluator in self.evaluators
        ]
        moved = self._moved(design, core, responses, verified=True)
        return [
            text
            for text, made in self._terms
            if _of_beams(made, design, core) + _of_response(made, moved) > SMALLEST_EXCESS
        ]

    def _core(self, design: NDArray[np.bool_]) -> NDArray[np.bool_]:
        core = self._cores[0].of(design)
        for other in self._cores[1:]:
            core |= other.of(design)
        return core

    def _excess_of_beams(self, design: NDArray[np.bool_], core: NDArray[np.bool_]) -> float:
        return sum(_of_beams(made, design, core) for _, made in self._terms)

    def _moved(
        self,
        design: NDArray[np.bool_],
        core: NDArray[np.bool_],
        responses: list[Response],
        *,
        verified: bool,
    ) -> list[Moved]:
        return [
            Moved(evaluator, design, core, response, verified)
            for evaluator, response in zip(self.evaluators, responses, strict=True)
        ]

    def _judged(
        self,
        design: NDArray[np.bool_],
        core: NDArray[np.bool_],
        excess: float,
        answer: Callable[[SpringEvaluator], Response],
        most: float = math.inf,
        least: float = -math.inf,
        *,
        verified: bool = False,
    ) -> Response:
        """Ask every case for its response, and the terms what they think of it."""
        self._excess = math.inf
        responses = []
        for evaluator in self.evaluators:
            responses.append(answer(evaluator))
            if responses[-1].status is not Status.CONVERGED:
                return replace(responses[-1], penalty=penalty_of(excess))
        self._value = [response.efficiency for response in responses]
        efficiency = math.fsum(
            weight * case.value(value)
            for weight, case, value in zip(self.weights, self.cases, self._value, strict=True)
        )
        response = replace(responses[0], efficiency=efficiency)
        moved = self._moved_last = self._moved(design, core, responses, verified=verified)
        for _, made in self._terms:
            if efficiency - penalty_of(excess) <= least:
                return replace(response, status=Status.UNVERIFIED, penalty=penalty_of(excess))
            excess += _of_response(made, moved)
            if excess > most + SMALLEST_EXCESS:
                return replace(response, status=Verdict.FORBIDDEN, penalty=penalty_of(excess))
        self._excess = excess
        status = Verdict.UNMET if penalty_of(excess) else Status.CONVERGED
        return replace(response, status=status, penalty=penalty_of(excess))

    def _foreseen(
        self, design: NDArray[np.bool_], place: NDArray[np.int64], change: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the change of the score by what flips are foreseen to do to the excess.

        Nothing for flips that no load can feel: they add and remove no load-bearing beam.
        """
        core = self._core(design)
        excess = np.zeros(len(change))
        for _, made in self._terms:
            if (by_flip := made[0].by_flip) is not None:
                excess += np.bincount(place, by_flip(core)[self._members])
        felt = change != 0.0
        kept = self._excess <= SMALLEST_EXCESS
        gain = np.where(kept & (excess > SMALLEST_EXCESS), PROHIBITIVE, -WEIGHT * excess)
        for _, made in self._terms:
            rise = _foreseen_rise(made, self._moved_last, self._members)
            if rise is not None:
                gain -= WEIGHT * np.bincount(place, rise)
        return np.where(felt, gain, 0.0)


def _foreseen_rise(
    made: list[Term], moved: list[Moved], beams: NDArray[np.int64]
) -> NDArray[np.float64] | None:
    """Return what the flip of each beam is foreseen to add to the excess of a goal."""
    after = [
        term.foreseen(one, beams)
        for term, one in zip(made, moved, strict=True)
        if term.foreseen is not None
    ]
    if not after:
        return None
    rise: NDArray[np.float64] = np.maximum.reduce(after) - _of_response(made, moved)
    return rise


def _of_beams(made: list[Term], design: NDArray[np.bool_], core: NDArray[np.bool_]) -> float:
    """Return the excess of a goal in the worst case, as far as the beams tell."""
    return max(
        (term.of_beams(design, core) for term in made if term.of_beams is not None), default=0.0
    )


def _of_response(made: list[Term], moved: list[Moved]) -> float:
    """Return the excess of a goal in the worst case, as far as the response tells."""
    return max(
        (
            term.of_response(one)
            for term, one in zip(made, moved, strict=True)
            if term.of_response is not None
        ),
        default=0.0,
    )
