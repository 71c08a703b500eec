"""Metropolis chains whose proposals are recorded and evaluated again for timings."""

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
    """Proposals of a chain, and the time of the run.

    Parameters
    ----------
    name
        Name of the problem.
    masks : (n, M) bool
        Proposed designs.
    accepted : (n,) bool
        Whether each proposal was accepted.
    efficiency : (n,) float64
        Efficiency of each proposed design.
    seconds
        Wall time of the run.
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

    def section(self, start: int, length: int) -> Recording:
        """Return the proposals from step `start` on, after a first row with the current design."""
        current = np.flatnonzero(self.accepted[:start])[-1]
        rows = np.concatenate([[current], np.arange(start, start + length)])
        return Recording(
            self.name, self.masks[rows], self.accepted[rows], self.efficiency[rows], np.nan
        )


@cache
def record_chain(name: str, steps: int, seed: int = 0) -> Recording:
    """Run a chain with the settings of the paper and record its proposals."""
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


def evaluate_section(evaluator: SpringEvaluator, section: Recording) -> NDArray[np.float64]:
    """Evaluate the first design from rest, and `evaluate_proposals`."""
    evaluator.evaluate(section.masks[0])
    evaluator.set_reference()
    return evaluate_proposals(evaluator, section)


def evaluate_proposals(evaluator: SpringEvaluator, section: Recording) -> NDArray[np.float64]:
    """Return the efficiencies of the proposals of a section.

    Each response starts from the equilibrium of the last accepted design; the first one starts
    from the reference equilibrium of the evaluator.
    """
    efficiency = np.empty(len(section.masks) - 1)
    for step, (mask, accepted) in enumerate(
        zip(section.masks[1:], section.accepted[1:], strict=True)
    ):
        efficiency[step] = evaluator.evaluate(mask, warm_start=True).efficiency
        if accepted:
            evaluator.set_reference()
    return efficiency
