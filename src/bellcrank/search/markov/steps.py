"""One step of a Markov chain over designs, with any move and any evaluator."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.search.kernels.acceptance import metropolis_accepts
from bellcrank.search.markov.evaluated_design import EvaluatedDesign
from bellcrank.search.verdict import Verdict

if TYPE_CHECKING:
    import numpy as np

    from bellcrank.search.blocks import ProposalRows
    from bellcrank.search.markov.moves import Move


def metropolis_step(
    current: EvaluatedDesign,
    move: Move,
    rng: np.random.Generator,
    rows: ProposalRows,
) -> EvaluatedDesign:
    """Make one proposal, record it, and return the current design afterwards.

    A design without a unique, stable response is rejected at any temperature.
    """
    beams = move.propose(current, rng)
    uniform = rng.random()
    if beams is None:
        rows.add(
            current.mask, math.nan, math.nan, current.temperature, False, Verdict.REJECTED_EARLY
        )
        return current
    mask = current.mask.copy()
    mask[beams] ^= True
    bound = -math.inf
    if current.problem.section is not None and move.is_symmetric and uniform > 0.0:
        # A frame that is rejected in any case need not be verified to be reached from rest.
        highest = current.cost - current.temperature * math.log(uniform)
        bound = current.cost_function.inverse(highest)
    response = current.evaluator.evaluate(mask, warm_start=True, lower_bound=bound)
    current.is_last = False
    proposed = EvaluatedDesign(
        current.evaluator, current.cost_function, current.temperature, mask, response
    )
    accepted = False
    if response.is_admissible:
        log_ratio = (current.cost - proposed.cost) / current.temperature
        log_ratio += move.log_probability(proposed, beams) - move.log_probability(current, beams)
        accepted = metropolis_accepts(log_ratio, uniform)
    rows.add(
        mask, response.efficiency, proposed.cost, current.temperature, accepted, response.status
    )
    if accepted:
        current.evaluator.set_reference()
        return proposed
    return current
