"""Timings of responses, of flip prediction and of the Metropolis step, for several problems."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import find_problem
from bellcrank.search import MetropolisSettings, advance_chain, chain_blocks
from benchmarks.chains import record, walk, walk_on

Benchmark = Callable[..., Any]

PROBLEMS = ["crane", *(f"scaling-{size}" for size in range(8, 21, 4))]
BURN_IN = 500


@pytest.mark.parametrize("name", PROBLEMS)
def test_response_from_rest(benchmark: Benchmark, name: str) -> None:
    evaluator = SpringEvaluator(find_problem(name))
    mask = record(name, BURN_IN + 250).masks[BURN_IN]
    evaluator.evaluate(mask)
    benchmark.pedantic(evaluator.evaluate, args=(mask,), rounds=20)


@pytest.mark.parametrize("name", PROBLEMS)
def test_ten_responses_along_a_chain(benchmark: Benchmark, name: str) -> None:
    evaluator = SpringEvaluator(find_problem(name))
    stretch = record(name, BURN_IN + 250).stretch(BURN_IN, 10)
    walk(evaluator, stretch)
    evaluator.evaluate(stretch.masks[0])
    evaluator.set_reference()
    benchmark.pedantic(walk_on, args=(evaluator, stretch), rounds=20)


@pytest.mark.parametrize("name", PROBLEMS)
def test_block_of_250_metropolis_steps(benchmark: Benchmark, name: str) -> None:
    evaluator = SpringEvaluator(find_problem(name))
    settings = MetropolisSettings(steps=BURN_IN + 250)
    for state, _ in chain_blocks(evaluator, MetropolisSettings(steps=BURN_IN), 0):
        after = state
    benchmark.pedantic(advance_chain, args=(evaluator, settings, 0, after), rounds=5)


@pytest.mark.parametrize("name", PROBLEMS)
def test_prediction_of_all_flips(benchmark: Benchmark, name: str) -> None:
    evaluator = SpringEvaluator(find_problem(name))
    mask = record(name, BURN_IN + 250).masks[BURN_IN]
    evaluator.evaluate(mask)
    benchmark.pedantic(evaluator.predict_flips, args=(mask,), rounds=50, warmup_rounds=1)
