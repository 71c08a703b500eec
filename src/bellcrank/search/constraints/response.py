"""Constraints on the response: output and input stiffness, strain, stability, contact."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import numpy as np

from bellcrank.mechanics import (
    VERIFICATION_INCREMENT,
    Status,
    StrokeEvaluator,
    near_pairs,
    predict_output_stiffness,
)
from bellcrank.search.clearance import printed_beams
from bellcrank.search.constraints.constraint import (
    Constraint,
    ConstraintType,
    DeformedDesign,
    above,
    at_least,
    at_most,
    below,
    bounded,
    constraints,
    counted,
    no_value,
    positive,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics import ModelEvaluator, SpringEvaluator
    from bellcrank.model import Problem

MIN_PREDICTED_VIOLATION = 0.02
"""Smaller predicted violations are within the error of the prediction."""


def stiffness(problem: Problem, bound: float) -> Constraint:
    """Bound the output stiffness at full load from below (`mechanics.output_stiffness`).

    Only the spring model predicts it for flips.
    """

    def predicted(deformed: DeformedDesign, beams: NDArray[np.int64]) -> NDArray[np.float64]:
        springs = cast("SpringEvaluator", deformed.evaluator)
        after = predict_output_stiffness(springs, beams, deformed.mask[beams])
        violation: NDArray[np.float64] = np.maximum(0.0, 1.0 - after / bound)
        return np.where(violation < MIN_PREDICTED_VIOLATION, 0.0, violation)

    return Constraint(
        response_violation=lambda deformed: below(deformed.evaluator.output_stiffness(), bound),
        predicted_violation=predicted if problem.section is None else None,
        evaluation_cost=2,
    )


def strain(_problem: Problem, bound: float) -> Constraint:
    """Bound the strain of every beam at full load from above.

    That of the axis in the spring model, the largest principal strain in frames.
    """
    return Constraint(
        response_violation=lambda deformed: above(deformed.evaluator.largest_strain(), bound),
        evaluation_cost=1,
    )


def input_stiffness(problem: Problem, bound: tuple[str, float]) -> Constraint:
    """Bound the input stiffness 2 E / u^2, with stored energy E and input displacement u.

    A lower bound excludes designs that are nearly mechanisms.

    Raises
    ------
    ValueError
        If the input is driven by a force.
    """
    if problem.input.drive != "displacement":
        raise ValueError("the input is driven by a force; expected a displacement")
    squared = problem.input.amount**2
    violation = above if bound[0] == "<=" else below
    return Constraint(
        response_violation=lambda deformed: violation(
            2.0 * deformed.response.energy / squared, bound[1]
        ),
        evaluation_cost=1,
    )


def no_snapping(_problem: Problem, _value: None) -> Constraint:
    """Require stability along the whole stroke, followed in small increments.

    All searches reject designs that snap, but they follow the stroke in larger increments and
    miss about one design in a hundred among those near a loss of stability.
    """
    # Separate evaluators: the one that holds the response must keep its equilibrium.
    verifiers: dict[ModelEvaluator, ModelEvaluator] = {}

    def violation(deformed: DeformedDesign) -> float:
        evaluator = deformed.evaluator
        if evaluator not in verifiers:
            verifiers[evaluator] = evaluator.for_problem(evaluator.problem)
        verified = verifiers[evaluator].evaluate(deformed.mask, VERIFICATION_INCREMENT)
        return float(verified.status is not Status.CONVERGED)

    return Constraint(response_violation=violation, evaluation_cost=4)


def optional_width(rest: str) -> float:
    """Parse an optional number above 0."""
    return positive(rest) if rest else 0.0


def no_contact(_problem: Problem, width: float) -> Constraint:
    """Require that no two struts cross or, with a width, come nearer to each other than it.

    Each crossing is a fault; a pair at distance d < width counts 1 - d / width. Designs that are
    verified are checked along the whole stroke, where the state with most faults counts; others
    at full load only.
    """
    # Separate evaluators: the one that holds the response must keep its equilibrium.
    strokes: dict[ModelEvaluator, StrokeEvaluator] = {}

    def faults(positions: NDArray[np.float64], struts: NDArray[np.int64]) -> float:
        _, distance = near_pairs(positions, struts, width)
        return float(np.sum(1.0 - distance / width)) if width else float(len(distance))

    def violation(deformed: DeformedDesign) -> float:
        problem = deformed.evaluator.problem
        chosen = printed_beams(problem, deformed.mask, deformed.core)
        struts = problem.lattice.beams[chosen]
        worst = faults(deformed.positions, struts)
        if deformed.verified:
            evaluator = deformed.evaluator
            if evaluator not in strokes:
                strokes[evaluator] = StrokeEvaluator(evaluator)
            rest = evaluator.problem.lattice.positions
            for _, displacement in strokes[evaluator].displacements(deformed.mask):
                worst = max(worst, faults(rest + displacement, struts))
        return counted(worst)

    return Constraint(response_violation=violation, evaluation_cost=3)


for _name, _usage, _parse, _make in (
    ("stiffness", "'stiffness >= NUMBER', the number above 0", at_least, stiffness),
    (
        "input-stiffness", "'input-stiffness <= NUMBER' or '>= NUMBER', above 0",
        bounded, input_stiffness,
    ),
    ("strain", "'strain <= NUMBER', the number above 0", at_most, strain),
    ("no-snapping", "'no-snapping' alone", no_value, no_snapping),
    (
        "no-contact", "'no-contact', or 'no-contact NUMBER' with a width above 0",
        optional_width, no_contact,
    ),
):  # fmt: skip
    constraints.register(_name)(ConstraintType(_usage, _parse, _make))
