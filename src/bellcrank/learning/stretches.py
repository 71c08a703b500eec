"""Chains of networks whose stretches the mechanics confirms or takes back.

A network's errors add up along a chain, since a search prefers flips that it is too hopeful
about. Every so many steps the mechanics can look at where each chain has got, and send it back
to where it was looked at last if Metropolis' rule, with the true costs, refuses the whole
stretch. (After J. S. Liu's surrogate transitions, Monte Carlo Strategies in Scientific
Computing, Springer 2001, section 9.4.3, but for his ratio, which corrects the distribution; as
chains here cool down, they have none.) It costs one response a stretch in place of one a step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.search.scorers import MechanicsScorer, costs_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.search import MetropolisSettings
    from bellcrank.search.evaluator import Evaluator
    from bellcrank.search.populations import Population

CONFIRMING = 0x5C4EC
"""Names the streams of random numbers by which stretches are judged."""


@dataclass(slots=True, eq=False)
class Confirmer:
    """Judges stretches of the chains of a population.

    Parameters
    ----------
    settings
        Of the chains.
    first
        Number of the first chain.
    here
        Where the chains were looked at last, or start.
    cost : (n,)
        True costs there.
    asked, taken_back
        Responses that were asked for, and stretches that were refused.
    """

    scorer: MechanicsScorer
    settings: MetropolisSettings
    first: int
    here: Population
    cost: NDArray[np.float64]
    asked: int = 0
    taken_back: int = 0

    @classmethod
    def at(
        cls, evaluator: Evaluator, settings: MetropolisSettings, first: int, start: Population
    ) -> Confirmer:
        """Begin at the initial design."""
        scorer = MechanicsScorer(evaluator)
        true = np.repeat(scorer.score(start.masks[:1]), len(start.masks))
        return cls(scorer, settings, first, start, costs_of(settings.cost, true))

    def confirm(self, there: Population) -> Population:
        """Return the population with refused stretches taken back.

        A design without a unique response is always refused. What a chain keeps as its best
        predicted designs, it keeps.
        """
        cost = costs_of(self.settings.cost, self.scorer.score(there.masks))
        self.asked += len(cost)
        temperatures = self.settings.temperatures
        temperature = temperatures[np.minimum(self.here.accepted, len(temperatures) - 1)]
        rise = np.where(np.isnan(cost), math.inf, cost - self.cost)
        kept = self._uniforms(there.step) < np.exp(np.minimum(-rise / temperature, 0.0))
        self.taken_back += int((~kept).sum())
        self.cost = np.where(kept, cost, self.cost)
        self.here = replace(
            there,
            masks=np.where(kept[:, None], there.masks, self.here.masks),
            score=np.where(kept, there.score, self.here.score),
            cost=np.where(kept, there.cost, self.here.cost),
            accepted=np.where(kept, there.accepted, self.here.accepted),
        )
        return self.here

    def _uniforms(self, step: int) -> NDArray[np.float64]:
        """Return a random number for each chain, named by seed, chain and step."""
        chains = range(self.first, self.first + len(self.cost))
        streams = [
            np.random.SeedSequence(self.settings.seed, spawn_key=(chain, step, CONFIRMING))
            for chain in chains
        ]
        return np.array([np.random.default_rng(stream).random() for stream in streams])
