"""Whether an equilibrium found from that of another design is the one reached from rest.

A chain accepts hundreds of designs in a row; one that slips onto another branch takes all
that follow with it. So whatever is not plainly on the branch reached from rest, is loaded
from rest.
"""

from __future__ import annotations

from bellcrank.mechanics.kernels._compile import inlined, kernel
from bellcrank.mechanics.kernels.arrays import (
    CONVERGED,
    Floats,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.fields import (
    clear,
    copy,
    largest_difference,
)
from bellcrank.mechanics.kernels.newton import newton
from bellcrank.mechanics.kernels.tangents import (
    FIRST_KNOT,
    LARGEST_INCREMENT,
    LARGEST_SOFTENING,
    LONGEST_STEP,
    MODE,
    NEXT_TANGENT,
    PATH_TOLERANCE,
    PREVIOUS,
    TANGENT,
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

STILL = 1e-6
"""Movement by which a flip is known to have changed nothing but idle beams; a quarter to a
third of the flips in a long chain on the crane."""
JUMP = 0.1
LONG_JUMP = 0.3
DETOUR_AFTER_JUMP = 0.13
NONLINEARITY_AFTER_LONG_JUMP = 0.5
"""Limits that a response must keep besides those of `is_mild` where a flip moves some node
farther than a jump. In 14,800 proposals of eight chains `is_mild` alone let two wrong
branches through, both after jumps."""
STIFF = 0.8
"""Least part of the stiffness at its ends that a path may keep to be sure without following it."""


@kernel
def is_reached_from_rest(
    system: System, structure: Structure, guess: Floats, u: Floats, scratch: Scratch
) -> bool:
    """Whether an equilibrium at full load is sure to be the one reached from rest.

    It is if it has not moved from `guess`, the equilibrium of another design, which was: the
    beam that was flipped carries no load. It is, too, if it lies near what the tangents at
    rest and at full load predict; nearer, if it is far from the guess. If not, it still is
    if equilibria that keep their stiffness join it to rest; but not far from the guess,
    since a strongly bent response can be joined past a bifurcation that lies between the
    points. With the factor of `u` at hand.
    """
    jump = largest_difference(u, guess)
    if jump <= STILL:
        return True
    rest, first = scratch.vectors[PREVIOUS], scratch.vectors[TANGENT]
    last = scratch.vectors[NEXT_TANGENT]
    find_tangent(system, structure, 1.0, u, last, scratch)
    clear(rest, len(rest))
    if not stiffness_is_definite(system, structure, 0.0, rest, scratch):
        return False
    find_tangent(system, structure, 0.0, rest, first, scratch)
    nonlinearity = nonlinearity_of(u, first)
    detour = curvature_left(rest, u, first, last, 1.0)
    mild = is_mild(nonlinearity, detour)
    far = jump > LONG_JUMP and nonlinearity > NONLINEARITY_AFTER_LONG_JUMP
    far |= jump > JUMP and detour > DETOUR_AFTER_JUMP
    if mild and not far:
        return True
    if jump > JUMP and not mild:
        return False
    return is_joined_to_rest(system, structure, u, scratch)


@kernel
def interpolate(
    start: Floats, end: Floats, first: Floats, last: Floats, increment: float, middle: Floats
) -> None:
    """Half way between two points of the path, by the cubic through both and their tangents."""
    for node in range(len(middle)):
        for axis in range(2):
            middle[node, axis] = 0.5 * (start[node, axis] + end[node, axis]) + 0.125 * increment * (
                first[node, axis] - last[node, axis]
            )


@inlined
def is_joined_to_rest(system: System, structure: Structure, u: Floats, scratch: Scratch) -> bool:
    """Join `u` to rest by equilibria, halving the load between two until they are joined.

    The points between are interpolated, which is cheaper than following the path. False if
    the stiffness dips on the way, or a point cannot be found: the path must be followed.
    """
    vectors, knots = scratch.vectors, scratch.knots
    left, left_tangent, mode = vectors[PREVIOUS], vectors[TANGENT], vectors[MODE]
    for node in range(len(u)):
        for axis in range(2):
            mode[node, axis] = u[node, axis] - left_tangent[node, axis]
    fraction = 0.0
    at_rest = stiffness = lowest_stiffness(system, structure, mode, scratch)
    copy(u, vectors[FIRST_KNOT])
    copy(vectors[NEXT_TANGENT], vectors[FIRST_KNOT + 1])
    if not stiffness_is_definite(system, structure, 1.0, u, scratch):
        return False
    knots[0, 0], knots[0, 1] = 1.0, lowest_stiffness(system, structure, mode, scratch)
    top = 0
    while top >= 0:
        right, right_tangent = vectors[FIRST_KNOT + 2 * top], vectors[FIRST_KNOT + 2 * top + 1]
        increment = knots[top, 0] - fraction
        departure = curvature_left(left, right, left_tangent, right_tangent, increment)
        if increment <= LARGEST_INCREMENT and is_joined(
            departure, stiffness, knots[top, 1], LARGEST_SOFTENING, increment
        ):
            copy(right, left)
            copy(right_tangent, left_tangent)
            fraction, stiffness = knots[top, 0], knots[top, 1]
            top -= 1
            continue
        top += 1
        if top == len(knots):
            return False
        middle, tangent = vectors[FIRST_KNOT + 2 * top], vectors[FIRST_KNOT + 2 * top + 1]
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
        knots[top, 0] = half
        knots[top, 1] = lowest_stiffness(system, structure, mode, scratch)
        if knots[top, 1] < STIFF * min(at_rest, knots[0, 1]):
            return False
    return True
