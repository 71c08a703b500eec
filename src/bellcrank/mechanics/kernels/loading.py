"""The way from rest to the full load, which defines the response of a design."""

from __future__ import annotations

import math

from bellcrank.mechanics.kernels._compile import inlined, kernel
from bellcrank.mechanics.kernels.arrays import (
    CONVERGED,
    SNAPPED,
    UNCONVERGED,
    Floats,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.fields import clear, copy, dot, largest_difference, move, pair
from bellcrank.mechanics.kernels.newton import descend, newton
from bellcrank.mechanics.kernels.structure import HANGING
from bellcrank.mechanics.kernels.tangents import (
    FINE_INCREMENT,
    LARGEST_DEPARTURE,
    LARGEST_INCREMENT,
    LARGEST_SOFTENING,
    LAST_TANGENT,
    LONGEST_STEP,
    MODE,
    NEXT_TANGENT,
    PATH_TOLERANCE,
    PREVIOUS,
    SOFT,
    SOFTENING_WHERE_SOFT,
    SOFTEST_MODE,
    TANGENT,
    TANGENT_AT_REST,
    TURNED,
    curvature_left,
    find_tangent,
    is_joined,
    is_mild,
    lowest_stiffness,
    move_held_nodes,
    nonlinearity_of,
    stiffness_is_definite,
)
from bellcrank.mechanics.kernels.tension import add_tension_at, clear_tension

REMNANT = 1e-12
SMALLEST_INCREMENT = 1.0 / 1024.0
DIP = 0.5
"""A path whose lowest stiffness falls below this part of its values at rest and at full load
has passed near a loss of stability; whether a second equilibrium exists is then looked up."""
DISTINCT = 1e-3
"""Distance, in lattice units, at which two equilibria are two."""


@kernel
def place_hanging_pieces(system: System, structure: Structure, u: Floats) -> None:
    """Let a piece that hangs from one moved node follow as a rigid body.

    Of all stress-free positions it takes the one nearest to rest (least sum of
    squared displacements), which is where vanishing springs to rest would hold it.
    """
    nodes = structure.sizes[0]
    for first in range(nodes):
        node = structure.order[first]
        if structure.parent[node] < 0 and structure.active[node] == HANGING:
            last = first + 1
            while last < nodes and structure.parent[structure.order[last]] >= 0:
                last += 1
            place_hanging_piece(system, structure, first, last, u)


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


@inlined
def next_increment(
    increment: float, departure: float, before: float, after: float, softening: float
) -> float:
    """Increment that brings departure and softening well within what is allowed."""
    by_departure = (0.5 * LARGEST_DEPARTURE / max(departure, 1e-9)) ** (1.0 / 3.0)
    change = abs(math.log(max(after, 1e-9 * before) / before))
    by_softening = -0.8 * math.log(softening) / max(change, 1e-9)
    followed = max(FINE_INCREMENT, increment * max(0.25, by_softening))
    return min(increment * min(2.0, max(0.25, by_departure)), followed)


@inlined
def arrive(
    system: System, structure: Structure, increment: float, end: float, u: Floats, scratch: Scratch
) -> tuple[float, float]:
    """Bring an extrapolated `u` to the equilibrium at the end of an increment.

    Returns the lowest stiffness there, and how far the increment departs from the tangents
    at both ends; 0 and infinity if there is no equilibrium.
    """
    previous, tangent = scratch.vectors[PREVIOUS], scratch.vectors[TANGENT]
    next_tangent = scratch.vectors[NEXT_TANGENT]
    move_held_nodes(system, end, u)
    clear_tension(scratch)
    add_tension_at(system, structure, previous, 1.0, scratch)
    tolerance = system.tolerance if end == 1.0 else PATH_TOLERANCE
    now, departure = 0.0, math.inf
    if newton(system, structure, end, u, scratch, tolerance, LONGEST_STEP) == CONVERGED:
        now = lowest_stiffness(system, structure, scratch.vectors[MODE], scratch)
        find_tangent(system, structure, end, u, next_tangent, scratch)
        departure = curvature_left(previous, u, tangent, next_tangent, increment)
    return now, departure


@inlined
def has_second_equilibrium(
    system: System, structure: Structure, u: Floats, scratch: Scratch
) -> bool:
    """Whether a design that has nearly lost its stability could have gone the other way.

    What the structure has moved along its softest motion since it was softest is
    reflected, and the energy is followed down from there.
    """
    other, mode = scratch.vectors[PREVIOUS], scratch.vectors[SOFTEST_MODE]
    turned = scratch.vectors[TURNED]
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
def could_go_elsewhere(system: System, structure: Structure, u: Floats, scratch: Scratch) -> bool:
    """Whether a response is far from linear and not the only equilibrium."""
    rest, at_rest = scratch.vectors[PREVIOUS], scratch.vectors[TANGENT_AT_REST]
    clear(rest, len(rest))
    detour = curvature_left(rest, u, at_rest, scratch.vectors[TANGENT], 1.0)
    return not is_mild(nonlinearity_of(u, at_rest), detour) and has_second_equilibrium(
        system, structure, u, scratch
    )


@kernel
def follow_path(
    system: System, structure: Structure, u: Floats, scratch: Scratch, largest: float
) -> int:
    """Load from rest in increments that stay on one stable path.

    An increment counts only if it ends at a stable equilibrium that is joined to the one
    before; else it is halved. SNAPPED means that even the smallest increment fails, or
    that the path comes so near to a loss of stability that there is another way to go; `u`
    is then one of the equilibria at full load.

    Parameters
    ----------
    largest
        Upper bound on the increment (1 for none); small for a slow, fine check.
    """
    previous, mode = scratch.vectors[PREVIOUS], scratch.vectors[MODE]
    tangent, last_tangent = scratch.vectors[TANGENT], scratch.vectors[LAST_TANGENT]
    for node in range(len(u)):
        for axis in range(2):
            u[node, axis] = 0.0
            mode[node, axis] = math.cos(1.0 + 3.0 * node + axis)
    if not stiffness_is_definite(system, structure, 0.0, u, scratch):
        return UNCONVERGED
    lowest_stiffness(system, structure, mode, scratch)
    at_rest = softest = stiffness = lowest_stiffness(system, structure, mode, scratch)
    find_tangent(system, structure, 0.0, u, tangent, scratch)
    copy(tangent, last_tangent)
    copy(tangent, scratch.vectors[TANGENT_AT_REST])
    fraction = 0.0
    increment = last_increment = min(LARGEST_INCREMENT, largest)
    while fraction < 1.0 and increment >= SMALLEST_INCREMENT:
        increment = min(increment, 1.0 - fraction)
        end = fraction + increment
        # Rounding must not leave a last increment too small to be judged.
        if 1.0 - end < REMNANT:
            end = 1.0
        copy(u, previous)
        extrapolate(u, tangent, last_tangent, increment, last_increment)
        now, departure = arrive(system, structure, increment, end, u, scratch)
        soft = min(stiffness, now) < SOFT * at_rest
        softening = SOFTENING_WHERE_SOFT if soft else LARGEST_SOFTENING
        following = next_increment(increment, departure, stiffness, now, softening)
        if is_joined(departure, stiffness, now, softening, increment):
            fraction, stiffness, last_increment = end, now, increment
            copy(tangent, last_tangent)
            copy(scratch.vectors[NEXT_TANGENT], tangent)
            if now < softest:
                softest = now
                copy(mode, scratch.vectors[SOFTEST_MODE])
                copy(u, scratch.vectors[TURNED])
            increment = min(following, LARGEST_INCREMENT, largest)
        else:
            copy(previous, u)
            increment = following
    if fraction == 1.0:
        if softest < DIP * min(at_rest, stiffness) and could_go_elsewhere(
            system, structure, u, scratch
        ):
            return SNAPPED
        return CONVERGED
    move_held_nodes(system, 1.0, u)
    if descend(system, structure, 1.0, u, scratch) == CONVERGED:
        return SNAPPED
    return UNCONVERGED
