"""The way from rest to the full load with a first-order minimiser, as a check on Newton."""

from __future__ import annotations

import math

from bellcrank.mechanics.kernels._compile import entry, kernel
from bellcrank.mechanics.kernels.arrays import (
    CONVERGED,
    FIRE,
    MECHANISM,
    SNAPPED,
    UNCONVERGED,
    Bytes,
    Floats,
    Known,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.energy import elastic_energy
from bellcrank.mechanics.kernels.fields import clear, copy, largest_difference, move
from bellcrank.mechanics.kernels.loading import place_hanging_pieces
from bellcrank.mechanics.kernels.relaxation import conjugate_gradient, fire
from bellcrank.mechanics.kernels.response import efficiency_of, guess_from_neighbour
from bellcrank.mechanics.kernels.structure import build_structure
from bellcrank.mechanics.kernels.tangents import move_held_nodes, stiffness_is_definite

INCREMENTS = 8
LARGEST_GROWTH = 4.0
"""Of the movement between one increment and the next: more is a jump."""


@kernel
def relax(
    system: System,
    structure: Structure,
    minimiser: int,
    fraction: float,
    u: Floats,
    scratch: Scratch,
    force_tolerance: float,
) -> int:
    """Move `u` downhill to a stable equilibrium at a fixed load."""
    if minimiser == FIRE:
        status = fire(system, structure, fraction, u, scratch, force_tolerance)
    else:
        status = conjugate_gradient(system, structure, fraction, u, scratch, force_tolerance)
    return status


@kernel
def relax_path(
    system: System,
    structure: Structure,
    minimiser: int,
    u: Floats,
    scratch: Scratch,
    force_tolerance: float,
) -> int:
    """Load from rest in equal increments.

    Each increment starts from the extrapolation of the last two equilibria. An
    unstable equilibrium on the way, or a jump between two of them, means SNAPPED.
    """
    previous, current = scratch.vectors[5], scratch.vectors[6]
    clear(u, len(u))
    clear(current, len(u))
    status = CONVERGED
    movement = math.inf
    for number in range(1, INCREMENTS + 1):
        fraction = number / INCREMENTS
        copy(current, previous)
        copy(u, current)
        if number > 1:
            move(u, 1.0, current)
            move(u, -1.0, previous)
        move_held_nodes(system, fraction, u)
        tolerance = force_tolerance if number == INCREMENTS else 1e3 * force_tolerance
        if relax(system, structure, minimiser, fraction, u, scratch, tolerance) != CONVERGED:
            return UNCONVERGED
        before = movement
        movement = largest_difference(u, current)
        stable = stiffness_is_definite(system, structure, fraction, u, scratch)
        if movement > LARGEST_GROWTH * before or not stable:
            status = SNAPPED
    return status if stable else UNCONVERGED


@entry
def respond_by_relaxation(
    system: System,
    mask: Bytes,
    core: int,
    minimiser: int,
    force_tolerance: float,
    known: Known,
    nearby: bool,
    structure: Structure,
    u: Floats,
    scratch: Scratch,
) -> tuple[int, float, float]:
    """As `response.respond`, with conjugate gradients or FIRE."""
    clear(u, len(u))
    status = build_structure(system, mask, core, structure)
    if status == MECHANISM:
        return status, math.nan, math.nan
    status = UNCONVERGED
    if nearby:
        guess_from_neighbour(system, known, structure, u, scratch)
        status = relax(system, structure, minimiser, 1.0, u, scratch, force_tolerance)
    if status != CONVERGED or not stiffness_is_definite(system, structure, 1.0, u, scratch):
        status = relax_path(system, structure, minimiser, u, scratch, force_tolerance)
    place_hanging_pieces(system, structure, u)
    energy = elastic_energy(system, structure, u, scratch)
    return status, efficiency_of(system, u), energy
