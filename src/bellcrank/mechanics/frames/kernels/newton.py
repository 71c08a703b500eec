"""Newton's method at a fixed load, with predicted tensions.

Near the solution the last factor is used again (chord steps): a residual and a substitution cost
a third of a new stiffness and its factorisation.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.mechanics.frames.kernels.assembly import (
    assemble,
    factorise_stiffness,
    find_residual,
    predict_tension,
    set_right_side,
    solve_step,
    take_step,
)
from bellcrank.mechanics.kernels._compile import kernel
from bellcrank.mechanics.kernels.arrays import CONVERGED, UNCONVERGED
from bellcrank.mechanics.kernels.fields import largest_component

if TYPE_CHECKING:
    from bellcrank.mechanics.frames.kernels.arrays import Frame, Memory, State, Structure

MAX_ITERATIONS = 12
CHORD_STEP = 2e-3
"""Largest step after which the factor is used once more."""
CHORD_RATIO = 0.05
"""Ratio of successive steps above which the factor is renewed all the same."""


@kernel
def newton(
    frame: Frame,
    structure: Structure,
    fraction: float,
    state: State,
    memory: Memory,
    tolerance: float,
    longest_step: float,
) -> int:
    """Move a state to the nearest stable equilibrium at `fraction` of the load.

    The stiffness of the first step has the tensions in `memory.tension`. Steps longer than
    `longest_step` are shortened. Where the stiffness is not positive definite, its part without
    softening is used. The iteration stops when the error of the displacement is below
    `tolerance`; the equilibrium is then stable. UNCONVERGED means that it was not reached and
    that a start closer to it is needed.
    """
    size = before = math.inf
    refactorise = True
    for _ in range(MAX_ITERATIONS):
        stable = True
        if refactorise:
            assemble(frame, structure, fraction, state, 1.0, memory)
            if not factorise_stiffness(frame, structure, memory):
                stable = False
                assemble(frame, structure, fraction, state, 0.0, memory)
                if not factorise_stiffness(frame, structure, memory):
                    return UNCONVERGED
        else:
            find_residual(frame, structure, fraction, state, memory)
        set_right_side(frame, structure, memory.gradient, -1.0, memory)
        solve_step(structure, frame, memory)
        before = size
        size = largest_component(memory.step)
        if not size < math.inf:
            return UNCONVERGED
        scale = min(1.0, longest_step / size)
        predict_tension(frame, structure, scale, memory)
        take_step(frame, scale, state, memory)
        ratio = size / before if before < math.inf else 1.0
        error = 0.1 * size * min(1.0, ratio) if refactorise else size
        if stable and error <= 0.1 * tolerance:
            return CONVERGED
        refactorise = size > CHORD_STEP or not stable or (ratio > CHORD_RATIO and before < math.inf)
    return UNCONVERGED
