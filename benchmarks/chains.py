"""Metropolis chains, recorded once and evaluated again for timings."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import find_problem
from bellcrank.search import MetropolisSettings, chain_blocks

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Recording:
    """The proposals of a chain, and their total time.

    Parameters
    ----------
    masks : (n, M) bool
        The proposed designs.
    accepted : (n,) bool
    efficiency : (n,) float64
        Efficiency of each proposed design.
    seconds
        Wall time of the whole run: proposals, responses, records.
    """

    name: str
    masks: NDArray[np.bool_]
    accepted: NDArray[np.bool_]
    efficiency: NDArray[np.float64]
    seconds: float

    @property
    def microseconds_per_step(self) -> float:
        """Mean wall time of one Metropolis step."""
        return 1e6 * self.seconds / len(self.masks)

    def stretch(self, start: int, length: int) -> Recording:
        """Part of the chain; its first row is the design that is current at `start`."""
        current = np.flatnonzero(self.accepted[:start])[-1]
        rows = np.concatenate([[current], np.arange(start, start + length)])
        return Recording(
            self.name, self.masks[rows], self.accepted[rows], self.efficiency[rows], np.nan
        )


@cache
def record(name: str, steps: int, seed: int = 0) -> Recording:
    """Run a chain with the settings of the paper."""
    evaluator = SpringEvaluator(find_problem(name))
    settings = MetropolisSettings(steps=steps, seed=seed)
    next(chain_blocks(evaluator, MetropolisSettings(steps=20), 0))  # compiles
    start = time.perf_counter()
    blocks = [proposals for _, proposals in chain_blocks(evaluator, settings, 0)]
    seconds = time.perf_counter() - start
    beams = evaluator.problem.lattice.beam_count
    packed = np.concatenate([block.mask for block in blocks])
    return Recording(
        name,
        np.unpackbits(packed, axis=1, count=beams).astype(bool),
        np.concatenate([block.accepted for block in blocks]).astype(bool),
        np.concatenate([block.efficiency for block in blocks]),
        seconds,
    )


def walk(evaluator: SpringEvaluator, stretch: Recording) -> NDArray[np.float64]:
    """Responses along a stretch, each from the last accepted one; returns the efficiencies."""
    evaluator.evaluate(stretch.masks[0])
    evaluator.set_reference()
    return walk_on(evaluator, stretch)


def walk_on(evaluator: SpringEvaluator, stretch: Recording) -> NDArray[np.float64]:
    """As `walk`, from the reference equilibrium that is already set."""
    efficiency = np.empty(len(stretch.masks) - 1)
    for step, (mask, accepted) in enumerate(
        zip(stretch.masks[1:], stretch.accepted[1:], strict=True)
    ):
        efficiency[step] = evaluator.evaluate(mask, warm_start=True).efficiency
        if accepted:
            evaluator.set_reference()
    return efficiency
