"""Screened chains in lockstep: what all of them ask the scorer next is asked in one batch.

A network takes two to five times as long over a design alone as over one of many. So chains of
delayed acceptance (`bellcrank.search.screened`) make their proposals side by side, and whatever
their next proposals have to know is scored together. Each chain goes where it would go alone, to
the last bit, if what the scorer says of a design does not depend on what stands beside it.

Examples
--------
>>> from bellcrank.mechanics import SpringEvaluator
>>> from bellcrank.model import find_problem
>>> from bellcrank.search.delayed_acceptance import ScreenedSettings
>>> from bellcrank.search.scorers import MechanicsScorer
>>> problem = find_problem("scaling-8")
>>> scorer = MechanicsScorer(SpringEvaluator(problem))
>>> settings = ScreenedSettings(steps=20, lookahead=1)
>>> chains = [SpringEvaluator(problem) for _ in range(3)]
>>> *_, last = screened_steps(chains, scorer, settings, keep=2)
>>> last.step, [state.responses + state.saved for state in last.states]
(20, [20, 20, 20])
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import Status
from bellcrank.search.kept import Kept
from bellcrank.search.screened import ScreenedBlock, score_ahead, start_screened

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from bellcrank.search.delayed_acceptance import ScreenedSettings
    from bellcrank.search.evaluator import Evaluator
    from bellcrank.search.scorers import Scorer
    from bellcrank.search.screened import ScreenedState


@dataclass(frozen=True, slots=True, eq=False)
class Lockstep:
    """Where n screened chains stand after the same number of steps.

    Parameters
    ----------
    states
        Of the chains.
    kept
        The best designs that each has had computed by the mechanics, accepted or not; scores
        are efficiencies.
    """

    states: tuple[ScreenedState, ...]
    kept: Kept

    @property
    def step(self) -> int:
        """Proposals that each has made so far."""
        return self.states[0].step


def screened_steps(
    evaluators: Sequence[Evaluator],
    scorer: Scorer,
    settings: ScreenedSettings,
    *,
    first: int = 0,
    keep: int = 0,
) -> Iterator[Lockstep]:
    """Yield where the chains stand after each step.

    Parameters
    ----------
    evaluators
        One for each chain, at least one: it remembers where its chain is.
    first
        Number of the first chain; together with the seed it names a chain's random numbers.
    keep
        How many of the best designs to keep, a chain.

    Raises
    ------
    InvalidSettings
        If the initial design has no unique, stable response.
    """
    states = (start_screened(evaluators[0]),) * len(evaluators)
    kept = _start_keeping(evaluators, states, keep)
    while states[0].step < settings.steps:
        blocks = [
            ScreenedBlock(evaluator, settings, chain, state)
            for chain, (evaluator, state) in enumerate(zip(evaluators, states, strict=True), first)
        ]
        for _ in blocks[0].beams:
            score_ahead(scorer, blocks)
            for block in blocks:
                block.step()
            states = tuple(block.state for block in blocks)
            kept = _keep_proposed(kept, evaluators[0].problem.lattice.beam_count, blocks)
            yield Lockstep(states, kept)


def _start_keeping(
    evaluators: Sequence[Evaluator], states: Sequence[ScreenedState], keep: int
) -> Kept:
    """Return what the chains keep before their first proposals: the initial design."""
    masks = np.array([evaluator.problem.initial for evaluator in evaluators])
    nothing = Kept.nothing(len(masks), keep, (masks.shape[1] + 7) // 8)
    return nothing.joined_by(np.array([state.efficiency for state in states]), masks)


def _keep_proposed(kept: Kept, beams: int, blocks: Sequence[ScreenedBlock]) -> Kept:
    """Return what is kept after the last proposals, if they were computed and are sound."""
    sound = [block.rows.status[-1] == int(Status.CONVERGED) for block in blocks]
    efficiency = np.array([block.rows.efficiency[-1] for block in blocks])
    packed = np.array([block.rows.mask[-1] for block in blocks])
    masks = np.unpackbits(packed, axis=1, count=beams).astype(np.bool_)
    return kept.joined_by(np.where(sound, efficiency, np.nan), masks)
