"""Three kinds of chains and what they find: by networks, screened by networks, by mechanics.

Chains by networks believe them, though the mechanics may confirm a stretch now and then
(`bellcrank.learning.stretches`). Screened chains let them refuse early and the mechanics decide
(`bellcrank.search.screened`). Chains by mechanics are the paper's, which both are compared with.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.learning.driven import Effort
from bellcrank.learning.stretches import Confirmer
from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.search import chain_blocks
from bellcrank.search.lockstep import screened_steps
from bellcrank.search.populations import Population, population_steps, start_population

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.search import MetropolisSettings
    from bellcrank.search.delayed_acceptance import ScreenedSettings
    from bellcrank.search.scorers import Scorer


@dataclass(frozen=True, slots=True, eq=False)
class Chains:
    """Which chains to run, and whom to tell.

    Parameters
    ----------
    problem
        With its own objective, in the literal model.
    first
        Number of the first chain.
    keep
        How many of the best different designs of each chain to keep.
    tell
        Called with the steps or chains done, and the median of what is known of the chains'
        designs, if anything is.
    stop
        Once set, the chains end soon.
    """

    problem: Problem
    first: int
    keep: int
    tell: Callable[[int, float | None], None]
    stop: threading.Event


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What n chains have come to.

    Parameters
    ----------
    final : n of (bytes,) uint8
        Packed masks of the designs at which they end.
    best : n lists of (bytes,) uint8
        The best different designs that each has seen, best first, as the chain knew them: by
        networks as predicted, else as computed on the way. At least one each.
    effort
        What that took.
    """

    final: list[NDArray[np.uint8]]
    best: list[list[NDArray[np.uint8]]]
    effort: Effort


def by_networks(
    chains: Chains, scorer: Scorer, rule: MetropolisSettings, confirm: int = 0
) -> Found:
    """Let networks search.

    Parameters
    ----------
    confirm
        Steps after which the mechanics confirms a stretch or takes it back; 0 for never.

    Raises
    ------
    InvalidSettings
        If the networks give the initial design no efficiency.
    """
    chains.tell(0, None)
    population = start_population(chains.problem, scorer, rule, chains.keep)
    confirmer = Confirmer.at(SpringEvaluator(chains.problem), rule, chains.first, population)

    def review(here: Population) -> Population:
        due = confirm and here.step % confirm == 0
        return confirmer.confirm(here) if due else here

    steps = population_steps(
        chains.problem, scorer, rule, first=chains.first, keep=chains.keep, review=review
    )
    for population, _ in steps:
        chains.tell(population.step, float(np.median(population.score)))
        if chains.stop.is_set():
            break
    if confirm and population.step % confirm:
        population = confirmer.confirm(population)
    count = len(population.masks)
    return Found(
        list(np.packbits(population.masks, axis=1)),
        [[packed for _, packed in population.kept.ranked(row)] for row in range(count)],
        Effort(
            (population.step,) * count,
            tuple(population.accepted.tolist()),
            (confirmer.asked // count,) * count,
            (population.step,) * count,
        ),
    )


def by_screening(chains: Chains, scorer: Scorer, rule: ScreenedSettings) -> Found:
    """Let networks screen what is proposed, and the mechanics decide.

    Raises
    ------
    InvalidSettings
        If the initial design has no unique, stable response.
    """
    chains.tell(0, None)
    evaluators = [SpringEvaluator(chains.problem) for _ in range(rule.chains)]
    steps = screened_steps(evaluators, scorer, rule, first=chains.first, keep=chains.keep)
    for here in steps:
        chains.tell(here.step, float(np.median([state.efficiency for state in here.states])))
        if chains.stop.is_set():
            break
    states = here.states
    return Found(
        [_packed(state.mask) for state in states],
        [[packed for _, packed in here.kept.ranked(row)] for row in range(len(states))],
        Effort(
            tuple(state.step for state in states),
            tuple(state.accepted for state in states),
            tuple(state.responses for state in states),
            tuple(state.scored for state in states),
        ),
    )


def by_mechanics(chains: Chains, rule: MetropolisSettings) -> Found:
    """Let the mechanics search, one chain after the other."""
    problem = chains.problem
    evaluator = SpringEvaluator(problem)
    final, best, steps, accepted = [], [], [], []
    for number in range(rule.chains):
        seen: dict[bytes, float] = {np.packbits(problem.initial).tobytes(): -math.inf}
        for state, proposals in chain_blocks(evaluator, rule, chains.first + number):
            last = state
            sound = np.flatnonzero(proposals.status == int(Status.CONVERGED))
            order = sound[np.argsort(-proposals.efficiency[sound], kind="stable")]
            for row in order[: 4 * chains.keep]:  # the same design may come several times
                seen[proposals.mask[row].tobytes()] = float(proposals.efficiency[row])
        final.append(_packed(last.to_dict()["mask"]))
        ranked = heapq.nlargest(chains.keep, seen, key=seen.__getitem__)
        best.append([np.frombuffer(mask, np.uint8) for mask in ranked])
        steps.append(last.step)
        accepted.append(last.accepted)
        chains.tell(number + 1, None)
        if chains.stop.is_set():
            break
    told = tuple(steps)
    return Found(final, best, Effort(told, tuple(accepted), told, (0,) * len(told)))


def _packed(mask: str) -> NDArray[np.uint8]:
    return np.frombuffer(bytes.fromhex(mask), np.uint8)
