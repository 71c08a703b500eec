"""Newton's method at a fixed load, with predicted tensions, and a descent in energy.

Near the solution the last factor is used again (chord steps): a gradient and a substitution cost
a third of a new stiffness and its factorisation.
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
from bellcrank.mechanics.kernels.fields import copy, largest_component, pair

MAX_ITERATIONS = 10
MAX_SHIFT = 1e30
CHORD_STEP = 2e-3
"""Largest step after which the factor is used once more."""
CHORD_RATIO = 0.05
"""Ratio of successive steps above which the factor is renewed all the same."""


@kernel
def find_tension(system: System, structure: Structure, scratch: Scratch) -> None:
    """Compute the tension of the movable beams at the displacement where they were measured."""
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        stretch = scratch.length[beam] - system.rest_length[beam]
        scratch.tension[beam] = 2.0 * system.bond * stretch


@kernel
def clear_tension(scratch: Scratch) -> None:
    """Set all tensions to zero."""
    for beam in range(len(scratch.tension)):
        scratch.tension[beam] = 0.0


@kernel
def add_tension_at(
    system: System, structure: Structure, u: Floats, share: float, scratch: Scratch
) -> None:
    """Add `share` times the tension of the movable beams at the displacement `u`."""
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        first, second = pair(system.beams, beam)
        x = system.rest_vector[beam, 0] + (u[second, 0] - u[first, 0])
        y = system.rest_vector[beam, 1] + (u[second, 1] - u[first, 1])
        stretch = math.sqrt(x * x + y * y) - system.rest_length[beam]
        scratch.tension[beam] += share * 2.0 * system.bond * stretch


@kernel
def predict_tension(system: System, structure: Structure, scale: float, scratch: Scratch) -> None:
    """Compute the tension to first order after `scale` times the step.

    A Newton step rotates beams along straight lines and so stretches them, by far more than at
    the equilibrium that it leads to. With the tension as an unknown of its own, taken from the
    linear step, the stiffness after the step is accurate (Magisano, Leonetti and Garcea, Comput.
    Methods Appl. Mech. Eng. 313, 2017).
    """
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        first, second = pair(system.beams, beam)
        stretch = scratch.length[beam] - system.rest_length[beam]
        for end in range(2):
            block = system.block[second if end else first]
            if block >= 0:
                sign = scale if end else -scale
                stretch += sign * scratch.axis[beam, 0] * scratch.step[block, 0]
                stretch += sign * scratch.axis[beam, 1] * scratch.step[block, 1]
        scratch.tension[beam] = 2.0 * system.bond * stretch


@kernel
def find_step(system: System, structure: Structure, scratch: Scratch) -> float:
    """Solve K step = -gradient with the current factor; return the largest component."""
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
    """Move `u` to the nearest stable equilibrium at `fraction` of the load.

    The stiffness of the first step has the tensions in `scratch.tension`. Steps longer than
    `longest_step` are shortened. Where the stiffness is not positive definite, its part without
    softening is used. The iteration stops when the error of the displacement is below
    `tolerance`; the equilibrium is then stable. UNCONVERGED means that it was not reached and
    that a start closer to it is needed.
    """
    measure_held_beams(system, structure, u, scratch)
    size = before = math.inf
    refactorise = True
    for _ in range(MAX_ITERATIONS):
        find_gradient(system, structure, fraction, u, scratch)
        stable = True
        if refactorise:
            find_stiffness(system, structure, 1.0, scratch)
            if not factorise(structure, scratch):
                stable = False
                find_stiffness(system, structure, 0.0, scratch)
                if not factorise(structure, scratch):
                    return UNCONVERGED
        before = size
        size = find_step(system, structure, scratch)
        if not size < math.inf:
            return UNCONVERGED
        scale = min(1.0, longest_step / size)
        take_step(system, scale, u, scratch)
        predict_tension(system, structure, scale, scratch)
        ratio = size / before if before < math.inf else 1.0
        error = 0.1 * size * min(1.0, ratio) if refactorise else size
        if stable and error <= 0.1 * tolerance:
            return CONVERGED
        refactorise = size > CHORD_STEP or not stable or (ratio > CHORD_RATIO and before < math.inf)
    return UNCONVERGED


@kernel
def shift_until_definite(structure: Structure, scratch: Scratch, shift: float) -> float:
    """Factorise the stiffness, adding to its diagonal until it is positive definite.

    Returns the number added; infinity if no shift suffices, as where the stiffness is not finite.
    """
    added = 0.0
    while added < MAX_SHIFT:
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
    """Move `u` downwards in energy to a stable equilibrium, from any displacement.

    Newton steps, shortened until the energy falls, with a shifted stiffness where it is not
    positive definite. At an unstable equilibrium a fixed small disturbance decides the branch.
    Used after a loss of stability, when no neighbouring equilibrium exists.
    """
    measure_held_beams(system, structure, u, scratch)
    tentative = scratch.vectors.tentative
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
            copy(u, tentative)
            take_step(system, scale, tentative, scratch)
            lower = elastic_energy(system, structure, tentative, scratch)
            lower -= work_of_load(system, fraction, tentative)
            if lower < energy:
                break
            scale *= 0.5
        if scale <= 1e-12:
            return newton(system, structure, fraction, u, scratch, system.tolerance, 1e-3)
        copy(tentative, u)
        energy = lower
    return UNCONVERGED
