"""Where a frame comes to rest after it has lost its stability.

At a limit point or a bifurcation the part jumps. Quasi-statically it ends in some stable
equilibrium of lower energy; which one is a matter of inertia and friction. Here it slides down
the energy, each step a Newton step in a stiffness made positive by a multiple of its diagonal,
shortened until the energy falls.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import diags

from bellcrank.fem.frame.equilibrium import TOLERANCE, inner_forces, potential, rounding
from bellcrank.fem.frame.system import SparseFactor
from bellcrank.fem.path import State

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

    from bellcrank.fem.frame.equilibrium import FrameEquations

STEPS = 400
FIRST_SHIFT = 1e-3
LARGEST_SHIFT = 1e6
SHORTEST = 1e-6
DESCENT = 1e-4
"""Part of the predicted fall of the energy that a step must reach (Armijo)."""
NUDGE = 1e-3
"""Disturbance that makes a symmetric frame choose a side, as a part of the largest motion."""
BEYOND = 2e-3
"""Part of the input by which a frame is pushed over the edge of its stability."""


def settle(equations: FrameEquations, edge: State, rng: np.random.Generator) -> State | None:
    """Return the stable equilibrium that a frame slides to; None if it finds none.

    Parameters
    ----------
    edge
        The last stable state before stability was lost.
    rng
        For the nudge.
    """
    system = equations.system
    load = min(1.0, edge.load + BEYOND)
    displacement = equations.displacement(edge.unknowns, load)
    free = system.free
    largest = float(np.abs(displacement[:, :2]).max(initial=0.0))
    displacement.ravel()[free] += (
        NUDGE * largest * rng.standard_normal(len(free)) / len(free) ** 0.5
    )
    energy = potential(system, load, displacement)
    shift = 0.0
    for _ in range(STEPS):
        force, matrix, magnitude = inner_forces(system, displacement)
        residual = (force - load * system.load).ravel()[free]
        small = TOLERANCE * magnitude + rounding(system, displacement)
        factor = SparseFactor(matrix)
        if np.abs(residual).max(initial=0.0) <= small and not factor.negative:
            return State(load, displacement.ravel()[free])
        shift = max(FIRST_SHIFT, shift / 4.0) if factor.negative else 0.0
        factor, shift = stiffened(matrix, factor, shift)
        change = factor.solve(residual)
        slope = float(residual @ change)
        part = 1.0
        while part > SHORTEST:
            trial = displacement.copy()
            trial.ravel()[free] -= part * change
            there = potential(system, load, trial)
            if there <= energy - DESCENT * part * slope + 1e-14 * abs(energy):
                break
            part /= 2.0
        displacement, energy = trial, there
    return None


def stiffened(matrix: csc_matrix, factor: SparseFactor, shift: float) -> tuple[SparseFactor, float]:
    """Return a positive factor: with so much of the diagonal added as is needed."""
    diagonal = diags(np.abs(matrix.diagonal()), format="csc")
    while factor.negative and shift < LARGEST_SHIFT:
        factor = SparseFactor((matrix + shift * diagonal).tocsc())
        shift *= 4.0 if factor.negative else 1.0
    return factor, shift
