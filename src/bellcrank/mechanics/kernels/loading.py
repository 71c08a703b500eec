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

LARGEST_INCREMENT = 0.5
SMALLEST_INCREMENT = 1.0 / 1024.0
FINE_INCREMENT = 1.0 / 128.0
LARGEST_DEPARTURE = 0.2
"""Of an increment from the mean of the tangents at its ends: more means that the path bends
too much to be followed, or jumps."""
LARGEST_SOFTENING = 0.5
"""Change of the lowest stiffness in one increment, up or down, that calls for smaller ones,
down to `FINE_INCREMENT`."""
DIP = 0.5
"""A path whose lowest stiffness falls below this part of its values before and after has
passed near a loss of stability; whether a second equilibrium exists is then looked up."""
DISTINCT = 1e-3
"""Distance, in lattice units, at which two equilibria are two."""
LARGEST_NONLINEARITY = 0.6
LARGEST_DETOUR = 0.4
"""Departures of a response from the tangent at rest, and from the mean of the tangents at
rest and at full load, in parts of the largest displacement, beyond which it may belong to
another branch than that reached from rest. Of 543 responses on wrong branches found along a
chain on the crane among snapping designs, all exceed one of them: those below 0.62 in the
first were above 0.73 in the second."""
JUMP = 0.1
LONG_JUMP = 0.3
DETOUR_AFTER_JUMP = 0.13
NONLINEARITY_AFTER_LONG_JUMP = 0.5
"""Stricter where a flip moves some node far. In 14,800 proposals of eight chains the limits
above alone let two wrong branches through, both after jumps of more than 0.1."""
PROBE = 1e-6
PATH_TOLERANCE = 1e-6
"""Displacement error of equilibria on the way."""
LONGEST_STEP = 0.5

# Rows of `scratch.vectors` in use here; `descend` takes the last one.
PREVIOUS, MOVED, TANGENT, NEXT_TANGENT, LAST_TANGENT, MODE, SOFTEST_MODE, TURNED = range(8)


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
    move_held_nodes(system, 1.0, tangent)


@inlined
def extrapolate(
    u: Floats, tangent: Floats, last_tangent: Floats, increment: float, last_increment: float
) -> None:
    """Advance `u` along the path to second order.

    The path's curvature comes from the tangents here and one increment ago.
    """
    bend = 0.5 * increment * increment / last_increment
    for node in range(len(u)):
        for axis in range(2):
            curve = tangent[node, axis] - last_tangent[node, axis]
            u[node, axis] += increment * tangent[node, axis] + bend * curve


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


@inlined
def curvature_left(
    start: Floats, end: Floats, first: Floats, last: Floats, increment: float
) -> float:
    """How far an increment departs from the mean of the tangents at its two ends.

    As a part of the movement. A smooth path leaves something of third order in the
    increment; a jump to another branch is not in either tangent.
    """
    departure = movement = 0.0
    for node in range(len(start)):
        for axis in range(2):
            step = end[node, axis] - start[node, axis]
            mean = 0.5 * increment * (first[node, axis] + last[node, axis])
            departure = max(departure, abs(step - mean))
            movement = max(movement, abs(step))
    return departure / max(movement, 1e-300)


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
def next_increment(departure: float) -> float:
    """Factor that brings what is left of the curvature to what is allowed."""
    return min(2.0, max(0.25, (0.5 * LARGEST_DEPARTURE / max(departure, 1e-9)) ** (1.0 / 3.0)))


@kernel
def agrees_with_tangents(
    system: System, structure: Structure, known_u: Floats, u: Floats, scratch: Scratch
) -> bool:
    """Whether an equilibrium at full load is sure to be the one reached from rest.

    It is if it lies near what the stiffness at rest predicts, and near what the mean of
    the tangents at rest and at full load predicts; nearer, if it is far from the known
    equilibrium that it was found from. With the factor of `u` at hand.
    """
    rest, first = scratch.vectors[PREVIOUS], scratch.vectors[TANGENT]
    last = scratch.vectors[NEXT_TANGENT]
    find_tangent(system, structure, 1.0, u, last, scratch)
    clear(rest, len(rest))
    if not stiffness_is_definite(system, structure, 0.0, rest, scratch):
        return False
    find_tangent(system, structure, 0.0, rest, first, scratch)
    nonlinearity = largest_difference(u, first) / largest_component(u)
    departure = curvature_left(rest, u, first, last, 1.0)
    jump = largest_difference(u, known_u)
    if jump > LONG_JUMP and nonlinearity > NONLINEARITY_AFTER_LONG_JUMP:
        return False
    if jump > JUMP and departure > DETOUR_AFTER_JUMP:
        return False
    return nonlinearity <= LARGEST_NONLINEARITY and departure <= LARGEST_DETOUR


@kernel
def follow_path(
    system: System, structure: Structure, u: Floats, scratch: Scratch, largest: float
) -> int:
    """Load from rest in increments that stay on one stable path.

    An increment counts only if it ends at a stable equilibrium, if the tangents at both
    ends account for it and if the lowest stiffness changes little; else it is halved.
    SNAPPED means that even the smallest increment fails, or that the path comes so near to
    a loss of stability that there is a second way to go; `u` is then one of the equilibria
    at full load.

    Parameters
    ----------
    largest
        Upper bound on the increment (1 for none); small for a slow, fine check.
    """
    previous, mode = scratch.vectors[PREVIOUS], scratch.vectors[MODE]
    tangent, last_tangent = scratch.vectors[TANGENT], scratch.vectors[LAST_TANGENT]
    next_tangent = scratch.vectors[NEXT_TANGENT]
    softest_mode, turned = scratch.vectors[SOFTEST_MODE], scratch.vectors[TURNED]
    for node in range(len(u)):
        for axis in range(2):
            u[node, axis] = 0.0
            mode[node, axis] = math.cos(1.0 + 3.0 * node + axis)
    if not stiffness_is_definite(system, structure, 0.0, u, scratch):
        return UNCONVERGED
    at_rest = stiffness = softest = lowest_stiffness(system, structure, 8, mode, scratch)
    find_tangent(system, structure, 0.0, u, tangent, scratch)
    copy(tangent, last_tangent)
    fraction = 0.0
    increment = last_increment = min(LARGEST_INCREMENT, largest)
    while fraction < 1.0 and increment >= SMALLEST_INCREMENT:
        increment = min(increment, 1.0 - fraction)
        end = fraction + increment if increment < 1.0 - fraction else 1.0
        copy(u, previous)
        extrapolate(u, tangent, last_tangent, increment, last_increment)
        move_held_nodes(system, end, u)
        tolerance = system.tolerance if end == 1.0 else PATH_TOLERANCE
        now, departure = 0.0, math.inf
        if newton(
            system, structure, end, u, scratch, tolerance, LONGEST_STEP, True
        ) == CONVERGED and stiffness_is_definite(system, structure, end, u, scratch):
            now = lowest_stiffness(system, structure, 3, mode, scratch)
            find_tangent(system, structure, end, u, next_tangent, scratch)
            departure = curvature_left(previous, u, tangent, next_tangent, increment)
        followed = is_near(stiffness, now) or increment < FINE_INCREMENT
        if departure <= LARGEST_DEPARTURE and followed:
            fraction, stiffness, last_increment = end, now, increment
            copy(tangent, last_tangent)
            copy(next_tangent, tangent)
            if now < softest:
                softest = now
                copy(mode, softest_mode)
                copy(u, turned)
            increment *= next_increment(departure)
            increment = min(increment, LARGEST_INCREMENT, largest)
        else:
            copy(previous, u)
            increment *= min(0.5, next_increment(departure))
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
