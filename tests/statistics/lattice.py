"""A lattice small enough to enumerate: ten designable beams, 1024 designs."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import FlipPrediction, Response, SpringEvaluator
from bellcrank.model import Input, Output, Problem, Supports, lattices
from bellcrank.search import Evaluator, SearchSettings, chain_blocks

if TYPE_CHECKING:
    from bellcrank.mechanics import UnloadedBeams

CHAINS = 24
BURN_IN = 250
LARGEST_DEVIATION = 4.5
"""In standard errors; for 20 observables, exceeded by chance once in several thousand runs."""
POWERS = 2 ** np.arange(9, -1, -1)


def ten_beams() -> Problem:
    """A problem with ten designable beams, any of which can be left out."""
    lattice = lattices["triangular-rows"](counts=[4, 5, 4, 5], first_x=[0.5, 0.0, 0.5, 0.0])
    bottom, top_left, top_right = [0, 1, 2, 3], [13], [17]
    regions = {
        "supports": Supports(fixed=bottom),
        "input": Input(nodes=top_right, direction=[0.0, -1.0], drive="displacement", amount=0.2),
        "output": Output(nodes=top_left, direction=[-1.0, 0.0]),
    }
    free = Problem(name="ten beams", lattice=lattice, **regions)
    chosen = free.designable[:: max(1, len(free.designable) // 10)][:10]
    assert len(chosen) == 10
    return Problem(name="ten beams", lattice=lattice, designable=chosen, **regions)


def all_designs(problem: Problem) -> np.ndarray:
    """Return (1024, M) all designs, in the order of their designable bits."""
    masks = np.repeat(problem.initial[None], 1024, axis=0)
    masks[:, problem.designable] = list(itertools.product([False, True], repeat=10))
    return masks


class Enumerated:
    """Evaluator that looks up the responses and the flip predictions of all 1024 designs."""

    def __init__(self, problem: Problem, unloaded_beams: UnloadedBeams) -> None:
        self.problem = problem
        evaluator = SpringEvaluator(problem, unloaded_beams=unloaded_beams)
        self._responses: list[Response] = []
        self._predictions: list[FlipPrediction | None] = []
        for mask in all_designs(problem):
            self._responses.append(evaluator.evaluate(mask))
            self._predictions.append(evaluator.predict_flips(mask))
        self.efficiency = np.array([response.efficiency for response in self._responses])

    def evaluate(
        self,
        mask: np.ndarray,
        _largest_increment: float = 1.0,
        *,
        warm_start: bool = False,  # noqa: ARG002
        lower_bound: float = -np.inf,  # noqa: ARG002
    ) -> Response:
        return self._responses[index_of(self.problem, mask)]

    def set_reference(self) -> None:
        pass

    def predict_flips(self, mask: np.ndarray) -> FlipPrediction | None:
        return self._predictions[index_of(self.problem, mask)]


def boltzmann(cost: np.ndarray, temperature: float) -> np.ndarray:
    """Probability of every design."""
    weight = np.exp(-(cost - cost.min()) / temperature)
    return weight / weight.sum()


def index_of(problem: Problem, mask: np.ndarray) -> int:
    """Index of a design by its designable bits."""
    return int(mask[problem.designable] @ POWERS)


def visited(evaluator: Evaluator, settings: SearchSettings, chain: int) -> np.ndarray:
    """Index of the current design after each step of one chain, without the first steps."""
    problem = evaluator.problem
    mask = problem.initial.copy()
    indices = []
    for _, proposals in chain_blocks(evaluator, settings, chain):
        proposed = np.unpackbits(proposals.mask, axis=1)[:, : len(mask)].astype(bool)
        for row, accepted in zip(proposed, proposals.accepted, strict=True):
            if accepted:
                mask = row
            indices.append(index_of(problem, mask))
    return np.array(indices[BURN_IN:])


def observables(states: np.ndarray, efficiency: np.ndarray) -> np.ndarray:
    """Marginals of the ten beams, moments of the efficiency, occupation of its quantiles."""
    bits = (states[:, None] >> np.arange(9, -1, -1)) & 1
    values = efficiency[states]
    edges = np.quantile(efficiency, [0.2, 0.4, 0.6, 0.8, 0.9, 0.95, 0.99])
    quantile = [(values > edge).astype(float) for edge in edges]
    return np.column_stack([*bits.T, values, values**2, *quantile])


def deviations(
    samples: list[np.ndarray], efficiency: np.ndarray, probability: np.ndarray
) -> np.ndarray:
    """Distance of each observable from its exact mean, in standard errors.

    Observables are averaged over independent chains, whose scatter gives the errors.
    """
    means = np.array([observables(states, efficiency).mean(axis=0) for states in samples])
    expected = probability @ observables(np.arange(1024), efficiency)
    error = means.std(axis=0, ddof=1) / np.sqrt(len(samples))
    return np.abs(means.mean(axis=0) - expected) / error
