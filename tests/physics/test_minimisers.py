"""Newton, conjugate gradients and FIRE find the same equilibria."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.mechanics import SpringEvaluator, minimisers
from bellcrank.model import Problem, Supports, find_problem

from .problems import patch, random_masks

if TYPE_CHECKING:
    from numpy.typing import NDArray

SAME = 1e-6
FIRST_ORDER = [name for name in minimisers if name != "newton"]


def cases() -> dict[str, tuple[Problem, list[NDArray[np.bool_]]]]:
    rollers = replace(patch(), supports=Supports(fixed=[0, 1], fixed_x=[4, 8], fixed_y=[2, 3]))
    small = find_problem("scaling-8")
    crane = find_problem("crane")
    return {
        "patch": (patch(), random_masks(patch(), 0.85, 6)),
        "force": (patch(force=True), random_masks(patch(), 0.9, 4)),
        "isotropic": (
            patch(force=True, kind="isotropic"),
            random_masks(patch(), 0.9, 4),
        ),
        "rollers": (rollers, random_masks(rollers, 0.9, 4)),
        "scaling-8": (small, [small.initial, *random_masks(small, 0.75, 2)]),
        "crane": (crane, [crane.initial, *random_masks(crane, 0.8, 1)]),
    }


@pytest.mark.parametrize("name", cases())
@pytest.mark.parametrize("minimiser", FIRST_ORDER)
def test_all_minimisers_agree_from_rest(name: str, minimiser: str) -> None:
    problem, masks = cases()[name]
    newton, other = SpringEvaluator(problem), SpringEvaluator(problem, minimiser=minimiser)
    for mask in masks:
        expected, found = newton.evaluate(mask), other.evaluate(mask)
        assert found.status is expected.status
        assert found.efficiency == pytest.approx(expected.efficiency, abs=SAME, nan_ok=True)
        assert found.energy == pytest.approx(expected.energy, abs=1e-10, nan_ok=True)


@pytest.mark.parametrize("minimiser", list(minimisers))
def test_all_minimisers_agree_from_a_neighbour(minimiser: str) -> None:
    problem = patch()
    newton, other = SpringEvaluator(problem), SpringEvaluator(problem, minimiser=minimiser)
    mask = problem.initial.copy()
    other.evaluate(mask)
    other.set_reference()
    rng = np.random.default_rng(2)
    for beam in rng.choice(problem.designable, 20):
        mask[beam] ^= True
        expected, found = newton.evaluate(mask), other.evaluate(mask, warm_start=True)
        other.set_reference()
        assert found.status is expected.status
        assert found.efficiency == pytest.approx(expected.efficiency, abs=SAME, nan_ok=True)


def test_tightening_the_load_steps_changes_nothing() -> None:
    for problem, masks in cases().values():
        evaluator = SpringEvaluator(problem)
        for mask in masks:
            coarse, fine = evaluator.evaluate(mask), evaluator.evaluate(mask, 1 / 64)
            assert coarse.status is fine.status
            assert coarse.efficiency == pytest.approx(fine.efficiency, abs=1e-8, nan_ok=True)
