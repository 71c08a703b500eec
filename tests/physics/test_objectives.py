"""Efficiencies are what the paper's equations 1 to 3 say, of the reported displacement."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import Problem, find_problem

from .problems import patch, random_masks

if TYPE_CHECKING:
    from numpy.typing import NDArray


def weighted_motion(problem: Problem, u: NDArray[np.float64], n: float) -> NDArray[np.float64]:
    """|u_out| (2 cos(gamma/2)^n - 1) of each output node, from the angle itself."""
    out = u[problem.output.nodes]
    wanted = problem.output.direction
    across = wanted[:, 0] * out[:, 1] - wanted[:, 1] * out[:, 0]
    gamma = np.arctan2(across, (wanted * out).sum(axis=1))
    return np.linalg.norm(out, axis=1) * (2 * np.cos(gamma / 2) ** n - 1)


def input_motion(problem: Problem, u: NDArray[np.float64]) -> NDArray[np.float64]:
    return (problem.input.direction * u[problem.input.nodes]).sum(axis=1)


@pytest.mark.parametrize("aggregate", ["mean", "sum"])
@pytest.mark.parametrize("exponent", [2, 3, 4, 7.5])
@pytest.mark.parametrize("name", ["scaling-8", "force-driven"])
def test_directional_efficiency_is_equation_2(name: str, exponent: float, aggregate: str) -> None:
    problem = patch(force=True) if name == "force-driven" else find_problem(name)
    problem = replace(problem, aggregate=aggregate)
    gather = np.mean if aggregate == "mean" else np.sum
    evaluator = SpringEvaluator(problem, f"directional:{exponent}")
    for mask in random_masks(problem, 0.85, 4):
        response = evaluator.evaluate(mask)
        u = response.displacement
        expected = gather(weighted_motion(problem, u, exponent)) / gather(input_motion(problem, u))
        assert response.efficiency == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("name", ["crane", "discs"])
def test_directional_efficiency_with_exponent_2_is_the_displacement_efficiency(name: str) -> None:
    problem = find_problem(name)
    plain, directional = (
        SpringEvaluator(problem, "displacement"),
        SpringEvaluator(problem, "directional:2"),
    )
    for mask in random_masks(problem, 0.8, 4):
        assert directional.evaluate(mask).efficiency == plain.evaluate(mask).efficiency


@pytest.mark.parametrize("aggregate", ["mean", "sum"])
@pytest.mark.parametrize("kind", ["directional", "isotropic"])
@pytest.mark.parametrize("exponent", [2, 4])
def test_force_efficiency_is_equation_3(kind: str, exponent: float, aggregate: str) -> None:
    problem = replace(patch(force=True, kind=kind), aggregate=aggregate)
    gather = np.mean if aggregate == "mean" else np.sum
    evaluator = SpringEvaluator(problem, f"force:{exponent}")
    applied = gather(np.full(len(problem.input.nodes), problem.input.amount))
    for mask in random_masks(problem, 0.9, 4):
        response = evaluator.evaluate(mask)
        moved = gather(weighted_motion(problem, response.displacement, exponent))
        expected = problem.output.spring * moved / applied
        assert response.efficiency == pytest.approx(expected, abs=1e-12)


def test_forces_in_balance_bound_what_a_straight_chain_passes_on() -> None:
    # The springs cannot press with more than the beams bring them: an ever stiffer spring
    # takes up ever more of the force, up to a limit.
    efficiencies = []
    for spring in (0.1, 1.0, 10.0, 1e3, 1e5):
        problem = patch(force=True)
        problem = replace(problem, output=replace(problem.output, spring=spring))
        efficiencies.append(SpringEvaluator(problem, "force").evaluate(problem.initial).efficiency)
    growth = np.diff(np.abs(efficiencies))
    assert (growth > 0).all()
    assert growth[-1] < 0.01 * abs(efficiencies[-1])


def test_force_efficiency_needs_a_force_and_a_spring() -> None:
    with pytest.raises(InvalidSettings, match="drive = 'force'"):
        SpringEvaluator(find_problem("crane"), "force")
