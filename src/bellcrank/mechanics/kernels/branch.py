"""Whether an equilibrium at full load is the one reached from rest, and whether that is unique.

The judgement depends on the equilibrium alone, not on how it was found, so a chain and
a lone evaluation agree on which designs snap.
"""

from __future__ import annotations

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
from bellcrank.mechanics.kernels.fields import (
    clear,
    copy,
    dot,
    largest_component,
    largest_difference,
    move,
)
from bellcrank.mechanics.kernels.newton import descend, newton
from bellcrank.mechanics.kernels.tangents import (
    FIRST_KNOT,
    LARGEST_INCREMENT,
    LONGEST_STEP,
    MODE,
    NEXT_TANGENT,
    PATH_TOLERANCE,
    PREVIOUS,
    SOFTEST_MODE,
    TANGENT,
    TURNED,
    curvature_left,
    find_tangent,
    is_joined,
    lowest_stiffness,
    move_held_nodes,
    stiffness_is_definite,
)

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
DIP = 0.5
"""A path whose lowest stiffness falls below this part of its values at rest and at full load
has passed near a loss of stability; whether a second equilibrium exists is then looked up."""
DISTINCT = 1e-3
"""Distance, in lattice units, at which two equilibria are two."""


@kernel
def judge(system: System, structure: Structure, u: Floats, jump: float, scratch: Scratch) -> int:
    """Judge a stable equilibrium at full load, with the factor of `u` at hand.

    Parameters
    ----------
    jump
        Distance from the equilibrium of another design that it was found from; 0 if it
        was found by loading.

    Returns
    -------
    int
        CONVERGED: it is the one reached from rest, being near what the tangents at rest
        and at full load predict, or joined to rest by equilibria in between.
        SNAPPED: it is, but the path came so near to a loss of stability that there is a
        second equilibrium. UNCONVERGED: it could not be joined to rest.
    """
    rest, first = scratch.vectors[PREVIOUS], scratch.vectors[TANGENT]
    last = scratch.vectors[NEXT_TANGENT]
    find_tangent(system, structure, 1.0, u, last, scratch)
    clear(rest, len(rest))
    if not stiffness_is_definite(system, structure, 0.0, rest, scratch):
        return UNCONVERGED
    find_tangent(system, structure, 0.0, rest, first, scratch)
    nonlinearity = largest_difference(u, first) / largest_component(u)
    detour = curvature_left(rest, u, first, last, 1.0)
    mild = nonlinearity <= LARGEST_NONLINEARITY and detour <= LARGEST_DETOUR
    far = jump > LONG_JUMP and nonlinearity > NONLINEARITY_AFTER_LONG_JUMP
    far |= jump > JUMP and detour > DETOUR_AFTER_JUMP
    if mild and not far:
        return CONVERGED
    lowest = join_to_rest(system, structure, u, scratch)
    if lowest < 0.0:
        return UNCONVERGED
    if lowest < DIP and not mild and has_second_equilibrium(system, structure, u, scratch):
        return SNAPPED
    return CONVERGED


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
def join_to_rest(system: System, structure: Structure, u: Floats, scratch: Scratch) -> float:
    """Join `u` to rest by equilibria, halving the load between two until they are joined.

    As sure as following the path, since the same test joins two points of it, and
    cheaper: the points between are interpolated, not extrapolated.

    Returns
    -------
    float
        Lowest stiffness met, as a part of the lesser of those at rest and at full load;
        negative if `u` could not be joined. Keeps the softest motion and the displacement
        there in `scratch.vectors`.
    """
    vectors, knots = scratch.vectors, scratch.knots
    left, left_tangent, mode = vectors[PREVIOUS], vectors[TANGENT], vectors[MODE]
    for node in range(len(u)):
        for axis in range(2):
            mode[node, axis] = u[node, axis] - left_tangent[node, axis]
    fraction = 0.0
    at_rest = softest = stiffness = lowest_stiffness(system, structure, mode, scratch)
    copy(u, vectors[FIRST_KNOT])
    copy(vectors[NEXT_TANGENT], vectors[FIRST_KNOT + 1])
    if not stiffness_is_definite(system, structure, 1.0, u, scratch):
        return -1.0
    at_end = lowest_stiffness(system, structure, mode, scratch)
    knots[0, 0], knots[0, 1] = 1.0, at_end
    top = 0
    while top >= 0:
        right, right_tangent = vectors[FIRST_KNOT + 2 * top], vectors[FIRST_KNOT + 2 * top + 1]
        increment = knots[top, 0] - fraction
        departure = curvature_left(left, right, left_tangent, right_tangent, increment)
        if increment <= LARGEST_INCREMENT and is_joined(
            departure, stiffness, knots[top, 1], increment
        ):
            copy(right, left)
            copy(right_tangent, left_tangent)
            fraction, stiffness = knots[top, 0], knots[top, 1]
            top -= 1
            continue
        top += 1
        if top == len(knots):
            return -1.0
        middle, tangent = vectors[FIRST_KNOT + 2 * top], vectors[FIRST_KNOT + 2 * top + 1]
        half = fraction + 0.5 * increment
        interpolate(left, right, left_tangent, right_tangent, increment, middle)
        move_held_nodes(system, half, middle)
        clear_tension(scratch)
        add_tension_at(system, structure, left, 0.5, scratch)
        add_tension_at(system, structure, right, 0.5, scratch)
        status = newton(system, structure, half, middle, scratch, PATH_TOLERANCE, LONGEST_STEP)
        if status != CONVERGED:
            return -1.0
        find_tangent(system, structure, half, middle, tangent, scratch)
        knots[top, 0] = half
        knots[top, 1] = lowest_stiffness(system, structure, mode, scratch)
        if knots[top, 1] < softest:
            softest = knots[top, 1]
            copy(mode, vectors[SOFTEST_MODE])
            copy(middle, vectors[TURNED])
    return softest / min(at_rest, at_end)


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
