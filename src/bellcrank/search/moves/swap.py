"""Move a beam from one place to another: what is gained by shape, not by mass."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.search.moves.registry import moves

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.search.place import Place


class Swap:
    """Remove one designable beam and add another."""

    def propose(self, here: Place, rng: np.random.Generator) -> NDArray[np.int64] | None:
        """Choose a present and an absent beam; None where one of the kinds is missing."""
        designable = here.problem.designable
        present = here.mask[designable]
        beams, gaps = designable[present], designable[~present]
        if not (len(beams) and len(gaps)):
            return None
        return np.array([beams[rng.integers(len(beams))], gaps[rng.integers(len(gaps))]])

    def log_chance(self, here: Place, beams: NDArray[np.int64]) -> float:  # noqa: ARG002
        """Equal in both directions: a swap keeps the number of beams."""
        return 0.0


moves.register("swap")(Swap())
