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

from bellcrank.fem.frame import elements
from bellcrank.fem.frame.equilibrium import inner_forces
from bellcrank.fem.frame.path import TOLERANCE, FrameState
from bellcrank.fem.frame.system import Factor

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.fem.frame.system import FrameSystem

STEPS = 400
FIRST_SHIFT = 1e-3
LARGEST_SHIFT = 1e6
SHORTEST = 1e-6
DESCENT = 1e-4
"""Part of the predicted fall of the energy that a step must reach (Armijo)."""
NUDGE = 1e-3
"""Disturbance that makes a symmetric frame choose a side, as a part of the largest motion."""


def potential(system: FrameSystem, load: float, displacement: NDArray[np.float64]) -> float:
    """Return elastic energy less the work of the loads, N mm."""
    moved = displacement[system.spring_nodes, :2]
    springs = 0.5 * np.einsum("si,sij,sj->", moved, system.springs, moved)
    work = load * float((system.load * displacement).sum())
    return float(elements.energy(system.mesh, displacement).sum() + springs - work)


def settle(
    system: FrameSystem, load: float, start: NDArray[np.float64], rng: np.random.Generator
) -> FrameState | None:
    """Return the stable equilibrium that a frame slides to; None if it finds none.

    Parameters
    ----------
    load
        Part of the full input.
    start : (n, 3)
        Where it lost its stability, with the given motions of `load`.
    rng
        For the nudge.
    """
    free = system.free
    displacement = start.copy()
    largest = float(np.abs(displacement[:, :2]).max(initial=0.0))
    displacement.ravel()[free] += (
        NUDGE * largest * rng.standard_normal(len(free)) / len(free) ** 0.5
    )
    energy = potential(system, load, displacement)
    shift = 0.0
    for _ in range(STEPS):
        force, matrix, magnitude = inner_forces(system, displacement)
        residual = (force - load * system.load).ravel()
        settled = np.abs(residual[free]).max(initial=0.0) <= TOLERANCE * magnitude
        diagonal = diags(np.abs(matrix.diagonal()), format="csc")
        factor = Factor(matrix)
        if settled and not factor.negative:
            reaction = residual.copy()
            reaction[free] = 0.0
            return FrameState(load, displacement, reaction.reshape(-1, 3))
        shift = 0.0 if not factor.negative else max(FIRST_SHIFT, shift / 4.0)
        while factor.negative and shift < LARGEST_SHIFT:
            factor = Factor((matrix + shift * diagonal).tocsc())
            shift *= 4.0 if factor.negative else 1.0
        change = factor.solve(residual[free])
        slope = float(residual[free] @ change)
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
