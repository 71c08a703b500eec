"""Flip one beam, unless a prediction speaks against it: delayed acceptance.

A uniform proposal must first pass Metropolis' rule with the predicted cost; only then is
its response computed, and a second rule sets right what the prediction got wrong (Christen
and Fox, J. Comput. Graph. Stat. 14, 795, 2005). What fails the first costs no response.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.search.moves.registry import moves

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.search.place import Place

LEAST_CHANCE = 0.02
"""With which any flip passes the first rule, however bad its prediction."""


class Delayed:
    """Flip a designable beam whose prediction passes Metropolis' rule."""

    def propose(self, here: Place, rng: np.random.Generator) -> NDArray[np.int64] | None:
        """Choose a beam; None if the prediction refuses it."""
        designable = here.problem.designable
        index = int(rng.random() * len(designable))
        if rng.random() >= math.exp(_log_passes(here, index)):
            return None
        return designable[index : index + 1]

    def log_chance(self, here: Place, beams: NDArray[np.int64]) -> float:
        """Chance of passing the first rule."""
        return _log_passes(here, int(np.searchsorted(here.problem.designable, beams[0])))


def _log_passes(here: Place, index: int) -> float:
    return max(math.log(LEAST_CHANCE), min(0.0, float(here.log_gain(index)[0])))


moves.register("delayed")(Delayed())
