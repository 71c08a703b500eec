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
    largest_component,
    largest_difference,
    move,
    pair,
)
from bellcrank.mechanics.kernels.newton import descend, find_step, newton, take_step
from bellcrank.mechanics.kernels.structure import ACTIVE, HANGING

LARGEST_INCREMENT = 0.25
SMALLEST_INCREMENT = 1.0 / 1024.0
FINE_INCREMENT = 1.0 / 128.0
LARGEST_CORRECTION = 0.15
"""Of an increment's prediction: more means that the path bends or jumps, so go slower."""
LARGEST_SOFTENING = 0.6
"""Change of the lowest stiffness in one increment, up or down, that calls for smaller ones,
down to `FINE_INCREMENT`."""
DIP = 0.5
"""A path whose lowest stiffness falls below this part of its values before and after has
passed near a loss of stability; whether a second equilibrium exists is then looked up."""
DISTINCT = 1e-3
"""Distance, in lattice units, at which two equilibria are two."""
LARGEST_NONLINEARITY = 0.6
"""Departure of a response from the linear one, in parts of the largest displacement, beyond
which it may belong to another branch than that reached from rest. Of 400 responses on wrong
branches found along chains on the crane, none was below 0.65."""
PROBE = 1e-6
PATH_TOLERANCE = 1e-6
"""Displacement error of equilibria on the way."""
LONGEST_STEP = 0.5

# Rows of `scratch.vectors` in use here; `descend` takes the last one.
PREVIOUS, PREDICTED, MOVED, TANGENT, LAST_TANGENT, MODE, SOFTEST_MODE, TURNED = range(8)


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


@kernel
def find_tangent(
    system: System,
    structure: Structure,
    fraction: float,
    u: Floats,
    tangent: Floats,
    scratch: Scratch,
) -> None:
    """Fill `tangent` with the change of the equilibrium `u` per unit of load.

    With the factor at hand, which must be that of `u`. The change of the gradient with
    the load is a difference over a very small increment.
    """
    gradient, moved = scratch.gradient, scratch.vectors[MOVED]
    find_gradient(system, structure, fraction, u, scratch)
    copy(gradient, tangent)
    copy(u, moved)
    move_held_nodes(system, fraction + PROBE, moved)
    measure_held_beams(system, structure, moved, scratch)
    find_gradient(system, structure, fraction + PROBE, moved, scratch)
    move(gradient, -1.0, tangent)
    find_step(system, structure, scratch)
    clear(tangent, len(tangent))
    take_step(system, 1.0 / PROBE, tangent, scratch)


@inlined
def extrapolate(
    u: Floats, tangent: Floats, last_tangent: Floats, increment: float, last_increment: float
) -> float:
    """Advance `u` along the path to second order; return the largest movement.

    The path's curvature comes from the tangents here and one increment ago.
    """
    bend = 0.5 * increment * increment / last_increment
    largest = 0.0
    for node in range(len(u)):
        for axis in range(2):
            curve = tangent[node, axis] - last_tangent[node, axis]
            step = increment * tangent[node, axis] + bend * curve
            u[node, axis] += step
            largest = max(largest, abs(step))
    return largest


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
    other = scratch.vectors[PREVIOUS]
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


@kernel
def correct(
    system: System, structure: Structure, fraction: float, size: float, u: Floats, scratch: Scratch
) -> float:
    """Bring a prediction to equilibrium; return the correction as a part of its `size`.

    Infinite if the prediction leads to no stable equilibrium nearby.
    """
    predicted = scratch.vectors[PREDICTED]
    move_held_nodes(system, fraction, u)
    copy(u, predicted)
    if not size <= 4.0 * LONGEST_STEP:
        return math.inf
    tolerance = system.tolerance if fraction >= 1.0 else PATH_TOLERANCE
    status = newton(system, structure, fraction, u, scratch, tolerance, LONGEST_STEP, True)
    if status != CONVERGED:
        return math.inf
    return (largest_difference(u, predicted) - 1e-6) / size


@kernel
def stiffness_is_definite(
    system: System, structure: Structure, fraction: float, u: Floats, scratch: Scratch
) -> bool:
    """Factorise the stiffness at `u`; False if the equilibrium there is unstable."""
    measure_held_beams(system, structure, u, scratch)
    find_gradient(system, structure, fraction, u, scratch)
    find_stiffness(system, structure, False, scratch)
    return factorise(structure, scratch)


@inlined
def next_increment(ratio: float) -> float:
    """Factor that brings the correction, which grows with the square, to what is allowed."""
    return min(2.0, max(0.2, math.sqrt(0.7 * LARGEST_CORRECTION / max(ratio, 1e-9))))


@kernel
def is_nearly_linear(system: System, structure: Structure, u: Floats, scratch: Scratch) -> bool:
    """Whether the response at full load is near what the stiffness at rest predicts."""
    linear, tangent = scratch.vectors[PREVIOUS], scratch.vectors[TANGENT]
    clear(linear, len(linear))
    if not stiffness_is_definite(system, structure, 0.0, linear, scratch):
        return False
    find_tangent(system, structure, 0.0, linear, tangent, scratch)
    copy(tangent, linear)
    move_held_nodes(system, 1.0, linear)
    return largest_difference(u, linear) <= LARGEST_NONLINEARITY * largest_component(u)


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
    previous, mode = scratch.vectors[PREVIOUS], scratch.vectors[MODE]
    tangent, last_tangent = scratch.vectors[TANGENT], scratch.vectors[LAST_TANGENT]
    softest_mode, turned = scratch.vectors[SOFTEST_MODE], scratch.vectors[TURNED]
    for node in range(len(u)):
        for axis in range(2):
            u[node, axis] = 0.0
            mode[node, axis] = math.cos(1.0 + 3.0 * node + axis)
    if not stiffness_is_definite(system, structure, 0.0, u, scratch):
        return UNCONVERGED
    at_rest = stiffness = softest = lowest_stiffness(system, structure, 12, mode, scratch)
    find_tangent(system, structure, 0.0, u, tangent, scratch)
    copy(tangent, last_tangent)
    fraction = 0.0
    increment = last_increment = min(LARGEST_INCREMENT, largest)
    while fraction < 1.0 and increment >= SMALLEST_INCREMENT:
        increment = min(increment, 1.0 - fraction)
        end = fraction + increment if increment < 1.0 - fraction else 1.0
        copy(u, previous)
        size = extrapolate(u, tangent, last_tangent, increment, last_increment)
        ratio = correct(system, structure, end, size, u, scratch)
        now = 0.0
        if ratio <= LARGEST_CORRECTION and stiffness_is_definite(
            system, structure, end, u, scratch
        ):
            now = lowest_stiffness(system, structure, 4, mode, scratch)
        if is_near(stiffness, now) or (now > 0.0 and increment < FINE_INCREMENT):
            fraction, stiffness, last_increment = end, now, increment
            if now < softest:
                softest = now
                copy(mode, softest_mode)
                copy(u, turned)
            if fraction < 1.0:
                copy(tangent, last_tangent)
                find_tangent(system, structure, fraction, u, tangent, scratch)
            increment *= next_increment(ratio)
            increment = min(increment, LARGEST_INCREMENT, largest)
        else:
            copy(previous, u)
            increment *= min(0.5, next_increment(ratio))
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
