"""Moves of Markov chains over designs: a registry.

A move chooses beams to flip. Flipping the same beams leads back, so a chain visits each
design as often as its temperature wants if it accepts a move with probability

    min(1, exp(-(cost' - cost) / T) * chance'(beams) / chance(beams)),

chance the probability of choosing those beams at the one place, chance' at the other
(Metropolis et al. 1953; Hastings, Biometrika 57, 97, 1970). A contract test compares the
visits of each registered move with the exact distribution.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from bellcrank.registry import Registry

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.search.place import Place


class Move(Protocol):
    """A way to choose beams to flip."""

    def propose(self, here: Place, rng: np.random.Generator) -> NDArray[np.int64] | None:
        """Choose beams to flip, or None to stay."""

    def log_chance(self, here: Place, beams: NDArray[np.int64]) -> float:
        """Log of the probability of choosing these beams here, up to a constant."""


moves: Registry[Move] = Registry("move")
