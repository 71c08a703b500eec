"""Many chains in lockstep, scored all at once: the paper's search for scorers that like batches.

A network takes hardly longer over a hundred designs than over one, and a GPU over thousands. So
all chains flip one beam each, the flipped designs are scored together, and each chain decides
for itself. Rule, cost, schedule and random numbers are those of the search ``paper``: with the
mechanics as scorer, chain k of a population goes where chain k of that search goes.

Examples
--------
>>> from bellcrank.mechanics import SpringEvaluator
>>> from bellcrank.model import find_problem
>>> from bellcrank.search import MetropolisSettings
>>> from bellcrank.search.scorers import MechanicsScorer
>>> problem = find_problem("scaling-8")
>>> settings = MetropolisSettings(steps=20, chains=3)
>>> scorer = MechanicsScorer(SpringEvaluator(problem))
>>> *_, (population, _) = population_steps(problem, scorer, settings)
>>> population.step, population.masks.shape == (3, problem.lattice.beam_count)
(20, True)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.search.blocks import BLOCK, random_numbers
from bellcrank.search.kept import Kept
from bellcrank.search.scorers import costs_of, require_plain_flips

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.search.metropolis import MetropolisSettings
    from bellcrank.search.scorers import Scorer


@dataclass(frozen=True, slots=True, eq=False)
class Population:
    """Where n chains stand after the same number of steps.

    Parameters
    ----------
    step
        Proposals of each so far.
    masks : (n, M) bool
        Current designs.
    score, cost : (n,) float64
        Of these.
    accepted : (n,) int64
        Accepted proposals so far; each chain's own temperature follows from it.
    kept
        The best designs that each has had scored, accepted or not.
    """

    step: int
    masks: NDArray[np.bool_]
    score: NDArray[np.float64]
    cost: NDArray[np.float64]
    accepted: NDArray[np.int64]
    kept: Kept


@dataclass(frozen=True, slots=True, eq=False)
class Proposed:
    """What n chains proposed in one step.

    Parameters
    ----------
    beam : (n,) int64
        Flipped.
    score : (n,) float64
        Of the flipped designs.
    temperature : (n,) float64
    accepted : (n,) bool
    """

    beam: NDArray[np.int64]
    score: NDArray[np.float64]
    temperature: NDArray[np.float64]
    accepted: NDArray[np.bool_]


def start_population(
    problem: Problem, scorer: Scorer, settings: MetropolisSettings, keep: int = 0
) -> Population:
    """Return `settings.chains` chains at the problem's initial design.

    Parameters
    ----------
    keep
        How many of the best designs to keep, a chain.

    Raises
    ------
    InvalidSettings
        If the settings ask for what these chains do not do, or the initial design has no score.
    """
    require_plain_flips(settings)
    chains = settings.chains
    masks = np.repeat(problem.initial[None], chains, axis=0)
    first = float(scorer.score(masks[:1])[0])
    if math.isnan(first):
        raise InvalidSettings(
            f"problem {problem.name!r}: the search cannot start from the initial design: the "
            f"scorer gives it no efficiency"
        )
    score = np.full(chains, first)
    kept = Kept.nothing(chains, keep, (masks.shape[1] + 7) // 8)
    return Population(
        0, masks, score, costs_of(settings.cost, score), np.zeros(chains, np.int64),
        kept.joined_by(score, masks),
    )  # fmt: skip


def advance_population(
    problem: Problem,
    scorer: Scorer,
    settings: MetropolisSettings,
    here: Population,
    uniforms: NDArray[np.float64],
) -> tuple[Population, Proposed]:
    """Let each chain make one proposal.

    Parameters
    ----------
    uniforms : (n, 2)
        Random numbers in [0, 1): which beam, and whether uphill.
    """
    designable, temperatures = problem.designable, settings.temperatures
    beam = designable[(uniforms[:, 0] * len(designable)).astype(np.int64)]
    every = np.arange(len(beam))
    masks = here.masks.copy()
    masks[every, beam] ^= True
    score = np.asarray(scorer.score(masks), np.float64)
    cost = costs_of(settings.cost, score)
    temperature = temperatures[np.minimum(here.accepted, len(temperatures) - 1)]
    rise = np.where(np.isnan(cost), np.inf, cost - here.cost)
    accepted = uniforms[:, 1] < np.exp(np.minimum(-rise / temperature, 0.0))
    kept = here.kept.joined_by(score, masks)
    refused = ~accepted
    masks[every[refused], beam[refused]] ^= True
    after = Population(
        here.step + 1, masks, np.where(accepted, score, here.score),
        np.where(accepted, cost, here.cost), here.accepted + accepted, kept,
    )  # fmt: skip
    return after, Proposed(beam, score, temperature, accepted)


def population_steps(
    problem: Problem,
    scorer: Scorer,
    settings: MetropolisSettings,
    *,
    first: int = 0,
    keep: int = 0,
    review: Callable[[Population], Population] = lambda population: population,
) -> Iterator[tuple[Population, Proposed]]:
    """Yield where the chains stand after each step, and what they proposed in it.

    A chain's random numbers are named by seed, chain and block, so that its course does not
    depend on how many run beside it. (A network's last digits may depend on the batch, though,
    and a chain that stands at a fork may feel them.)

    Parameters
    ----------
    settings
        Of the paper's search: steps, chains, seed, cost and schedule.
    first
        Number of the first chain.
    keep
        How many of the best designs to keep, a chain.
    review
        Called after each step; the chains go on from what it returns.

    Raises
    ------
    InvalidSettings
        If the settings ask for what these chains do not do, or the initial design has no score.
    """
    here = start_population(problem, scorer, settings, keep)
    uniforms = np.empty((0, 0, 2))
    while here.step < settings.steps:
        block, row = divmod(here.step, BLOCK)
        if row == 0:
            uniforms = np.stack(
                [
                    random_numbers(settings.seed, first + chain, block).random((BLOCK, 2))
                    for chain in range(settings.chains)
                ],
                axis=1,
            )
        here, proposed = advance_population(problem, scorer, settings, here, uniforms[row])
        here = review(here)
        yield here, proposed
