"""The best designs that chains have come across."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Kept:
    """The best different designs that each of n chains has had scored.

    Parameters
    ----------
    score : (n, K) float64
        In no order; -inf where there is none yet.
    packed : (n, K, bytes) uint8
    """

    score: NDArray[np.float64]
    packed: NDArray[np.uint8]

    @classmethod
    def nothing(cls, chains: int, count: int, width: int) -> Kept:
        """Return room for so many designs of `width` bytes a chain."""
        return cls(np.full((chains, count), -np.inf), np.zeros((chains, count, width), np.uint8))

    def joined_by(self, score: NDArray[np.float64], masks: NDArray[np.bool_]) -> Kept:
        """Return what is kept after one more design of each chain.

        Parameters
        ----------
        score : (n,)
        masks : (n, M) bool
        """
        if not self.score.shape[1]:
            return self
        rows = np.flatnonzero(score > self.score.min(axis=1))
        packed = np.packbits(masks[rows], axis=1)
        held = (self.packed[rows] == packed[:, None]).all(axis=2) & np.isfinite(self.score[rows])
        new = ~held.any(axis=1)
        rows, packed = rows[new], packed[new]
        if not len(rows):
            return self
        after = Kept(self.score.copy(), self.packed.copy())
        place = self.score[rows].argmin(axis=1)
        after.score[rows, place] = score[rows]
        after.packed[rows, place] = packed
        return after

    def ranked(self, chain: int) -> list[tuple[float, NDArray[np.uint8]]]:
        """Return score and packed mask of what one chain keeps, best first."""
        order = np.argsort(-self.score[chain], kind="stable")
        return [
            (float(self.score[chain, k]), self.packed[chain, k])
            for k in order
            if np.isfinite(self.score[chain, k])
        ]
