"""Chains with a hard goal visit the allowed designs as often as the Boltzmann distribution says.

Restricted to the designs that keep the goal, a chain must visit each with probability
exp(-cost / T) / Z, Z over those alone: by a rule that the beams tell, and by one that only the
response tells.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.mechanics import SpringEvaluator, output_stiffness
from bellcrank.search import MetropolisSettings, make_evaluator

from .lattice import (
    CHAINS,
    LARGEST_DEVIATION,
    Enumerated,
    all_designs,
    boltzmann,
    deviations,
    ten_beams,
    visited,
)

if TYPE_CHECKING:
    from bellcrank.model import Problem

TEMPERATURE = 0.03
MASS = 0.65
STIFFNESS = 3.34


def is_light(problem: Problem) -> np.ndarray:
    evaluator = SpringEvaluator(problem)
    length = problem.lattice.rest_length[problem.designable]
    core = np.array([evaluator.load_bearing(m)[problem.designable] for m in all_designs(problem)])
    return core @ length <= MASS * length.sum()


def is_stiff(problem: Problem) -> np.ndarray:
    evaluator = SpringEvaluator(problem, unloaded_beams="prune_dead_ends")
    stiffness = []
    for mask in all_designs(problem):
        evaluator.evaluate(mask)
        stiffness.append(output_stiffness(evaluator))
    return np.array(stiffness) >= STIFFNESS


RULES = {f"mass <= {MASS}": is_light, f"stiffness >= {STIFFNESS}": is_stiff}


@pytest.fixture(scope="module")
def problem() -> Problem:
    return ten_beams()


@pytest.fixture(scope="module")
def efficiency(problem: Problem) -> np.ndarray:
    return Enumerated(problem, "prune_dead_ends").efficiency


computed: dict[tuple[str, tuple[str, ...]], list[np.ndarray]] = {}


def samples_of(problem: Problem, goal: str, *moves: str) -> list[np.ndarray]:
    settings = MetropolisSettings(
        steps=1250, schedule="constant", cold=TEMPERATURE, cost="negative", moves=moves,
        unloaded_beams="prune_dead_ends", goals=(goal,),
    )  # fmt: skip
    if (goal, moves) not in computed:
        evaluator = make_evaluator(problem, settings)
        computed[goal, moves] = [visited(evaluator, settings, chain) for chain in range(CHAINS)]
    return computed[goal, moves]


@pytest.mark.parametrize("goal", RULES)
@pytest.mark.parametrize(
    "moves", [("flip",), pytest.param(("balanced", "node"), marks=pytest.mark.slow)], ids=str
)
def test_visits_match_the_distribution_over_allowed_designs(
    problem: Problem, efficiency: np.ndarray, goal: str, moves: tuple[str, ...]
) -> None:
    allowed = RULES[goal](problem)
    assert 100 < allowed.sum() < 900
    samples = samples_of(problem, goal, *moves)
    assert allowed[np.concatenate(samples)].all()
    weight = np.where(allowed, boltzmann(-efficiency, TEMPERATURE), 0.0)
    assert deviations(samples, efficiency, weight / weight.sum()).max() < LARGEST_DEVIATION


@pytest.mark.parametrize("goal", RULES)
def test_the_distribution_over_all_designs_is_distinguished(
    problem: Problem, efficiency: np.ndarray, goal: str
) -> None:
    samples = samples_of(problem, goal, "flip")
    everything = boltzmann(-efficiency, TEMPERATURE)
    assert deviations(samples, efficiency, everything).max() > LARGEST_DEVIATION
