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
from bellcrank.mechanics.kernels.energy import add_tension_at, clear_tension
from bellcrank.mechanics.kernels.fields import copy, pair
from bellcrank.mechanics.kernels.newton import descend, newton
from bellcrank.mechanics.kernels.structure import HANGING
from bellcrank.mechanics.kernels.tangents import (
    LARGEST_DEPARTURE,
    LARGEST_INCREMENT,
    LAST_TANGENT,
    LONGEST_STEP,
    MODE,
    NEXT_TANGENT,
    PATH_TOLERANCE,
    PREVIOUS,
    TANGENT,
    curvature_left,
    find_tangent,
    is_joined,
    lowest_stiffness,
    move_held_nodes,
    stiffness_is_definite,
)

SMALLEST_INCREMENT = 1.0 / 1024.0


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
def next_increment(departure: float) -> float:
    """Factor that brings what is left of the curvature to what is allowed."""
    return min(2.0, max(0.25, (0.5 * LARGEST_DEPARTURE / max(departure, 1e-9)) ** (1.0 / 3.0)))


@kernel
def follow_path(
    system: System, structure: Structure, u: Floats, scratch: Scratch, largest: float
) -> int:
    """Load from rest in increments that stay on one stable path.

    An increment counts only if it ends at a stable equilibrium that is joined to the one
    before; else it is halved. SNAPPED means that even the smallest increment fails; `u` is
    then one of the equilibria at full load.

    Parameters
    ----------
    largest
        Upper bound on the increment (1 for none); small for a slow, fine check.
    """
    previous, mode = scratch.vectors[PREVIOUS], scratch.vectors[MODE]
    tangent, last_tangent = scratch.vectors[TANGENT], scratch.vectors[LAST_TANGENT]
    next_tangent = scratch.vectors[NEXT_TANGENT]
    for node in range(len(u)):
        for axis in range(2):
            u[node, axis] = 0.0
            mode[node, axis] = math.cos(1.0 + 3.0 * node + axis)
    if not stiffness_is_definite(system, structure, 0.0, u, scratch):
        return UNCONVERGED
    lowest_stiffness(system, structure, mode, scratch)
    stiffness = lowest_stiffness(system, structure, mode, scratch)
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
        clear_tension(scratch)
        add_tension_at(system, structure, previous, 1.0, scratch)
        tolerance = system.tolerance if end == 1.0 else PATH_TOLERANCE
        now, departure = 0.0, math.inf
        status = newton(system, structure, end, u, scratch, tolerance, LONGEST_STEP)
        if status == CONVERGED:
            now = lowest_stiffness(system, structure, mode, scratch)
            find_tangent(system, structure, end, u, next_tangent, scratch)
            departure = curvature_left(previous, u, tangent, next_tangent, increment)
        if is_joined(departure, stiffness, now, increment):
            fraction, stiffness, last_increment = end, now, increment
            copy(tangent, last_tangent)
            copy(next_tangent, tangent)
            increment *= next_increment(departure)
            increment = min(increment, LARGEST_INCREMENT, largest)
        else:
            copy(previous, u)
            increment *= min(0.5, next_increment(departure))
    if fraction == 1.0:
        return CONVERGED
    move_held_nodes(system, 1.0, u)
    if descend(system, structure, 1.0, u, scratch) == CONVERGED:
        return SNAPPED
    return UNCONVERGED
