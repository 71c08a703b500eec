"""Real Metropolis chains in one unbroken block, and which proposals have loose pieces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.search import schedules
from bellcrank.search.kernels.metropolis import Chain, Records, Rules, advance

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics import Evaluator

NEVER = 2**62


def run_chain(
    evaluator: Evaluator,
    mask: NDArray[np.bool_],
    steps: int,
    rng: np.random.Generator,
    temperatures: NDArray[np.float64] | None = None,
) -> tuple[NDArray[np.bool_], Records]:
    """Advance a chain from `mask` without ever starting afresh; return all its proposals.

    The program itself starts every block from rest; a chain that never does is the
    harder test of warm starts.
    """
    response = evaluator.respond(mask)
    evaluator.remember()
    efficiency, cost = response.efficiency, np.exp(-response.efficiency)
    packed = np.packbits(mask)
    chain = Chain(
        mask=mask.astype(np.uint8),
        packed=packed,
        value=np.array([efficiency, cost, efficiency, efficiency]),
        count=np.zeros(2, np.int64),
    )
    records = Records(
        mask=np.empty((steps, len(packed)), np.uint8),
        efficiency=np.empty(steps),
        cost=np.empty(steps),
        temperature=np.empty(steps),
        accepted=np.empty(steps, np.uint8),
        status=np.empty(steps, np.uint8),
    )
    if temperatures is None:
        temperatures = schedules["linear"](0.06, 1e-3, 100)
    rules = Rules(cost=0, core=evaluator.core, minimum_degree=0, patience=NEVER,
                  refuse_snapping=True)  # fmt: skip
    made = advance(
        evaluator.system, evaluator.problem.designable, rules, temperatures,
        rng.random((steps, 2)), chain, evaluator.known, evaluator.structure,
        evaluator.displacement, evaluator.scratch, records,
    )  # fmt: skip
    assert made == steps
    masks = np.unpackbits(records.mask, axis=1, count=len(mask)).astype(bool)
    return masks, records


def has_loose_piece(evaluator: Evaluator, mask: NDArray[np.bool_]) -> bool:
    """Whether some present beam hangs together with neither support nor input."""
    problem = evaluator.problem
    beams = problem.lattice.beams[mask]
    reached = np.zeros(problem.lattice.node_count, dtype=bool)
    reached[problem.supports.nodes] = True
    reached[problem.input.nodes] = True
    while True:
        grown = reached.copy()
        touched = reached[beams].any(axis=1)
        grown[beams[touched].ravel()] = True
        if (grown == reached).all():
            return not touched.all()
        reached = grown
