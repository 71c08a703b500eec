"""Chains visit designs as often as the Boltzmann distribution says.

At fixed temperature T a chain must visit each of 1024 designs with probability
exp(-cost / T) / Z, whatever its moves; and wrong rules must be noticed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import Problem, unpack_mask
from bellcrank.search import (
    Evaluator,
    MetropolisSettings,
    TemperingSettings,
    chain_blocks,
    moves,
)
from bellcrank.search.markov import steps, tempering

from .lattice import (
    CHAINS,
    LARGEST_DEVIATION,
    Enumerated,
    boltzmann,
    deviations,
    index_of,
    ten_beams,
    visited,
)

if TYPE_CHECKING:
    from collections.abc import Callable

PAPER_TEMPERATURE = 0.05
TEMPERATURE = 0.03
"""For cost -efficiency: the most likely design is then a few hundred times likelier than most."""


@dataclass(frozen=True)
class Exact:
    problem: Problem
    literal: Enumerated
    pruned: Enumerated


@pytest.fixture(scope="module")
def exact() -> Exact:
    problem = ten_beams()
    return Exact(problem, Enumerated(problem, "keep"), Enumerated(problem, "prune_dead_ends"))


def deviation_of_the_paper(exact: Exact, evaluator: Evaluator, steps: int) -> float:
    settings = MetropolisSettings(steps=steps, schedule="constant", cold=PAPER_TEMPERATURE)
    samples = [visited(evaluator, settings, chain) for chain in range(CHAINS)]
    probability = boltzmann(np.exp(-exact.literal.efficiency), PAPER_TEMPERATURE)
    return float(deviations(samples, exact.literal.efficiency, probability).max())


def deviation_of_moves(exact: Exact, *names: str, steps: int = 1000) -> float:
    settings = MetropolisSettings(
        steps=steps, schedule="constant", cold=TEMPERATURE, cost="negative", moves=names
    )
    samples = [visited(exact.pruned, settings, chain) for chain in range(CHAINS)]
    probability = boltzmann(-exact.pruned.efficiency, TEMPERATURE)
    return float(deviations(samples, exact.pruned.efficiency, probability).max())


def test_the_distributions_are_neither_flat_nor_frozen(exact: Exact) -> None:
    for probability in (
        boltzmann(np.exp(-exact.literal.efficiency), PAPER_TEMPERATURE),
        boltzmann(-exact.pruned.efficiency, TEMPERATURE),
    ):
        assert probability.max() < 0.2
        assert probability.max() > 10 * probability.min()


def test_visits_of_the_compiled_chain_match_the_enumerated_distribution(exact: Exact) -> None:
    evaluator = SpringEvaluator(exact.problem)
    assert deviation_of_the_paper(exact, evaluator, steps=8000) < LARGEST_DEVIATION


def test_visits_of_the_python_loop_match_too(exact: Exact) -> None:
    assert deviation_of_the_paper(exact, exact.literal, steps=1500) < LARGEST_DEVIATION


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.slow) if name == "node" else name for name in moves],
)
def test_visits_by_every_move_match_the_enumerated_distribution(exact: Exact, name: str) -> None:
    assert deviation_of_moves(exact, name) < LARGEST_DEVIATION


@pytest.mark.slow
def test_visits_by_a_mixture_of_moves_match_too(exact: Exact) -> None:
    assert deviation_of_moves(exact, *moves) < LARGEST_DEVIATION


def doubled_temperature(log_ratio: float, uniform: float) -> bool:
    return uniform < math.exp(min(0.0, log_ratio / 2))


def uphill_by_a_coin(log_ratio: float, uniform: float) -> bool:
    return log_ratio >= 0.0 or uniform < 0.5


def heat_bath_of_a_third(log_ratio: float, uniform: float) -> bool:
    return uniform < 1.0 / (2.0 + math.exp(-log_ratio))


@pytest.mark.parametrize("rule", [doubled_temperature, uphill_by_a_coin, heat_bath_of_a_third])
def test_a_wrong_acceptance_rule_is_noticed(
    exact: Exact, monkeypatch: pytest.MonkeyPatch, rule: Callable[[float, float], bool]
) -> None:
    monkeypatch.setattr(steps, "metropolis_accepts", rule)
    assert deviation_of_the_paper(exact, exact.literal, steps=1500) > LARGEST_DEVIATION


@pytest.mark.parametrize("name", [name for name in moves if name != "flip"])
def test_a_move_without_its_proposal_probabilities_is_noticed(
    exact: Exact, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr(type(moves[name]), "log_probability", lambda _self, _design, _beams: 0.0)
    assert deviation_of_moves(exact, name) > LARGEST_DEVIATION


REPLICAS = TemperingSettings(
    steps=5000, replicas=2, hot=0.15, cold=TEMPERATURE, moves=("flip", "balanced")
)


def tempering_deviations(exact: Exact) -> list[float]:
    """Return the deviation of each replica, over its designs at the start of each of its turns."""
    take_turn = tempering._take_turn
    seen: list[list[list[int]]] = [[] for _ in range(REPLICAS.replicas)]

    def recorded(evaluator, settings, state, turn, *rest):
        if turn < REPLICAS.replicas:
            mask = unpack_mask(state.mask[turn], exact.problem.lattice.beam_count)
            seen[turn][-1].append(index_of(exact.problem, mask))
        return take_turn(evaluator, settings, state, turn, *rest)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tempering, "_take_turn", recorded)
        for chain in range(CHAINS):
            for replica in seen:
                replica.append([])
            for _ in chain_blocks(exact.pruned, REPLICAS, chain):
                pass
    found = []
    for temperature, chains in zip(REPLICAS.temperatures, seen, strict=True):
        samples = [np.array(states[5:]) for states in chains]
        probability = boltzmann(-exact.pruned.efficiency, temperature)
        found.append(float(deviations(samples, exact.pruned.efficiency, probability).max()))
    return found


def test_every_replica_keeps_its_distribution(exact: Exact) -> None:
    assert max(tempering_deviations(exact)) < LARGEST_DEVIATION


@pytest.mark.slow
def test_exchanging_whatever_the_cost_is_noticed(
    exact: Exact, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempering, "metropolis_accepts", lambda _log_ratio, _uniform: True)
    assert tempering_deviations(exact)[1] > LARGEST_DEVIATION
