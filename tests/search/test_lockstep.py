"""Screened chains side by side go where each would go alone, and are scored in batches."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import Response, SpringEvaluator, Status
from bellcrank.model import Problem, find_problem
from bellcrank.search import BLOCK
from bellcrank.search.delayed_acceptance import ScreenedSettings
from bellcrank.search.lockstep import Lockstep, screened_steps
from bellcrank.search.screened import screened_blocks

STEPS = BLOCK + 70
CHAINS = 3
FIRST = 4
SETTINGS = ScreenedSettings(steps=STEPS, doubt=0.01, lookahead=1)


class Weights:
    """A scorer that adds up what each beam is worth, and now and then says nothing."""

    def __init__(self, problem: Problem) -> None:
        weight = np.random.default_rng(3).standard_normal(problem.lattice.beam_count)
        self.weight = np.round(6.4 * weight) / 64.0  # sums are exact in whatever order
        self.sizes: list[int] = []

    def score(self, masks: np.ndarray) -> np.ndarray:
        self.sizes.append(len(masks))
        return np.where(masks.sum(axis=1) % 7 == 0, np.nan, masks @ self.weight)


@pytest.fixture(scope="module")
def problem() -> Problem:
    return find_problem("scaling-8")


def together(
    problem: Problem,
    settings: ScreenedSettings,
    scorer: Weights,
    keep: int = 0,
    kind: type[SpringEvaluator] = SpringEvaluator,
) -> list[Lockstep]:
    evaluators = [kind(problem) for _ in range(CHAINS)]
    return list(screened_steps(evaluators, scorer, settings, first=FIRST, keep=keep))


@pytest.mark.parametrize("lookahead", [1, 6])
def test_a_chain_goes_where_it_goes_alone_to_the_last_bit(problem: Problem, lookahead: int) -> None:
    settings = replace(SETTINGS, lookahead=lookahead)
    scorer = Weights(problem)
    steps = together(problem, settings, scorer)
    assert [here.step for here in steps] == list(range(1, STEPS + 1))
    evaluator = SpringEvaluator(problem)  # one for all, as chains alone come one after the other
    for row in range(CHAINS):
        blocks = list(screened_blocks(evaluator, Weights(problem), settings, FIRST + row))
        assert [steps[state.step - 1].states[row] for state, _ in blocks] == [
            state for state, _ in blocks
        ]
        accepted = np.concatenate([rows.accepted for _, rows in blocks])
        assert [here.states[row].accepted for here in steps] == np.cumsum(accepted).tolist()
        assert 0 < blocks[-1][0].saved < STEPS
    last = steps[-1].states
    assert len({state.mask for state in last}) == CHAINS
    assert sum(scorer.sizes) == sum(state.scored for state in last)


def test_chains_are_scored_together(problem: Problem) -> None:
    scorer = Weights(problem)
    together(problem, SETTINGS, scorer)
    at_once = [2 * CHAINS if step % BLOCK == 0 else CHAINS for step in range(STEPS)]
    assert scorer.sizes == at_once  # and where a block begins, the designs at hand
    ahead = Weights(problem)
    together(problem, replace(SETTINGS, lookahead=6), ahead)
    assert len(ahead.sizes) < STEPS


class Snapping(SpringEvaluator):
    """Mechanics in which many designs snap, to an efficiency that looks splendid."""

    def evaluate(self, mask: np.ndarray, largest_increment: float = 1.0, **start: Any) -> Response:
        response = super().evaluate(mask, largest_increment, **start)
        if not start or mask.sum() % 5:
            return response
        return replace(response, status=Status.SNAPPED, efficiency=9.0 + response.efficiency)


def test_the_best_sound_designs_that_the_mechanics_computed_are_kept(problem: Problem) -> None:
    hot = replace(SETTINGS, schedule="constant", cold=1.0, steps=200)
    first = SpringEvaluator(problem).evaluate(problem.initial).efficiency
    last = together(problem, hot, Weights(problem), keep=4, kind=Snapping)[-1]
    for row in range(CHAINS):
        best = {np.packbits(problem.initial).tobytes(): first}
        ((_, rows),) = screened_blocks(Snapping(problem), Weights(problem), hot, FIRST + row)
        sound = rows.status == Status.CONVERGED
        assert rows.efficiency[rows.status == Status.SNAPPED].max() > 8.0
        for packed, efficiency in zip(rows.mask[sound], rows.efficiency[sound], strict=True):
            best.setdefault(packed.tobytes(), efficiency)
        ranked = last.kept.ranked(row)
        expected = sorted(best.values(), reverse=True)[:4]
        assert np.allclose([score for score, _ in ranked], expected, atol=1e-6)
        assert all(abs(best[packed.tobytes()] - score) < 1e-6 for score, packed in ranked)


def test_an_initial_design_without_a_response_is_refused(problem: Problem) -> None:
    class Loose(SpringEvaluator):
        def evaluate(
            self, mask: np.ndarray, largest_increment: float = 1.0, **start: Any
        ) -> Response:
            response = super().evaluate(mask, largest_increment, **start)
            return response if start else replace(response, status=Status.MECHANISM)

    with pytest.raises(InvalidSettings, match="cannot start from the initial design"):
        next(screened_steps([Loose(problem)], Weights(problem), SETTINGS))
