"""The tangent of the loading path, and what tells whether two of its points are joined.

The path from rest is u(t), t the fraction of the load. Its tangent is K^-1 times the rate
at which the load puts the structure out of balance.
"""

from __future__ import annotations

import math

from bellcrank.mechanics.kernels._compile import inlined, kernel
from bellcrank.mechanics.kernels.arrays import (
    HELD_X,
    HELD_Y,
    Floats,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.cholesky import factorise, solve
from bellcrank.mechanics.kernels.energy import find_gradient, find_stiffness, measure_held_beams
from bellcrank.mechanics.kernels.fields import (
    clear,
    copy,
    dot,
    largest_component,
    largest_difference,
    move,
)
from bellcrank.mechanics.kernels.newton import find_step, take_step
from bellcrank.mechanics.kernels.structure import ACTIVE
from bellcrank.mechanics.kernels.tension import find_tension

LARGEST_INCREMENT = 0.5
"""Of the load, between two points that are to be joined."""
FINE_INCREMENT = 1.0 / 128.0
LARGEST_DEPARTURE = 0.2
"""Of an increment from the mean of the tangents at its ends: more means that the path bends
too much to be followed, or jumps."""
LARGEST_SOFTENING = 0.7
"""Change of the lowest stiffness in one increment, up or down, that calls for smaller ones,
down to `FINE_INCREMENT`."""
SOFT = 0.6
SOFTENING_WHERE_SOFT = 0.88
"""The same where the lowest stiffness is below this part of that at rest, so that the depth
of a dip is known."""
LARGEST_NONLINEARITY = 0.6
LARGEST_DETOUR = 0.4
"""Departures of a response from the tangent at rest, and from the mean of the tangents at
rest and at full load, in parts of the largest displacement, beyond which it may belong to
another branch than that reached from rest. Of 543 responses on wrong branches found along a
chain on the crane among snapping designs, all exceed one of them: those below 0.62 in the
first were above 0.73 in the second."""
PATH_TOLERANCE = 1e-6
"""Displacement error of equilibria on the way."""
LONGEST_STEP = 0.5
PROBE = 1e-6
SWEEPS = 4
"""Of inverse iteration, each time the lowest stiffness is looked up."""

# Rows of `scratch.vectors` in use on the path; `descend` takes row 8.
PREVIOUS, MOVED, TANGENT, NEXT_TANGENT, LAST_TANGENT, MODE, SOFTEST_MODE, TURNED = range(8)
TANGENT_AT_REST = 9
GUESS = LAST_TANGENT
FIRST_KNOT = 10
"""And from here on, an equilibrium and a tangent in turn."""
MOST_KNOTS = 8
ROWS = FIRST_KNOT + 2 * MOST_KNOTS


@kernel
def move_held_nodes(system: System, fraction: float, u: Floats) -> None:
    """Put held coordinates where supports and drive want them at `fraction` of the load."""
    for node in range(len(system.held)):
        if system.held[node] & HELD_X:
            u[node, 0] = fraction * system.drive[node, 0]
        if system.held[node] & HELD_Y:
            u[node, 1] = fraction * system.drive[node, 1]


@kernel
def stiffness_is_definite(
    system: System, structure: Structure, fraction: float, u: Floats, scratch: Scratch
) -> bool:
    """Factorise the stiffness at `u`; False if the equilibrium there is unstable."""
    measure_held_beams(system, structure, u, scratch)
    find_gradient(system, structure, fraction, u, scratch)
    find_tension(system, structure, scratch)
    find_stiffness(system, structure, 1.0, scratch)
    return factorise(structure, scratch)


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


@kernel
def lowest_stiffness(system: System, structure: Structure, mode: Floats, scratch: Scratch) -> float:
    """Estimate the lowest eigenvalue of the factorised stiffness by inverse iteration.

    `mode` holds the current guess of the eigenvector and is improved.
    """
    lowest = math.inf
    step = scratch.step
    for _ in range(SWEEPS):
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
def is_joined(
    departure: float, before: float, after: float, softening: float, increment: float
) -> bool:
    """Whether two equilibria an increment of load apart are on one path.

    The tangents at both must account for the way between them, and the lowest stiffness
    must change so little that a loss of stability in between would have been seen.

    Parameters
    ----------
    before, after
        Lowest stiffness at both.
    softening
        Least ratio of the two.
    """
    followed = after > softening * before and before > softening * after
    return departure <= LARGEST_DEPARTURE and (followed or increment <= FINE_INCREMENT)


@kernel
def nonlinearity_of(u: Floats, at_rest: Floats) -> float:
    """How far a response departs from its tangent at rest, as a part of the movement."""
    return largest_difference(u, at_rest) / largest_component(u)


@kernel
def is_mild(nonlinearity: float, detour: float) -> bool:
    """Whether a response is so near to linear that it can be on no other branch."""
    return nonlinearity <= LARGEST_NONLINEARITY and detour <= LARGEST_DETOUR
