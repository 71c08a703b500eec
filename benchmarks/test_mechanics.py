"""Times of responses, of the prediction of flips and of Metropolis steps for several problems."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import find_problem
from bellcrank.search import MetropolisSettings, advance_chain, chain_blocks
from benchmarks.chains import evaluate_proposals, evaluate_section, record_chain

Benchmark = Callable[..., Any]

PROBLEMS = ["crane", *(f"scaling-{size}" for size in range(8, 21, 4))]
BURN_IN = 500


@pytest.mark.parametrize("name", PROBLEMS)
def test_response_from_rest(benchmark: Benchmark, name: str) -> None:
    evaluator = SpringEvaluator(find_problem(name))
    mask = record_chain(name, BURN_IN + 250).masks[BURN_IN]
    evaluator.evaluate(mask)
    benchmark.pedantic(evaluator.evaluate, args=(mask,), rounds=20)


@pytest.mark.parametrize("name", PROBLEMS)
def test_ten_responses_along_a_chain(benchmark: Benchmark, name: str) -> None:
    evaluator = SpringEvaluator(find_problem(name))
    section = record_chain(name, BURN_IN + 250).section(BURN_IN, 10)
    evaluate_section(evaluator, section)
    evaluator.evaluate(section.masks[0])
    evaluator.set_reference()
    benchmark.pedantic(evaluate_proposals, args=(evaluator, section), rounds=20)


@pytest.mark.parametrize("name", PROBLEMS)
def test_block_of_250_metropolis_steps(benchmark: Benchmark, name: str) -> None:
    evaluator = SpringEvaluator(find_problem(name))
    settings = MetropolisSettings(steps=BURN_IN + 250)
    for state, _ in chain_blocks(evaluator, MetropolisSettings(steps=BURN_IN), 0):
        final = state
    benchmark.pedantic(advance_chain, args=(evaluator, settings, 0, final), rounds=5)


@pytest.mark.parametrize("name", PROBLEMS)
def test_prediction_of_all_flips(benchmark: Benchmark, name: str) -> None:
    evaluator = SpringEvaluator(find_problem(name))
    mask = record_chain(name, BURN_IN + 250).masks[BURN_IN]
    evaluator.evaluate(mask)
    benchmark.pedantic(evaluator.predict_flips, args=(mask,), rounds=50, warmup_rounds=1)
