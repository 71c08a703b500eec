"""The path from rest to full load, which defines the response of a design."""

from __future__ import annotations

import math

from bellcrank.mechanics.kernels._compile import inlined, kernel
from bellcrank.mechanics.kernels.arrays import (
    CONVERGED,
    HANGING,
    SNAPPED,
    UNCONVERGED,
    Floats,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.fields import clear, copy, dot, largest_difference, move, pair
from bellcrank.mechanics.kernels.newton import add_tension_at, clear_tension, descend, newton
from bellcrank.mechanics.kernels.tangents import (
    FINE_INCREMENT,
    LARGEST_DEPARTURE,
    LARGEST_INCREMENT,
    LARGEST_SOFTENING,
    LONGEST_STEP,
    PATH_TOLERANCE,
    SOFT,
    SOFTENING_WHERE_SOFT,
    find_tangent,
    is_joined,
    is_nearly_linear,
    lowest_stiffness,
    move_held_nodes,
    nonlinearity_of,
    path_departure,
    stiffness_is_definite,
)

REMAINDER = 1e-12
"""Part of the load that is not left as an increment of its own."""
SMALLEST_INCREMENT = 1.0 / 1024.0
DIP = 0.5
"""Lowest stiffness on the path, as a part of its values at rest and at full load, below which the
path has passed near a loss of stability, and a second equilibrium is searched for."""
DISTINCT = 1e-3
"""Distance, in lattice units, of two equilibria that count as different."""


@kernel
def place_hanging_pieces(system: System, structure: Structure, u: Floats) -> None:
    """Move pieces that hang from one moved node as rigid bodies.

    Of all stress-free positions each takes the one closest to rest (least sum of squared
    displacements), which is the limit of vanishing springs to rest.
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
    """Rotate one piece about the node from which it hangs, the first of the piece."""
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

    The curvature of the path is the difference of the tangents here and one increment ago.
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
    """Return the increment that brings departure and softening well within their limits."""
    by_departure = (0.5 * LARGEST_DEPARTURE / max(departure, 1e-9)) ** (1.0 / 3.0)
    change = abs(math.log(max(after, 1e-9 * before) / before))
    by_softening = -0.8 * math.log(softening) / max(change, 1e-9)
    followed = max(FINE_INCREMENT, increment * max(0.25, by_softening))
    return min(increment * min(2.0, max(0.25, by_departure)), followed)


@inlined
def correct(
    system: System, structure: Structure, increment: float, end: float, u: Floats, scratch: Scratch
) -> tuple[float, float]:
    """Bring an extrapolated `u` to the equilibrium at the end of an increment.

    Returns the lowest stiffness there, and the departure of the increment from the tangents at
    both ends; 0 and infinity if there is no equilibrium.
    """
    vectors = scratch.vectors
    move_held_nodes(system, end, u)
    clear_tension(scratch)
    add_tension_at(system, structure, vectors.previous, 1.0, scratch)
    tolerance = system.tolerance if end == 1.0 else PATH_TOLERANCE
    now, departure = 0.0, math.inf
    if newton(system, structure, end, u, scratch, tolerance, LONGEST_STEP) == CONVERGED:
        now = lowest_stiffness(system, structure, vectors.mode, scratch)
        find_tangent(system, structure, end, u, vectors.next_tangent, scratch)
        departure = path_departure(
            vectors.previous, u, vectors.tangent, vectors.next_tangent, increment
        )
    return now, departure


@inlined
def has_second_equilibrium(
    system: System, structure: Structure, u: Floats, scratch: Scratch
) -> bool:
    """Whether a design that nearly loses its stability has an equilibrium on another branch.

    The movement along the softest motion since the point of lowest stiffness is reflected, and
    the energy is followed downwards from there.
    """
    other, mode = scratch.vectors.previous, scratch.vectors.softest_mode
    at_softest = scratch.vectors.at_softest
    copy(u, other)
    along = 0.0
    size = dot(mode, mode)
    for node in range(len(u)):
        for axis in range(2):
            along += (u[node, axis] - at_softest[node, axis]) * mode[node, axis]
    move(other, -2.0 * along / size, mode)
    move_held_nodes(system, 1.0, other)
    if descend(system, structure, 1.0, other, scratch) != CONVERGED:
        return False
    return largest_difference(other, u) > DISTINCT


@inlined
def is_ambiguous(system: System, structure: Structure, u: Floats, scratch: Scratch) -> bool:
    """Whether a response is far from linear and not the only equilibrium."""
    rest, at_rest = scratch.vectors.previous, scratch.vectors.tangent_at_rest
    clear(rest, len(rest))
    detour = path_departure(rest, u, at_rest, scratch.vectors.tangent, 1.0)
    return not is_nearly_linear(nonlinearity_of(u, at_rest), detour) and has_second_equilibrium(
        system, structure, u, scratch
    )


@kernel
def follow_path(
    system: System, structure: Structure, u: Floats, scratch: Scratch, largest: float
) -> int:
    """Load from rest in increments that stay on one stable path.

    An increment is accepted only if it ends at a stable equilibrium that is connected to the one
    before; otherwise it is halved. SNAPPED means that even the smallest increment fails, or that
    the path comes so close to a loss of stability that another branch opens; `u` is then one of
    the equilibria at full load.

    Parameters
    ----------
    largest
        Upper bound on the increment (1 for none); small for a fine verification.
    """
    vectors = scratch.vectors
    previous, mode = vectors.previous, vectors.mode
    tangent, last_tangent = vectors.tangent, vectors.last_tangent
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
    copy(tangent, vectors.tangent_at_rest)
    fraction = 0.0
    increment = last_increment = min(LARGEST_INCREMENT, largest)
    while fraction < 1.0 and increment >= SMALLEST_INCREMENT:
        increment = min(increment, 1.0 - fraction)
        end = fraction + increment
        # Rounding must not leave a last increment that is too small.
        if 1.0 - end < REMAINDER:
            end = 1.0
        copy(u, previous)
        extrapolate(u, tangent, last_tangent, increment, last_increment)
        now, departure = correct(system, structure, increment, end, u, scratch)
        soft = min(stiffness, now) < SOFT * at_rest
        softening = SOFTENING_WHERE_SOFT if soft else LARGEST_SOFTENING
        following = next_increment(increment, departure, stiffness, now, softening)
        if is_joined(departure, stiffness, now, softening, increment):
            fraction, stiffness, last_increment = end, now, increment
            copy(tangent, last_tangent)
            copy(vectors.next_tangent, tangent)
            if now < softest:
                softest = now
                copy(mode, vectors.softest_mode)
                copy(u, vectors.at_softest)
            increment = min(following, LARGEST_INCREMENT, largest)
        else:
            copy(previous, u)
            increment = following
    if fraction == 1.0:
        if softest < DIP * min(at_rest, stiffness) and is_ambiguous(system, structure, u, scratch):
            return SNAPPED
        return CONVERGED
    move_held_nodes(system, 1.0, u)
    if descend(system, structure, 1.0, u, scratch) == CONVERGED:
        return SNAPPED
    return UNCONVERGED
