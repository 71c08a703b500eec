"""Terms of the response: how stiff the output is, how far beams stretch, whether it snaps."""

from __future__ import annotations

from typing import TYPE_CHECKING, get_args

import numpy as np

from bellcrank.mechanics import (
    VERIFICATION_INCREMENT,
    SpringEvaluator,
    Status,
    UnloadedBeams,
    foresee_stiffness,
    output_stiffness,
)
from bellcrank.search.goals.terms import (
    Kind,
    Moved,
    Term,
    above,
    at_least,
    at_most,
    below,
    bounded,
    nothing,
)
from bellcrank.search.goals.terms import terms as registry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem

LEAST_FORESEEN = 0.02
"""Smaller excesses that are foreseen are within the error of the prediction."""


def stiffness(_problem: Problem, bound: float) -> Term:
    """At least so stiff an output at full load: see `bellcrank.mechanics.output_stiffness`."""

    def foreseen(moved: Moved, beams: NDArray[np.int64]) -> NDArray[np.float64]:
        after = foresee_stiffness(moved.evaluator, beams, moved.mask[beams])
        excess: NDArray[np.float64] = np.maximum(0.0, 1.0 - after / bound)
        return np.where(excess < LEAST_FORESEEN, 0.0, excess)

    return Term(
        of_response=lambda moved: below(output_stiffness(moved.evaluator), bound),
        foreseen=foreseen,
        price=2,
    )


def largest_strain(moved: Moved) -> float:
    """Return the largest stretch or shortening of a load-bearing beam, by its rest length."""
    lattice = moved.evaluator.problem.lattice
    beams, rest = lattice.beams[moved.core], lattice.rest_length[moved.core]
    if not len(beams):
        return 0.0
    ends = moved.positions[beams]
    return float((np.abs(np.hypot(*(ends[:, 1] - ends[:, 0]).T) - rest) / rest).max())


def strain(_problem: Problem, bound: float) -> Term:
    """At most so large a strain in any beam at full load."""
    return Term(of_response=lambda moved: above(largest_strain(moved), bound), price=1)


def input_stiffness(problem: Problem, wanted: tuple[str, float]) -> Term:
    """At most or at least so stiff an input: 2 E / u^2, E the energy of the stroke, u the motion.

    A least one keeps a search away from mechanisms that merely follow the input.
    """
    if problem.input.drive != "displacement":
        raise ValueError("the input is driven by a force, and moves as far as that takes it")
    squared = problem.input.amount**2
    excess = above if wanted[0] == "<=" else below
    return Term(
        of_response=lambda moved: excess(2.0 * moved.response.energy / squared, wanted[1]),
        price=1,
    )


def no_snapping(_problem: Problem, _nothing: None) -> Term:
    """Stable along the whole stroke, followed in small increments.

    All searches refuse what snaps; they follow the path in longer strides, and overlook one
    design in a hundred among those near a loss of stability.
    """
    # One of its own: the evaluator that holds the response must not forget it.
    careful: dict[tuple[float, int], SpringEvaluator] = {}

    def of_response(moved: Moved) -> float:
        given = moved.evaluator
        key = (given.problem.input.amount, given.core)
        if key not in careful:
            careful[key] = SpringEvaluator(
                given.problem, "displacement", get_args(UnloadedBeams)[given.core]
            )
        return float(
            careful[key].evaluate(moved.mask, VERIFICATION_INCREMENT).status is not Status.CONVERGED
        )

    return Term(of_response=of_response, price=4)


registry.register("stiffness")(
    Kind("'stiffness >= NUMBER', the number above 0", at_least, stiffness)
)
registry.register("input-stiffness")(
    Kind("'input-stiffness <= NUMBER' or '>= NUMBER', above 0", bounded, input_stiffness)
)
registry.register("strain")(Kind("'strain <= NUMBER', the number above 0", at_most, strain))
registry.register("no-snapping")(Kind("'no-snapping' alone", nothing, no_snapping))
