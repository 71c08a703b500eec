"""The way from rest to the full load, which defines the response of a design."""

from __future__ import annotations

import math

from bellcrank.mechanics.kernels._compile import kernel
from bellcrank.mechanics.kernels.arrays import (
    CONVERGED,
    SNAPPED,
    UNCONVERGED,
    Floats,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.cholesky import factorise
from bellcrank.mechanics.kernels.energy import (
    find_gradient,
    find_stiffness,
    measure_held_beams,
)
from bellcrank.mechanics.kernels.fields import clear, copy, largest_difference, pair
from bellcrank.mechanics.kernels.newton import descend, find_step, newton, take_step
from bellcrank.mechanics.kernels.structure import HANGING

FIRST_INCREMENT = 0.25
LARGEST_INCREMENT = 0.5
SMALLEST_INCREMENT = 1.0 / 4096.0
LARGEST_CORRECTION = 0.25
"""Of an increment's prediction: more means that the path bends or jumps, so go slower."""
PROBE = 1e-6
LONGEST_STEP = 0.5


@kernel
def move_held_nodes(
    system: System, structure: Structure, fraction: float, u: Floats
) -> None:
    """Put held coordinates where supports and drive want them at `fraction` of the load."""
    for node in range(len(system.held)):
        if system.held[node] & 1:
            u[node, 0] = fraction * system.drive[node, 0]
        if system.held[node] & 2:
            u[node, 1] = fraction * system.drive[node, 1]


@kernel
def place_hanging_pieces(system: System, structure: Structure, u: Floats) -> None:
    """Let a piece that hangs from one moved node follow as a rigid body.

    Of all stress-free positions it takes the one nearest to rest (least sum of
    squared displacements), which is where vanishing springs to rest would hold it.
    """
    first = 0
    nodes = structure.sizes[0]
    while first < nodes:
        last = first + 1
        while last < nodes and structure.parent[structure.order[last]] >= 0:
            last += 1
        if structure.active[structure.order[first]] == HANGING:
            place_hanging_piece(system, structure, first, last, u)
        first = last


@kernel
def place_hanging_piece(
    system: System, structure: Structure, first: int, last: int, u: Floats
) -> None:
    """Turn one piece about the node it hangs from, the first of its piece."""
    pivot = structure.order[first]
    pivot_x, pivot_y = pair(system.positions, pivot)
    shift_x, shift_y = pair(u, pivot)
    sine = cosine = 0.0
    for index in range(first, last):
        node = structure.order[index]
        x = system.positions[node, 0] - pivot_x
        y = system.positions[node, 1] - pivot_y
        sine += x * (y - shift_y) - y * (x - shift_x)
        cosine += x * (x - shift_x) + y * (y - shift_y)
    angle = math.atan2(sine, cosine)
    for index in range(first + 1, last):
        node = structure.order[index]
        x = system.positions[node, 0] - pivot_x
        y = system.positions[node, 1] - pivot_y
        u[node, 0] = shift_x + x * (math.cos(angle) - 1.0) - y * math.sin(angle)
        u[node, 1] = shift_y + x * math.sin(angle) + y * (math.cos(angle) - 1.0)


@kernel
def predict(
    system: System,
    structure: Structure,
    fraction: float,
    increment: float,
    u: Floats,
    scratch: Scratch,
) -> float:
    """Advance `u` along the tangent of the path; return the largest movement.

    The factor at hand must be that of the equilibrium `u` at `fraction`. The change
    of the gradient with the load is a difference over a very small increment.
    """
    move_held_nodes(system, structure, fraction + PROBE, u)
    measure_held_beams(system, structure, u, scratch)
    find_gradient(system, structure, fraction + PROBE, u, scratch)
    size = find_step(system, structure, scratch) * increment / PROBE
    take_step(system, increment / PROBE, u, scratch)
    move_held_nodes(system, structure, fraction + increment, u)
    return size


@kernel
def follow_path(
    system: System, structure: Structure, u: Floats, scratch: Scratch, finest: float
) -> int:
    """Load from rest in increments that stay on one stable path.

    An increment counts only if every stiffness on the way is positive definite and
    the correction is small beside the prediction; else it is halved. When even the
    smallest increment fails, the path has lost its stability: SNAPPED, and `u` is
    one of the equilibria it may jump to.

    Parameters
    ----------
    finest
        Upper bound on the increment (1 for none); a slow, fine path for checks.
    """
    previous, predicted = scratch.vectors[5], scratch.vectors[6]
    clear(u, len(u))
    fraction = 0.0
    increment = min(FIRST_INCREMENT, finest)
    fresh = False
    while fraction < 1.0:
        if not fresh:
            measure_held_beams(system, structure, u, scratch)
            find_gradient(system, structure, fraction, u, scratch)
            find_stiffness(system, structure, False, scratch)
            if not factorise(structure, scratch):
                break
            fresh = True
        increment = min(increment, 1.0 - fraction)
        copy(u, previous)
        size = predict(system, structure, fraction, increment, u, scratch)
        correction = math.inf
        if size <= 4.0 * LONGEST_STEP:
            copy(u, predicted)
            status = newton(
                system, structure, fraction + increment, u, scratch, LONGEST_STEP, False
            )
            fresh = False
            if status == CONVERGED:
                correction = largest_difference(u, predicted)
        if correction <= LARGEST_CORRECTION * size + 1e-6:
            fraction += increment
            fresh = True
            if fraction > 1.0 - 1e-12:
                fraction = 1.0
            if correction <= 0.3 * LARGEST_CORRECTION * size:
                increment = min(2.0 * increment, LARGEST_INCREMENT, finest)
        else:
            copy(previous, u)
            increment *= 0.5
            if increment < SMALLEST_INCREMENT:
                break
    if fraction == 1.0:
        return CONVERGED
    move_held_nodes(system, structure, 1.0, u)
    if descend(system, structure, 1.0, u, scratch) == CONVERGED:
        return SNAPPED
    return UNCONVERGED
