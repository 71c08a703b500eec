"""Chains that ask a stand-in for the mechanics visit designs as they should.

With delayed acceptance, as often as the Boltzmann distribution of the mechanics says, however
bad the stand-in; as a population scored in batches, as often as that of its scorer says.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank.mechanics import Response, SpringEvaluator, Status
from bellcrank.search import MetropolisSettings, screened
from bellcrank.search.delayed_acceptance import ScreenedSettings
from bellcrank.search.populations import population_steps
from bellcrank.search.screened import screened_blocks

from .lattice import (
    BURN_IN,
    CHAINS,
    LARGEST_DEVIATION,
    POWERS,
    all_efficiencies,
    boltzmann,
    deviations,
    index_of,
    ten_beams,
)

if TYPE_CHECKING:
    from bellcrank.model import Problem

TEMPERATURE = 0.05


@dataclass(frozen=True)
class Known:
    problem: Problem
    efficiency: np.ndarray


class Table:
    """All efficiencies, right or wrong, looked up: a scorer, and a evaluator that is as fast."""

    def __init__(self, problem: Problem, efficiency: np.ndarray) -> None:
        self.problem = problem
        self.efficiency = efficiency

    def score(self, masks: np.ndarray) -> np.ndarray:
        return self.efficiency[masks[:, self.problem.designable] @ POWERS]

    def evaluate(self, mask: np.ndarray, _largest_increment: float = 1.0, **_: Any) -> Response:
        return Response(Status.CONVERGED, float(self.score(mask[None])[0]), 0.0, np.empty((0, 2)))

    def set_reference(self) -> None:
        pass


@pytest.fixture(scope="module")
def known() -> Known:
    problem = ten_beams()
    return Known(problem, all_efficiencies(problem, "keep"))


def noise(size: float) -> np.ndarray:
    return size * np.random.default_rng(8).standard_normal(1024)


BAD = {
    "noisy": lambda truth: truth + noise(2 * TEMPERATURE),
    "opposite": lambda truth: -truth,
    "ignorant": lambda _truth: noise(3 * TEMPERATURE),
    "silent": lambda truth: np.where(np.arange(1024) % 3, truth, np.nan),
}


def deviation_of_screened(known: Known, scores: np.ndarray, steps: int = 1250) -> float:
    settings = ScreenedSettings(steps=steps, schedule="constant", cold=TEMPERATURE)
    samples = []
    for chain in range(CHAINS):
        mask, indices = known.problem.initial.copy(), []
        evaluator = Table(known.problem, known.efficiency)
        scorer = Table(known.problem, scores)
        for _, rows in screened_blocks(evaluator, scorer, settings, chain):
            proposed = np.unpackbits(rows.mask, axis=1)[:, : len(mask)].astype(bool)
            for row, accepted in zip(proposed, rows.accepted, strict=True):
                mask = row if accepted else mask
                indices.append(index_of(known.problem, mask))
        samples.append(np.array(indices[BURN_IN:]))
    probability = boltzmann(np.exp(-known.efficiency), TEMPERATURE)
    return float(deviations(samples, known.efficiency, probability).max())


@pytest.mark.parametrize("kind", BAD)
def test_a_bad_scorer_does_not_change_what_a_screened_chain_visits(known: Known, kind: str) -> None:
    assert deviation_of_screened(known, BAD[kind](known.efficiency)) < LARGEST_DEVIATION


@pytest.mark.parametrize("kind", ["noisy", "opposite", "ignorant"])
def test_without_the_correction_the_bad_scorer_is_noticed(
    known: Known, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    corrected = screened.corrected
    monkeypatch.setattr(
        screened, "corrected", lambda gain, _there, _back: corrected(gain, 0.0, 0.0)
    )
    assert deviation_of_screened(known, BAD[kind](known.efficiency)) > LARGEST_DEVIATION


def test_deciding_by_the_scorer_alone_is_noticed(
    known: Known, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(screened, "corrected", lambda _gain, _there, _back: 0.0)
    assert deviation_of_screened(known, BAD["opposite"](known.efficiency)) > LARGEST_DEVIATION


def deviation_of_population(known: Known, scorer: object, steps: int) -> float:
    settings = MetropolisSettings(steps=steps, chains=CHAINS, schedule="constant", cold=TEMPERATURE)
    visits = [
        population.masks[:, known.problem.designable] @ POWERS
        for population, _ in population_steps(known.problem, scorer, settings)
    ]
    probability = boltzmann(np.exp(-known.efficiency), TEMPERATURE)
    return float(
        deviations(list(np.array(visits[BURN_IN:]).T), known.efficiency, probability).max()
    )


def test_a_population_matches_the_enumerated_distribution(known: Known) -> None:
    scorer = Table(known.problem, known.efficiency)
    assert deviation_of_population(known, scorer, steps=8000) < LARGEST_DEVIATION


def test_a_population_with_another_scorer_is_told_apart(known: Known) -> None:
    scorer = Table(known.problem, BAD["opposite"](known.efficiency))
    assert deviation_of_population(known, scorer, steps=2000) > LARGEST_DEVIATION


def test_the_table_says_what_the_mechanics_says(known: Known) -> None:
    evaluator, table = SpringEvaluator(known.problem), Table(known.problem, known.efficiency)
    mask = known.problem.initial.copy()
    mask[known.problem.designable[::3]] = False
    assert table.evaluate(mask).efficiency == evaluator.evaluate(mask).efficiency
