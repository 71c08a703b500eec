"""Clear or fill a node: several beams at once, as a new way for the force needs them."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.search.moves.registry import moves

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.search.place import Place

CLEAR = FILL = 1.0 / 3.0
"""Chances; otherwise each beam of the node is drawn anew, so that there is a way back."""


class Node:
    """Remove all designable beams of a node, add all that are missing, or draw them anew."""

    def propose(self, here: Place, rng: np.random.Generator) -> NDArray[np.int64] | None:
        """Choose a node and what to do there; None if that leaves it as it is."""
        stars = _stars(here.problem)
        star = stars[int(rng.integers(len(stars)))]
        kind = rng.random()
        if kind < CLEAR:
            after = np.zeros(len(star), dtype=np.bool_)
        elif kind < CLEAR + FILL:
            after = np.ones(len(star), dtype=np.bool_)
        else:
            after = rng.random(len(star)) < 0.5
        beams: NDArray[np.int64] = star[after != here.mask[star]]
        return beams if len(beams) else None

    def log_chance(self, here: Place, beams: NDArray[np.int64]) -> float:
        """Sum over the nodes whose beams these are: two, for a single beam."""
        total = 0.0
        for star in _stars(here.problem):
            if np.isin(beams, star).all():
                after = here.mask[star] ^ np.isin(star, beams)
                total += (1.0 - CLEAR - FILL) * 0.5 ** len(star)
                total += CLEAR * (not after.any()) + FILL * bool(after.all())
        return math.log(total)


@lru_cache(maxsize=8)
def _stars(problem: Problem) -> list[NDArray[np.int64]]:
    """List the designable beams of each node that has some."""
    ends = problem.lattice.beams[problem.designable]
    order = np.argsort(ends.ravel(), kind="stable")
    _, starts = np.unique(ends.ravel()[order], return_index=True)
    owners = np.repeat(problem.designable, 2)[order]
    return np.split(owners, starts[1:])


moves.register("node")(Node())
