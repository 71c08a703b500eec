"""Verification that an equilibrium found by a warm start is the one reached from rest.

A chain accepts hundreds of designs in a row, and an equilibrium on another branch would pass on
to all designs that follow. A response that is not clearly on the branch reached from rest is
therefore computed again from rest.
"""

from __future__ import annotations

from bellcrank.mechanics.kernels._compile import inlined, kernel
from bellcrank.mechanics.kernels.arrays import CONVERGED, Floats, Scratch, Structure, System
from bellcrank.mechanics.kernels.fields import clear, copy, largest_difference
from bellcrank.mechanics.kernels.newton import add_tension_at, clear_tension, newton
from bellcrank.mechanics.kernels.tangents import (
    LARGEST_INCREMENT,
    LARGEST_SOFTENING,
    LONGEST_STEP,
    PATH_TOLERANCE,
    find_tangent,
    is_joined,
    is_nearly_linear,
    lowest_stiffness,
    move_held_nodes,
    nonlinearity_of,
    path_departure,
    stiffness_is_definite,
)

UNCHANGED = 1e-6
"""Largest change of a displacement component, in lattice units, up to which a flip has changed
unloaded beams only; so do a quarter to a third of the flips in a long chain on the crane."""
JUMP = 0.1
LONG_JUMP = 0.3
DETOUR_AFTER_JUMP = 0.13
NONLINEARITY_AFTER_LONG_JUMP = 0.5
"""Limits in addition to those of `is_nearly_linear`, for flips that change a displacement component
by more than `JUMP` or `LONG_JUMP` (lattice units). In 14,800 proposals of eight chains
`is_nearly_linear` alone accepted two wrong branches, both after such flips."""
STIFF = 0.8
"""Ratio of the lowest stiffness at a point of the path to the smaller value at rest and at full
load. Below this ratio the path is followed in small increments."""


@kernel
def is_reached_from_rest(
    system: System, structure: Structure, guess: Floats, u: Floats, scratch: Scratch
) -> bool:
    """Whether an equilibrium at full load is certainly the one reached from rest.

    `guess` is the displacement at which the warm start began. True if `u` equals it: the flipped
    beam carries no load. True if `u` is close to what the tangents at rest and at full load
    predict; the limits are tighter if `u` is far from `guess`. Otherwise true if equilibria that
    keep their stiffness connect `u` to rest. This last test is not used if the response is both
    far from the guess and strongly nonlinear: the connection could then pass a bifurcation
    between two points. Displacements are (N, 2), in lattice units. The current factor must be
    that of `u`.
    """
    jump = largest_difference(u, guess)
    if jump <= UNCHANGED:
        return True
    rest, first = scratch.vectors.previous, scratch.vectors.tangent
    last = scratch.vectors.next_tangent
    find_tangent(system, structure, 1.0, u, last, scratch)
    clear(rest, len(rest))
    if not stiffness_is_definite(system, structure, 0.0, rest, scratch):
        return False
    find_tangent(system, structure, 0.0, rest, first, scratch)
    nonlinearity = nonlinearity_of(u, first)
    detour = path_departure(rest, u, first, last, 1.0)
    linear = is_nearly_linear(nonlinearity, detour)
    far = jump > LONG_JUMP and nonlinearity > NONLINEARITY_AFTER_LONG_JUMP
    far |= jump > JUMP and detour > DETOUR_AFTER_JUMP
    if linear and not far:
        return True
    if jump > JUMP and not linear:
        return False
    return is_joined_to_rest(system, structure, u, scratch)


@kernel
def interpolate(
    start: Floats, end: Floats, first: Floats, last: Floats, increment: float, middle: Floats
) -> None:
    """Fill `middle` with the displacement half way between two points of the path.

    It is that of the cubic with their tangents; `increment` is the fraction of the full load
    between the two points.
    """
    for node in range(len(middle)):
        for axis in range(2):
            middle[node, axis] = 0.5 * (start[node, axis] + end[node, axis]) + 0.125 * increment * (
                first[node, axis] - last[node, axis]
            )


@inlined
def is_joined_to_rest(system: System, structure: Structure, u: Floats, scratch: Scratch) -> bool:
    """Connect `u` to rest by equilibria between; intervals are halved until their ends connect.

    Newton steps to the equilibria between start from interpolated displacements, which costs
    less than following the path. False if the lowest stiffness at a point between is below
    `STIFF` times the smaller of those at rest and at full load, if no equilibrium is found at a
    point, or if `MAX_KNOTS` points do not suffice: the path must then be followed. On entry the
    factor is that at rest, and `scratch.vectors` holds rest and the tangents at rest and at `u`.
    """
    vectors = scratch.vectors
    left, left_tangent, mode = vectors.previous, vectors.tangent, vectors.mode
    load, lowest = vectors.knot_load, vectors.knot_stiffness
    for node in range(len(u)):
        for axis in range(2):
            mode[node, axis] = u[node, axis] - left_tangent[node, axis]
    fraction = 0.0
    at_rest = stiffness = lowest_stiffness(system, structure, mode, scratch)
    copy(u, vectors.knot[0])
    copy(vectors.next_tangent, vectors.knot_tangent[0])
    if not stiffness_is_definite(system, structure, 1.0, u, scratch):
        return False
    load[0], lowest[0] = 1.0, lowest_stiffness(system, structure, mode, scratch)
    top = 0
    while top >= 0:
        right, right_tangent = vectors.knot[top], vectors.knot_tangent[top]
        increment = load[top] - fraction
        departure = path_departure(left, right, left_tangent, right_tangent, increment)
        if increment <= LARGEST_INCREMENT and is_joined(
            departure, stiffness, lowest[top], LARGEST_SOFTENING, increment
        ):
            copy(right, left)
            copy(right_tangent, left_tangent)
            fraction, stiffness = load[top], lowest[top]
            top -= 1
            continue
        top += 1
        if top == len(load):
            return False
        middle, tangent = vectors.knot[top], vectors.knot_tangent[top]
        half = fraction + 0.5 * increment
        interpolate(left, right, left_tangent, right_tangent, increment, middle)
        move_held_nodes(system, half, middle)
        clear_tension(scratch)
        add_tension_at(system, structure, left, 0.5, scratch)
        add_tension_at(system, structure, right, 0.5, scratch)
        status = newton(system, structure, half, middle, scratch, PATH_TOLERANCE, LONGEST_STEP)
        if status != CONVERGED:
            return False
        find_tangent(system, structure, half, middle, tangent, scratch)
        load[top] = half
        lowest[top] = lowest_stiffness(system, structure, mode, scratch)
        if lowest[top] < STIFF * min(at_rest, lowest[0]):
            return False
    return True
