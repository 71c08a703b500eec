"""Newton's method at a fixed load, and a descent for what Newton cannot do.

Near the solution the last factor is used again (chord steps): a gradient and a
substitution cost a third of a new stiffness and its factorisation.
"""

from __future__ import annotations

import math

import numpy as np

from bellcrank.mechanics.kernels._compile import kernel
from bellcrank.mechanics.kernels.arrays import (
    CONVERGED,
    UNCONVERGED,
    Floats,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.cholesky import factorise, solve
from bellcrank.mechanics.kernels.energy import (
    elastic_energy,
    find_gradient,
    find_stiffness,
    measure_held_beams,
    work_of_load,
)
from bellcrank.mechanics.kernels.fields import copy, largest_component
from bellcrank.mechanics.kernels.tension import find_tension, foresee_tension

MOST_ITERATIONS = 10
HOPELESS = 1e30
CHORD_STEP = 2e-3
"""Below this step the stiffness is good enough to be used once more."""
CHORD_RATIO = 0.05
"""Unless steps no longer shrink by this factor."""


@kernel
def find_step(system: System, structure: Structure, scratch: Scratch) -> float:
    """Solve K step = -gradient with the factor at hand; return the largest component."""
    for node in range(len(system.block)):
        block = system.block[node]
        if block >= 0:
            scratch.step[block, 0] = -scratch.gradient[node, 0]
            scratch.step[block, 1] = -scratch.gradient[node, 1]
    solve(structure, scratch)
    return largest_component(scratch.step)


@kernel
def take_step(system: System, scale: float, u: Floats, scratch: Scratch) -> None:
    """Add `scale` times the step to the displacement of the free nodes."""
    for node in range(len(system.block)):
        block = system.block[node]
        if block >= 0:
            u[node, 0] += scale * scratch.step[block, 0]
            u[node, 1] += scale * scratch.step[block, 1]


@kernel
def newton(
    system: System,
    structure: Structure,
    fraction: float,
    u: Floats,
    scratch: Scratch,
    tolerance: float,
    longest_step: float,
) -> int:
    """Move `u` to the stable equilibrium next to it at `fraction` of the load.

    The stiffness of the first step is that with the tensions in `scratch.tension`.
    Stops when the displacement is settled to within `tolerance`. Steps longer than
    `longest_step` are shortened; where the stiffness is not positive definite, the part of
    it that always is shows the way. The equilibrium it ends at is stable. UNCONVERGED
    means that it was not reached: the caller then comes from nearer by.
    """
    measure_held_beams(system, structure, u, scratch)
    size = before = math.inf
    renew = True
    for _ in range(MOST_ITERATIONS):
        find_gradient(system, structure, fraction, u, scratch)
        settled = True
        if renew:
            find_stiffness(system, structure, 1.0, scratch)
            if not factorise(structure, scratch):
                settled = False
                find_stiffness(system, structure, 0.0, scratch)
                if not factorise(structure, scratch):
                    return UNCONVERGED
        before = size
        size = find_step(system, structure, scratch)
        if not size < math.inf:
            return UNCONVERGED
        scale = min(1.0, longest_step / size)
        take_step(system, scale, u, scratch)
        foresee_tension(system, structure, scale, scratch)
        ratio = size / before if before < math.inf else 1.0
        left = 0.1 * size * min(1.0, ratio) if renew else size
        if settled and left <= 0.1 * tolerance:
            return CONVERGED
        renew = size > CHORD_STEP or not settled or (ratio > CHORD_RATIO and before < math.inf)
    return UNCONVERGED


@kernel
def shift_until_definite(structure: Structure, scratch: Scratch, shift: float) -> float:
    """Factorise the stiffness, adding to its diagonal until it is positive definite.

    Returns what was added; infinity if nothing helps, as where the stiffness is not finite.
    """
    added = 0.0
    while added < HOPELESS:
        if factorise(structure, scratch):
            return added
        more = max(shift, 2.0 * added)
        for block in range(len(scratch.diagonal)):
            scratch.diagonal[block, 0] += more - added
            scratch.diagonal[block, 3] += more - added
        added = more
    return math.inf


@kernel
def descend(
    system: System, structure: Structure, fraction: float, u: Floats, scratch: Scratch
) -> int:
    """Slide down in energy to some stable equilibrium, from anywhere.

    Newton steps, shortened until the energy falls, with a shifted stiffness where
    it is not positive definite; at an unstable equilibrium a fixed small push
    decides the side. Used after a loss of stability, when no neighbouring
    equilibrium exists.
    """
    measure_held_beams(system, structure, u, scratch)
    trial = scratch.vectors[8]
    energy = elastic_energy(system, structure, u, scratch) - work_of_load(system, fraction, u)
    for _ in range(500):
        find_gradient(system, structure, fraction, u, scratch)
        find_tension(system, structure, scratch)
        find_stiffness(system, structure, 1.0, scratch)
        shift = shift_until_definite(structure, scratch, 1e-3 * system.angle)
        if shift == math.inf:
            return UNCONVERGED
        size = find_step(system, structure, scratch)
        if size <= 1e-9:
            if shift == 0.0:
                return newton(system, structure, fraction, u, scratch, system.tolerance, 1e-3)
            for node in range(len(system.block)):
                if system.block[node] >= 0 and structure.active[node]:
                    u[node, 0] += 1e-4 * math.sin(1.0 + node)
                    u[node, 1] += 1e-4 * math.cos(1.0 + 2.0 * node)
            energy = np.inf
            continue
        scale = min(1.0, 0.3 / size)
        while scale > 1e-12:
            copy(u, trial)
            take_step(system, scale, trial, scratch)
            lower = elastic_energy(system, structure, trial, scratch)
            lower -= work_of_load(system, fraction, trial)
            if lower < energy:
                break
            scale *= 0.5
        if scale <= 1e-12:
            return newton(system, structure, fraction, u, scratch, system.tolerance, 1e-3)
        copy(trial, u)
        energy = lower
    return UNCONVERGED
