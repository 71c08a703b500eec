"""Evaluator of searches with constraints, several strokes or several load cases."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import (
    VERIFICATION_INCREMENT,
    FlipPrediction,
    Response,
    Status,
    UnloadedBeams,
    model_evaluator,
)
from bellcrank.search.constraints.cases import LoadCase, check_compatible
from bellcrank.search.constraints.constraint import (
    TOLERANCE,
    DeformedDesign,
    mirror_axes,
    parse_goal,
)
from bellcrank.search.symmetry import SymmetryGroups
from bellcrank.search.verdict import Verdict

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bellcrank.mechanics import ModelEvaluator
    from bellcrank.search.constraints.constraint import Constraint

BASE_PENALTY = 100.0
"""Penalty of any violation, larger than any efficiency."""
VIOLATION_WEIGHT = 30.0
"""Penalty of a violation of 1 on top of the base penalty. It sets the weight of the violation
against the efficiency while constraints are violated."""
PROHIBITIVE = -100.0
"""Predicted change of the score by a flip that is certain to violate a constraint."""


def penalty_of(violation: float) -> float:
    """Return the penalty that is subtracted from the efficiency for a total violation.

    Examples
    --------
    >>> penalty_of(0.0), penalty_of(0.25)
    (0.0, 107.5)
    """
    return BASE_PENALTY + VIOLATION_WEIGHT * violation if violation > TOLERANCE else 0.0


def without_base_penalty(score: float) -> float:
    """Return a score without the base penalty of a violation.

    Examples
    --------
    >>> without_base_penalty(-104.5), without_base_penalty(4.5)
    (-4.5, 4.5)
    """
    return score + BASE_PENALTY if score < -0.5 * BASE_PENALTY else score


class ConstrainedEvaluator:
    """Weighted mean of the efficiencies of a design in several load cases, under constraints.

    The score of a design with total violation v > 0 is reduced by ``100 + 30 v``, so a search
    first satisfies its constraints and never violates them again for efficiency. Until then, a
    warm start forbids designs with a larger violation than the reference: first by the beams
    alone, without a response, and then with the response, expensive constraints last.

    With the constraint ``mirror``, mirror images are flipped together: the lowest beam of each
    group represents all, and is the only designable one in `problem` (`groups`).

    Parameters
    ----------
    cases
        Load cases; response and flip prediction are those of the first.
    goals
        Texts such as ``"mass <= 0.6"``.
    objective, unloaded_beams, elements
        As in `bellcrank.mechanics.model_evaluator`.

    Raises
    ------
    InvalidSettings, UnknownName
        If the cases are incompatible, or a goal is invalid or does not apply.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> evaluator = ConstrainedEvaluator([LoadCase(find_problem("crane"))], ["mass <= 0.75"])
    >>> response = evaluator.evaluate(evaluator.problem.initial)
    >>> response.status.label, round(response.efficiency, 6), round(response.score, 6)
    ('unmet', -0.064086, -107.564086)
    """

    def __init__(
        self,
        cases: Sequence[LoadCase],
        goals: Sequence[str] = (),
        objective: str | None = None,
        unloaded_beams: UnloadedBeams = "keep",
        elements: int | None = None,
    ) -> None:
        check_compatible(cases)
        self.cases = list(cases)
        self.goals = tuple(goals)
        self.weights = [case.weight / sum(case.weight for case in cases) for case in cases]
        self.evaluators = [
            model_evaluator(case.problem, objective, unloaded_beams, elements) for case in cases
        ]
        self._cores = [evaluator.core_finder() for evaluator in self.evaluators]
        original = cases[0].problem
        parsed = [parse_goal(goal) for goal in goals]
        # One constraint per case, since supports, input and output may differ.
        made = [(goal.text, [goal.constraint(case.problem) for case in cases]) for goal in parsed]
        self._constraints: list[tuple[str, list[Constraint]]] = sorted(
            made, key=lambda pair: pair[1][0].evaluation_cost
        )
        self._limits_structure = any(
            each.structure_violation is not None for _, made in self._constraints for each in made
        )
        self.groups = SymmetryGroups(original, mirror_axes(parsed))
        self.problem = self.groups.problem
        self._violation = self._reference_violation = math.inf
        self._efficiencies = [math.nan] * len(cases)
        self._deformed: list[DeformedDesign] = []

    def evaluate(
        self,
        mask: NDArray[np.bool_],
        largest_increment: float = 1.0,
        *,
        warm_start: bool = False,
        lower_bound: float = -math.inf,
    ) -> Response:
        """Return the response of a design; its status is UNMET if it violates constraints.

        With a warm start, a design with a larger violation than the reference is FORBIDDEN.

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
        design = self.groups.expand(mask)
        violation = self._structure_violation(design)
        if not warm_start:
            return self._evaluate_cases(
                design, violation,
                lambda evaluator: evaluator.evaluate(design, largest_increment),
                verified=largest_increment <= VERIFICATION_INCREMENT,
            )  # fmt: skip
        if violation > self._reference_violation + TOLERANCE:
            nowhere = np.zeros_like(self.problem.lattice.positions)
            return Response(Verdict.FORBIDDEN, math.nan, math.nan, nowhere, penalty_of(violation))
        single = len(self.cases) == 1 and self.cases[0].target is None
        bound = lower_bound + penalty_of(violation) if single else -math.inf
        return self._evaluate_cases(
            design, violation,
            lambda evaluator: evaluator.evaluate(design, warm_start=True, lower_bound=bound),
            self._reference_violation,
            lower_bound,
        )  # fmt: skip

    def set_reference(self) -> None:
        """Make the design evaluated last the reference of warm starts and of violations."""
        for evaluator in self.evaluators:
            evaluator.set_reference()
        self._reference_violation = self._violation

    def predict_flips(self, mask: NDArray[np.bool_]) -> FlipPrediction | None:
        """Predict the effect of each flip on the score of the design evaluated last.

        The changes by mirror images, which are flipped together, are added. Only constraints
        with a prediction contribute.
        """
        design = self.groups.expand(mask)
        change, strain = np.zeros(len(self.groups.members)), np.zeros(len(self.groups.members))
        for index, evaluator in enumerate(self.evaluators):
            prediction = evaluator.predict_flips(design, self.groups.members)
            if prediction is None:
                return None
            value = self.cases[index].change(self._efficiencies[index], prediction.change)
            change += self.weights[index] * value
            strain = np.maximum(strain, np.abs(prediction.strain))
        total = self.groups.total(change)
        if self._constraints:
            total = total + self._predicted_penalties(design, total)
        return FlipPrediction(self.groups.beams, total, self.groups.largest(strain))

    def violated(self, mask: NDArray[np.bool_]) -> list[str]:
        """Return the goals that a design with a stable response violates."""
        design = self.groups.expand(mask)
        core = self._core(design)
        responses = [e.evaluate(design, VERIFICATION_INCREMENT) for e in self.evaluators]
        deformed = self._deformed_by(design, responses, verified=True)
        return [
            text
            for text, made in self._constraints
            if _structure_violation(made, design, core) + _response_violation(made, deformed)
            > TOLERANCE
        ]

    def _core(self, design: NDArray[np.bool_]) -> NDArray[np.bool_]:
        core = self._cores[0](design)
        for other in self._cores[1:]:
            core |= other(design)
        return core

    def _structure_violation(self, design: NDArray[np.bool_]) -> float:
        """Return the violation that follows from the beams alone."""
        if not self._limits_structure:
            return 0.0
        core = self._core(design)
        return sum(_structure_violation(made, design, core) for _, made in self._constraints)

    def _deformed_by(
        self,
        design: NDArray[np.bool_],
        responses: list[Response],
        *,
        verified: bool,
    ) -> list[DeformedDesign]:
        core = self._core(design)
        return [
            DeformedDesign(evaluator, design, core, response, verified)
            for evaluator, response in zip(self.evaluators, responses, strict=True)
        ]

    def _evaluate_cases(
        self,
        design: NDArray[np.bool_],
        violation: float,
        respond: Callable[[ModelEvaluator], Response],
        largest_violation: float = math.inf,
        lower_bound: float = -math.inf,
        *,
        verified: bool = False,
    ) -> Response:
        """Compute the response of every case, then the violations that depend on it."""
        self._violation = math.inf
        responses = []
        for evaluator in self.evaluators:
            responses.append(respond(evaluator))
            if responses[-1].status is not Status.CONVERGED:
                return replace(responses[-1], penalty=penalty_of(violation))
        self._efficiencies = [response.efficiency for response in responses]
        efficiency = math.fsum(
            weight * case.value(value)
            for weight, case, value in zip(
                self.weights, self.cases, self._efficiencies, strict=True
            )
        )
        response = replace(responses[0], efficiency=efficiency)
        deformed = self._deformed_by(design, responses, verified=verified)
        self._deformed = deformed
        for _, made in self._constraints:
            if efficiency - penalty_of(violation) <= lower_bound:
                return replace(response, status=Status.UNVERIFIED, penalty=penalty_of(violation))
            violation += _response_violation(made, deformed)
            if violation > largest_violation + TOLERANCE:
                return replace(response, status=Verdict.FORBIDDEN, penalty=penalty_of(violation))
        self._violation = violation
        status = Verdict.UNMET if penalty_of(violation) else Status.CONVERGED
        return replace(response, status=status, penalty=penalty_of(violation))

    def _predicted_penalties(
        self, design: NDArray[np.bool_], change: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the predicted change of the score by the changes of violations.

        It is zero for flips that change no load-bearing beam.
        """
        core = self._core(design)
        increase = np.zeros(len(change))
        for _, made in self._constraints:
            if (flip_change := made[0].flip_change) is not None:
                increase += self.groups.total(flip_change(core)[self.groups.members])
        satisfied = self._violation <= TOLERANCE
        penalty = np.where(
            satisfied & (increase > TOLERANCE), PROHIBITIVE, -VIOLATION_WEIGHT * increase
        )
        for _, made in self._constraints:
            predicted = _predicted_increase(made, self._deformed, self.groups.members)
            if predicted is not None:
                penalty -= VIOLATION_WEIGHT * self.groups.total(predicted)
        return np.where(change != 0.0, penalty, 0.0)


def _predicted_increase(
    made: list[Constraint], deformed: list[DeformedDesign], beams: NDArray[np.int64]
) -> NDArray[np.float64] | None:
    """Return the predicted increase of a violation by the flip of each beam."""
    after = [
        constraint.predicted_violation(one, beams)
        for constraint, one in zip(made, deformed, strict=True)
        if constraint.predicted_violation is not None
    ]
    if not after:
        return None
    increase: NDArray[np.float64] = np.maximum.reduce(after) - _response_violation(made, deformed)
    return increase


def _structure_violation(
    made: list[Constraint], design: NDArray[np.bool_], core: NDArray[np.bool_]
) -> float:
    """Return the largest violation over the cases that follows from the beams alone."""
    return max(
        (
            constraint.structure_violation(design, core)
            for constraint in made
            if constraint.structure_violation is not None
        ),
        default=0.0,
    )


def _response_violation(made: list[Constraint], deformed: list[DeformedDesign]) -> float:
    """Return the largest violation over the cases that depends on the response."""
    return max(
        (
            constraint.response_violation(one)
            for constraint, one in zip(made, deformed, strict=True)
            if constraint.response_violation is not None
        ),
        default=0.0,
    )
