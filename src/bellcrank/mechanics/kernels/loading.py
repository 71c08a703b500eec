"""The way from rest to the full load, which defines the response of a design."""

from __future__ import annotations

import math

from bellcrank.mechanics.kernels._compile import inlined, kernel
from bellcrank.mechanics.kernels.arrays import (
    CONVERGED,
    HELD_X,
    HELD_Y,
    SNAPPED,
    UNCONVERGED,
    Floats,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.cholesky import factorise, solve
from bellcrank.mechanics.kernels.energy import (
    find_gradient,
    find_stiffness,
    measure_held_beams,
)
from bellcrank.mechanics.kernels.fields import (
    clear,
    copy,
    dot,
    largest_difference,
    move,
    pair,
)
from bellcrank.mechanics.kernels.newton import descend, find_step, newton, take_step
from bellcrank.mechanics.kernels.structure import ACTIVE, HANGING

LARGEST_INCREMENT = 0.125
SMALLEST_INCREMENT = 1.0 / 4096.0
LARGEST_CORRECTION = 0.15
"""Of an increment's prediction: more means that the path bends or jumps, so go slower."""
LARGEST_SOFTENING = 0.6
"""Change of the lowest stiffness in one increment, up or down, that calls for smaller ones."""
DIP = 0.5
"""A path whose lowest stiffness falls below this part of its values before and after has
passed near a loss of stability; whether a second equilibrium exists is then looked up."""
DISTINCT = 1e-3
"""Distance, in lattice units, at which two equilibria are two."""
PROBE = 1e-6
LONGEST_STEP = 0.5


@kernel
def move_held_nodes(system: System, fraction: float, u: Floats) -> None:
    """Put held coordinates where supports and drive want them at `fraction` of the load."""
    for node in range(len(system.held)):
        if system.held[node] & HELD_X:
            u[node, 0] = fraction * system.drive[node, 0]
        if system.held[node] & HELD_Y:
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


@inlined
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
    move_held_nodes(system, fraction + PROBE, u)
    measure_held_beams(system, structure, u, scratch)
    find_gradient(system, structure, fraction + PROBE, u, scratch)
    size = find_step(system, structure, scratch) * increment / PROBE
    take_step(system, increment / PROBE, u, scratch)
    move_held_nodes(system, fraction + increment, u)
    return size


@kernel
def lowest_stiffness(
    system: System, structure: Structure, sweeps: int, mode: Floats, scratch: Scratch
) -> float:
    """Estimate the lowest eigenvalue of the factorised stiffness by inverse iteration.

    `mode` holds the current guess of the eigenvector and is improved.
    """
    lowest = math.inf
    step = scratch.step
    for _ in range(sweeps):
        size = math.sqrt(dot(mode, mode))
        for node in range(len(system.block)):
            block = system.block[node]
            if block >= 0:
                moves = structure.active[node] == ACTIVE
                held = system.held[node]
                step[block, 0] = mode[node, 0] / size if moves and not held & HELD_X else 0.0
                step[block, 1] = mode[node, 1] / size if moves and not held & HELD_Y else 0.0
        solve(structure, scratch)
        clear(mode, len(mode))
        take_step(system, 1.0, mode, scratch)
        lowest = 1.0 / math.sqrt(dot(mode, mode))
    return lowest


@kernel
def is_near(previous: float, now: float) -> bool:
    """Whether the lowest stiffness changed little enough to be followed."""
    return now > LARGEST_SOFTENING * previous and previous > LARGEST_SOFTENING * now


@inlined
def has_second_equilibrium(
    system: System, structure: Structure, u: Floats, mode: Floats, turned: Floats, scratch: Scratch
) -> bool:
    """Whether a design that has nearly lost its stability could have gone the other way.

    `mode` is the softest motion and `turned` the displacement where it was softest.
    From the final state, what the structure has moved along that mode since is
    reflected, and the energy is followed down from there.
    """
    other = scratch.vectors[4]
    copy(u, other)
    along = 0.0
    size = dot(mode, mode)
    for node in range(len(u)):
        for axis in range(2):
            along += (u[node, axis] - turned[node, axis]) * mode[node, axis]
    move(other, -2.0 * along / size, mode)
    move_held_nodes(system, 1.0, other)
    if descend(system, structure, 1.0, other, scratch) != CONVERGED:
        return False
    return largest_difference(other, u) > DISTINCT


@inlined
def advance_load(
    system: System,
    structure: Structure,
    fraction: float,
    increment: float,
    u: Floats,
    scratch: Scratch,
) -> bool:
    """Predict and correct one increment; False if it strays too far from the prediction."""
    predicted = scratch.vectors[6]
    size = predict(system, structure, fraction, increment, u, scratch)
    if not size <= 4.0 * LONGEST_STEP:
        return False
    copy(u, predicted)
    status = newton(system, structure, fraction + increment, u, scratch, LONGEST_STEP, False)
    if status != CONVERGED:
        return False
    return largest_difference(u, predicted) <= LARGEST_CORRECTION * size + 1e-6


@kernel
def stiffness_is_definite(
    system: System, structure: Structure, fraction: float, u: Floats, scratch: Scratch
) -> bool:
    """Factorise the stiffness at `u`; False if the equilibrium there is unstable."""
    measure_held_beams(system, structure, u, scratch)
    find_gradient(system, structure, fraction, u, scratch)
    find_stiffness(system, structure, False, scratch)
    return factorise(structure, scratch)


@kernel
def follow_path(
    system: System, structure: Structure, u: Floats, scratch: Scratch, largest: float
) -> int:
    """Load from rest in increments that stay on one stable path.

    An increment counts only if every stiffness on the way is positive definite, if the
    correction is small beside the prediction and if the lowest stiffness changes
    little; else it is halved. SNAPPED means that even the smallest increment fails, or
    that the path comes so near to a loss of stability that there is a second way to go;
    `u` is then one of the equilibria at full load.

    Parameters
    ----------
    largest
        Upper bound on the increment (1 for none); small for a slow, fine check.
    """
    previous, mode = scratch.vectors[5], scratch.vectors[3]
    softest_mode, turned = scratch.vectors[2], scratch.vectors[1]
    for node in range(len(u)):
        for axis in range(2):
            u[node, axis] = 0.0
            mode[node, axis] = math.cos(1.0 + 3.0 * node + axis)
    if not stiffness_is_definite(system, structure, 0.0, u, scratch):
        return UNCONVERGED
    at_rest = stiffness = softest = lowest_stiffness(system, structure, 12, mode, scratch)
    fraction = 0.0
    increment = min(LARGEST_INCREMENT, largest)
    while fraction < 1.0 and increment >= SMALLEST_INCREMENT:
        increment = min(increment, 1.0 - fraction)
        copy(u, previous)
        advanced = advance_load(system, structure, fraction, increment, u, scratch)
        now = 0.0
        if advanced:
            now = lowest_stiffness(system, structure, 4, mode, scratch)
            advanced = is_near(stiffness, now) or increment < 1.0 / 256.0
        if advanced:
            fraction = fraction + increment if increment < 1.0 - fraction else 1.0
            stiffness = now
            if now < softest:
                softest = now
                copy(mode, softest_mode)
                copy(u, turned)
            increment = min(2.0 * increment, LARGEST_INCREMENT, largest)
        else:
            copy(previous, u)
            increment *= 0.5
            if not stiffness_is_definite(system, structure, fraction, u, scratch):
                break
    if fraction == 1.0:
        if softest < DIP * min(at_rest, stiffness) and has_second_equilibrium(
            system, structure, u, softest_mode, turned, scratch
        ):
            return SNAPPED
        return CONVERGED
    move_held_nodes(system, 1.0, u)
    if descend(system, structure, 1.0, u, scratch) == CONVERGED:
        return SNAPPED
    return UNCONVERGED
