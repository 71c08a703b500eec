"""Moves of Markov chains over designs: a registry.

A move selects beams to flip. Flipping the same beams again reverses it, so a chain samples the
Boltzmann distribution if a proposal is accepted with probability

    min(1, exp(-(cost' - cost) / T) p'(beams) / p(beams)),

where p is the probability of selecting these beams in the current design and p' that in the
proposed design (Hastings, Biometrika 57, 97, 1970). A statistical test compares each registered
move with an enumerated distribution.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bellcrank.registry import Registry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.search.markov.evaluated_design import EvaluatedDesign


class Move(Protocol):
    """A rule that selects beams to flip."""

    is_symmetric: bool
    """Whether the same beams are selected with equal probability in both directions."""

    def propose(
        self, current: EvaluatedDesign, rng: np.random.Generator
    ) -> NDArray[np.int64] | None:
        """Select beams to flip; None for a proposal that leaves the design unchanged."""

    def log_probability(self, design: EvaluatedDesign, beams: NDArray[np.int64]) -> float:
        """Return the logarithm of the probability of selecting `beams`, up to a constant."""


moves: Registry[Move] = Registry("move")


class Flip:
    """Remove or add one designable beam, each with the same probability (the paper)."""

    is_symmetric = True

    def propose(
        self, current: EvaluatedDesign, rng: np.random.Generator
    ) -> NDArray[np.int64] | None:
        """Select a beam."""
        designable = current.problem.designable
        index = int(rng.random() * len(designable))
        return designable[index : index + 1]

    def log_probability(self, design: EvaluatedDesign, beams: NDArray[np.int64]) -> float:  # noqa: ARG002
        """Return zero: the probability is the same in both directions."""
        return 0.0


class Balanced:
    """Flip one beam, selected by the predicted effect of its flip.

    The weight of a flip is the square root of the predicted ratio of probabilities, which makes
    the proposals locally balanced (Zanella, J. Am. Stat. Assoc. 115, 852, 2020; with gradients
    as predictions, Grathwohl et al., ICML 2021). The acceptance rule corrects errors of the
    prediction.
    """

    is_symmetric = False
    MAX_LOG_WEIGHT = 3.0
    MIN_LOG_WEIGHT = -5.0
    """Every flip keeps a positive probability, whatever its prediction."""

    def propose(
        self, current: EvaluatedDesign, rng: np.random.Generator
    ) -> NDArray[np.int64] | None:
        """Select a beam."""
        weights = np.exp(self._log_weights(current))
        index = int(np.searchsorted(np.cumsum(weights), rng.random() * weights.sum(), "right"))
        index = min(index, len(weights) - 1)
        return current.problem.designable[index : index + 1]

    def log_probability(self, design: EvaluatedDesign, beams: NDArray[np.int64]) -> float:
        """Return the logarithm of the beam's share of all weights."""
        log_weights = self._log_weights(design)
        index = int(np.searchsorted(design.problem.designable, beams[0]))
        return float(log_weights[index]) - math.log(np.exp(log_weights).sum())

    def _log_weights(self, design: EvaluatedDesign) -> NDArray[np.float64]:
        weights: NDArray[np.float64] = np.clip(
            0.5 * design.predicted_log_ratios(), self.MIN_LOG_WEIGHT, self.MAX_LOG_WEIGHT
        )
        return weights


class Node:
    """Remove all designable beams of a node, add all that are missing, or redraw them.

    Redrawing, in which each beam is present with probability 1/2, makes the move reversible.
    """

    is_symmetric = False
    CLEAR = FILL = 1.0 / 3.0
    """Probabilities of removing and of adding all beams."""

    def propose(
        self, current: EvaluatedDesign, rng: np.random.Generator
    ) -> NDArray[np.int64] | None:
        """Select a node and its new beams; None if they equal the present ones."""
        beams_of_nodes = list(_designable_beams_of_nodes(current.problem).values())
        incident = beams_of_nodes[int(rng.integers(len(beams_of_nodes)))]
        kind = rng.random()
        if kind < self.CLEAR:
            after = np.zeros(len(incident), dtype=np.bool_)
        elif kind < self.CLEAR + self.FILL:
            after = np.ones(len(incident), dtype=np.bool_)
        else:
            after = rng.random(len(incident)) < 0.5
        beams: NDArray[np.int64] = incident[after != current.mask[incident]]
        return beams if len(beams) else None

    def log_probability(self, design: EvaluatedDesign, beams: NDArray[np.int64]) -> float:
        """Return the logarithm of the sum over the nodes that all `beams` share."""
        total = 0.0
        beams_of_nodes = _designable_beams_of_nodes(design.problem)
        for node in sorted(design.problem.lattice.beams[beams[0]].tolist()):
            incident = beams_of_nodes[node]
            if np.isin(beams, incident).all():
                after = design.mask[incident] ^ np.isin(incident, beams)
                total += (1.0 - self.CLEAR - self.FILL) * 0.5 ** len(incident)
                total += self.CLEAR * (not after.any()) + self.FILL * bool(after.all())
        return math.log(total)


@lru_cache(maxsize=8)
def _designable_beams_of_nodes(problem: Problem) -> dict[int, NDArray[np.int64]]:
    """Return the designable beams at each node that has some, by increasing node."""
    ends = problem.lattice.beams[problem.designable].ravel()
    order = np.argsort(ends, kind="stable")
    nodes, starts = np.unique(ends[order], return_index=True)
    beams = np.split(np.repeat(problem.designable, 2)[order], starts[1:])
    return dict(zip(nodes.tolist(), beams, strict=True))


moves.register("flip")(Flip())
moves.register("balanced")(Balanced())
moves.register("node")(Node())
