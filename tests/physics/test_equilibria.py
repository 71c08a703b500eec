"""The compiled equilibria equal those of an independent solver, however they are reached."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import Problem, Supports, find_problem

from .problems import patch, random_masks
from .twin import Twin, solve

if TYPE_CHECKING:
    from numpy.typing import NDArray


def cases() -> dict[str, tuple[Problem, list[NDArray[np.bool_]]]]:
    rollers = replace(patch(), supports=Supports(fixed=[0, 1], fixed_x=[4, 8], fixed_y=[2, 3]))
    small, crane = find_problem("scaling-8"), find_problem("crane")
    return {
        "patch": (patch(), random_masks(patch(), 0.85, 6)),
        "force": (patch(force=True), random_masks(patch(), 0.9, 4)),
        "isotropic": (patch(force=True, kind="isotropic"), random_masks(patch(), 0.9, 4)),
        "rollers": (rollers, random_masks(rollers, 0.9, 4)),
        "scaling-8": (small, [small.initial, *random_masks(small, 0.75, 2)]),
        "crane": (crane, [crane.initial, *random_masks(crane, 0.8, 1)]),
    }


@pytest.mark.parametrize("name", ["patch", "force", "isotropic", "rollers"])
def test_equilibria_equal_those_of_the_dense_twin(name: str) -> None:
    problem, masks = cases()[name]
    evaluator = SpringEvaluator(problem)
    compared = 0
    for mask in masks:
        response = evaluator.evaluate(mask)
        if response.status is not Status.CONVERGED:
            continue
        moves = evaluator.structure.active == 1
        expected = solve(Twin(problem, mask), moves)
        np.testing.assert_allclose(response.displacement[moves], expected[moves], atol=1e-8)
        compared += 1
    assert compared >= 2


def test_a_warm_start_reaches_the_equilibrium_reached_from_rest() -> None:
    problem = patch()
    rest, warm = SpringEvaluator(problem), SpringEvaluator(problem)
    mask = problem.initial.copy()
    warm.evaluate(mask)
    warm.set_reference()
    rng = np.random.default_rng(2)
    for beam in rng.choice(problem.designable, 20):
        mask[beam] ^= True
        expected, found = rest.evaluate(mask), warm.evaluate(mask, warm_start=True)
        warm.set_reference()
        assert found.status is expected.status
        assert found.efficiency == pytest.approx(expected.efficiency, abs=1e-8, nan_ok=True)


def test_smaller_load_increments_change_nothing() -> None:
    for problem, masks in cases().values():
        evaluator = SpringEvaluator(problem)
        for mask in masks:
            coarse, fine = evaluator.evaluate(mask), evaluator.evaluate(mask, 1 / 64)
            assert coarse.status is fine.status
            assert coarse.efficiency == pytest.approx(fine.efficiency, abs=1e-8, nan_ok=True)
