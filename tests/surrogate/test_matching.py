"""A trained network is used for its own problem only."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank.campaign.dataset import reverse
from bellcrank.errors import InvalidModel, InvalidProblem
from bellcrank.model import Lattice, Section, Stiffness, Supports, find_problem
from bellcrank.surrogate.matching import require_same_problem
from bellcrank.surrogate.predictor import Predictor, load_predictor

from .helpers import random_masks, untrained

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bellcrank.model import Problem


def nudged(problem: Problem) -> Problem:
    positions = problem.lattice.positions.copy()
    positions[40, 0] += 2e-4
    return replace(problem, lattice=Lattice(positions, problem.lattice.beams))


def rewired(problem: Problem) -> Problem:
    beams = problem.lattice.beams.copy()
    ends = {tuple(sorted(pair)) for pair in beams.tolist()}
    far = next(n for n in range(problem.lattice.node_count) if (0, n) not in ends and n > 20)
    beams[100] = [0, far]
    return replace(problem, lattice=Lattice(problem.lattice.positions, beams))


def stiffer(problem: Problem) -> Problem:
    return replace(problem, stiffness=Stiffness(problem.stiffness.bond, 0.1001))


def rolling(problem: Problem) -> Problem:
    fixed = problem.supports.fixed
    return replace(problem, supports=Supports(fixed=fixed[1:], fixed_x=fixed[:1]))


def fewer_outputs(problem: Problem) -> Problem:
    output = problem.output
    return replace(
        problem, output=replace(output, nodes=output.nodes[1:], direction=output.direction[1:])
    )


def loaded(problem: Problem) -> Problem:
    return replace(problem, output=replace(problem.output, spring=0.1))


def turned(problem: Problem) -> Problem:
    output = replace(problem.output, direction=problem.output.direction[:, ::-1])
    return replace(problem, output=output)


def further(problem: Problem) -> Problem:
    return replace(problem, input=replace(problem.input, amount=1.001 * problem.input.amount))


def forced(problem: Problem) -> Problem:
    return replace(problem, input=replace(problem.input, drive="force"))


CHANGES: list[tuple[Callable[[Any], Any], str]] = [
    (nudged, "nodes or beams"),
    (rewired, "nodes or beams"),
    (stiffer, r"stiffness of joints .* 0\.1 in training, 0\.1001 here"),
    (rolling, r"support \(fixed\)"),
    (fewer_outputs, "output region"),
    (loaded, r"output spring .* None in training, 0\.1 here"),
    (turned, "output direction"),
    (reverse, "output direction"),
    (further, "amount"),
    (forced, "drive"),
    (lambda problem: replace(problem, aggregate="sum"), "aggregate"),
    (
        lambda problem: replace(problem, section=Section(0.2, 0.5)),
        r"cross-section .* None in training, Section",
    ),
    (
        lambda problem: replace(problem, objective="directional:4"),
        r"exponent of the objective .* 2\.0 in training, 4\.0 here",
    ),
    (lambda _: find_problem("crane"), r"with 125 nodes and 219 beams|nodes and .* has 133 and 352"),
]


@pytest.mark.parametrize(("change", "message"), CHANGES)
def test_another_problem_is_refused_and_the_reason_given(
    problem: Problem, change: Callable[[Problem], Problem], message: str
) -> None:
    with pytest.raises(InvalidModel, match=message):
        require_same_problem(problem, change(problem))


def test_the_stiffness_of_very_soft_joints_is_compared(problem: Problem) -> None:
    soft, softer = (replace(problem, stiffness=Stiffness(5.0, angle)) for angle in (2e-5, 1e-5))
    with pytest.raises(InvalidModel, match="stiffness of joints"):
        require_same_problem(soft, softer)


def test_naming_the_usual_objective_changes_nothing(problem: Problem) -> None:
    named = replace(problem, objective="displacement")
    require_same_problem(problem, named)
    pliers = find_problem("pliers")
    require_same_problem(pliers, replace(pliers, objective="force"))
    with pytest.raises(InvalidModel, match="objective"):
        require_same_problem(pliers, replace(pliers, objective="displacement"))


def test_predictions_need_masks_of_the_problem(
    problem: Problem, crane: Problem, tmp_path: Path
) -> None:
    predictor = Predictor(problem, untrained(problem), device="cpu")
    assert predictor.predict(random_masks(problem, 6)[:0]).shape == (0,)
    for wrong in (np.ones((2, 352), bool), np.ones(219, bool), np.ones((2, 219))):
        with pytest.raises(InvalidProblem, match=r"masks: expected booleans of shape \(n, 219\)"):
            predictor.predict(wrong)  # type: ignore[arg-type]
    path = tmp_path / "model.safetensors"
    untrained(problem).write(path)
    assert load_predictor(problem, path, device="cpu").predict(random_masks(problem, 2)).std()
    with pytest.raises(InvalidModel, match="'scaling-8'"):
        load_predictor(crane, path)
