"""Real Metropolis chains in one unbroken block, and which proposals have loose pieces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.search import MetropolisSettings, start_chain
from bellcrank.search.markov import metropolis

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics import SpringEvaluator
    from bellcrank.storage import Proposals


def run_chain(
    evaluator: SpringEvaluator, steps: int, seed: int, settings: MetropolisSettings | None = None
) -> tuple[NDArray[np.bool_], Proposals]:
    """Advance a chain from the problem's initial design; return all that it proposed.

    The program itself starts every block afresh from rest. This chain never does, which
    is the harder test of warm starts.
    """
    settings = settings or MetropolisSettings()
    state = start_chain(evaluator, settings)
    uniforms = np.random.default_rng(seed).random((steps, 2))
    _, proposals = metropolis._advance_compiled(evaluator, settings, state, uniforms)
    beams = evaluator.problem.lattice.beam_count
    return np.unpackbits(proposals.mask, axis=1, count=beams).astype(bool), proposals


def has_loose_piece(evaluator: SpringEvaluator, mask: NDArray[np.bool_]) -> bool:
    """Whether some present beam hangs together with neither support nor input."""
    problem = evaluator.problem
    beams = problem.lattice.beams[mask]
    reached = np.zeros(problem.lattice.node_count, dtype=bool)
    reached[problem.supports.nodes] = True
    reached[problem.input.nodes] = True
    while True:
        touched = reached[beams].any(axis=1)
        before = reached.sum()
        reached[beams[touched].ravel()] = True
        if reached.sum() == before:
            return not touched.all()
