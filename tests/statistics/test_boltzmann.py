"""The chain visits designs as often as the Boltzmann distribution says.

Ten designable beams make 1024 designs, all of which are evaluated. At fixed temperature
T the chain must visit each with probability exp(-exp(-efficiency) / T) / Z. Observables
are averaged over independent chains, whose scatter gives their standard errors.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from bellcrank.mechanics import Evaluator
from bellcrank.model import Input, Output, Problem, Supports, lattices
from bellcrank.search import MetropolisSettings, chain_blocks
from bellcrank.search import chain as chain_module

TEMPERATURE = 0.05
CHAINS = 24
BURN_IN = 250
LARGEST_DEVIATION = 4.5
"""In standard errors; for 20 observables, exceeded by chance once in several thousand runs."""


@pytest.fixture(scope="module")
def problem() -> Problem:
    lattice = lattices["triangular-rows"](counts=[4, 5, 4, 5], first_x=[0.5, 0.0, 0.5, 0.0])
    bottom, top_left, top_right = [0, 1, 2, 3], [13], [17]
    free = Problem(
        name="ten beams",
        lattice=lattice,
        supports=Supports(fixed=bottom),
        input=Input(nodes=top_right, direction=[0.0, -1.0], drive="displacement", amount=0.2),
        output=Output(nodes=top_left, direction=[-1.0, 0.0]),
    )
    chosen = free.designable[:: max(1, len(free.designable) // 10)][:10]
    assert len(chosen) == 10
    return Problem(
        name="ten beams",
        lattice=lattice,
        supports=free.supports,
        input=free.input,
        output=free.output,
        designable=chosen,
    )


@pytest.fixture(scope="module")
def exact(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """Efficiency and probability of every design, indexed by its designable bits."""
    evaluator = Evaluator(problem)
    efficiency = []
    for bits in itertools.product([False, True], repeat=10):
        mask = problem.initial.copy()
        mask[problem.designable] = bits
        efficiency.append(evaluator.respond(mask).efficiency)
    values = np.array(efficiency)
    weight = np.exp(-np.exp(-values) / TEMPERATURE)
    return values, weight / weight.sum()


def visited_states(problem: Problem, chain: int, steps: int) -> np.ndarray:
    """Index of the current design after each step of one chain."""
    settings = MetropolisSettings(steps=steps, schedule="constant", cold=TEMPERATURE)
    powers = 2 ** np.arange(9, -1, -1)
    mask = problem.initial.copy()
    visited = []
    for _, proposals in chain_blocks(Evaluator(problem), settings, chain):
        proposed = np.unpackbits(proposals.mask, axis=1)[:, : len(mask)].astype(bool)
        for row, accepted in zip(proposed, proposals.accepted, strict=True):
            if accepted:
                mask = row
            visited.append(int(mask[problem.designable] @ powers))
    return np.array(visited[BURN_IN:])


def observables(states: np.ndarray, efficiency: np.ndarray) -> np.ndarray:
    """Marginals of the ten beams, moments of the efficiency, occupation of its quantiles."""
    bits = (states[:, None] >> np.arange(9, -1, -1)) & 1
    values = efficiency[states]
    edges = np.quantile(efficiency, [0.2, 0.4, 0.6, 0.8, 0.9, 0.95, 0.99])
    quantile = [(values > edge).astype(float) for edge in edges]
    return np.column_stack([*bits.T, values, values**2, *quantile])


def deviations(problem: Problem, exact: tuple[np.ndarray, np.ndarray], steps: int) -> np.ndarray:
    """Distance of each observable from its exact mean, in standard errors."""
    efficiency, probability = exact
    means = np.array(
        [
            observables(visited_states(problem, chain, steps), efficiency).mean(axis=0)
            for chain in range(CHAINS)
        ]
    )
    expected = probability @ observables(np.arange(1024), efficiency)
    error = means.std(axis=0, ddof=1) / np.sqrt(CHAINS)
    return np.abs(means.mean(axis=0) - expected) / error


def test_the_distribution_is_neither_flat_nor_frozen(exact: tuple[np.ndarray, np.ndarray]) -> None:
    _, probability = exact
    assert probability.max() < 0.2
    assert probability.max() > 10 * probability.min()


def test_visits_match_the_enumerated_distribution(
    problem: Problem, exact: tuple[np.ndarray, np.ndarray]
) -> None:
    assert deviations(problem, exact, steps=8000).max() < LARGEST_DEVIATION


def test_visits_of_the_python_loop_match_too(
    problem: Problem, exact: tuple[np.ndarray, np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(chain_module, "_advance_compiled", chain_module.advance_in_python)
    assert deviations(problem, exact, steps=1500).max() < LARGEST_DEVIATION


def doubled_temperature(old: float, new: float, temperature: float, uniform: float) -> bool:
    return uniform < np.exp((old - new) / (2 * temperature))


def uphill_by_a_coin(old: float, new: float, _temperature: float, uniform: float) -> bool:
    return new <= old or uniform < 0.5


def ratio_of_costs(old: float, new: float, _temperature: float, uniform: float) -> bool:
    return uniform < 0.5 * old / (old + new)


@pytest.mark.parametrize("wrong_rule", [doubled_temperature, uphill_by_a_coin, ratio_of_costs])
def test_a_wrong_acceptance_rule_is_noticed(
    problem: Problem,
    exact: tuple[np.ndarray, np.ndarray],
    monkeypatch: pytest.MonkeyPatch,
    wrong_rule: object,
) -> None:
    monkeypatch.setattr(chain_module, "_advance_compiled", chain_module.advance_in_python)
    monkeypatch.setattr(chain_module, "accepts", wrong_rule)
    assert deviations(problem, exact, steps=1500).max() > LARGEST_DEVIATION
