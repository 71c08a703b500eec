"""Tangent of the loading path, and criteria for two of its points to be connected.

The path from rest is u(t), t the fraction of the load. Its tangent is K^-1 times the rate of
the residual with the load.
"""

from __future__ import annotations

import math

from bellcrank.mechanics.kernels._compile import inlined, kernel
from bellcrank.mechanics.kernels.arrays import (
    ACTIVE,
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
from bellcrank.mechanics.kernels.newton import find_step, find_tension, take_step

LARGEST_INCREMENT = 0.5
"""Largest increment of the load between two points that count as connected."""
FINE_INCREMENT = 1.0 / 128.0
LARGEST_DEPARTURE = 0.2
"""Departure of an increment from the mean of the tangents at its ends, as a part of the movement,
above which the path bends too much to be followed, or jumps."""
LARGEST_SOFTENING = 0.7
"""Ratio of the lowest stiffness at the ends of an increment, in either direction, below which
smaller increments are needed, down to `FINE_INCREMENT`."""
SOFT = 0.6
SOFTENING_WHERE_SOFT = 0.88
"""The same where the lowest stiffness is below the part `SOFT` of that at rest, so that the depth
of a minimum is resolved."""
LARGEST_NONLINEARITY = 0.6
LARGEST_DETOUR = 0.4
"""Departures of a response from the tangent at rest, and from the mean of the tangents at rest
and at full load, as parts of the largest displacement, above which the response may belong to
another branch than that reached from rest. All of 543 responses on wrong branches, found along a
chain on the crane among snapping designs, exceed one of them: those below 0.62 in the first were
above 0.73 in the second."""
PATH_TOLERANCE = 1e-6
"""Displacement error of equilibria between rest and full load."""
LONGEST_STEP = 0.5
LOAD_DIFFERENCE = 1e-6
SWEEPS = 4
"""Number of steps of inverse iteration in each estimate of the lowest stiffness."""


@kernel
def move_held_nodes(system: System, fraction: float, u: Floats) -> None:
    """Set held coordinates to the values that supports and drive prescribe at a load."""
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

    The current factor must be that of `u`. The change of the gradient with the load is a
    difference over a very small increment.
    """
    gradient, shifted = scratch.gradient, scratch.vectors.shifted
    find_gradient(system, structure, fraction, u, scratch)
    copy(gradient, tangent)
    copy(u, shifted)
    move_held_nodes(system, fraction + LOAD_DIFFERENCE, shifted)
    measure_held_beams(system, structure, shifted, scratch)
    find_gradient(system, structure, fraction + LOAD_DIFFERENCE, shifted, scratch)
    move(gradient, -1.0, tangent)
    find_step(system, structure, scratch)
    clear(tangent, len(tangent))
    take_step(system, 1.0 / LOAD_DIFFERENCE, tangent, scratch)
    move_held_nodes(system, 1.0, tangent)


@kernel
def set_right_side(system: System, structure: Structure, field: Floats, scratch: Scratch) -> None:
    """Copy a field on the nodes to `scratch.step`, zero where a coordinate does not move."""
    step = scratch.step
    for node in range(len(system.block)):
        block = system.block[node]
        if block >= 0:
            moves = structure.active[node] == ACTIVE
            held = system.held[node]
            step[block, 0] = field[node, 0] if moves and not held & HELD_X else 0.0
            step[block, 1] = field[node, 1] if moves and not held & HELD_Y else 0.0


@kernel
def lowest_stiffness(system: System, structure: Structure, mode: Floats, scratch: Scratch) -> float:
    """Estimate the lowest eigenvalue of the factorised stiffness by inverse iteration.

    `mode` holds the current approximation of the eigenvector and is improved.
    """
    lowest = math.inf
    for _ in range(SWEEPS):
        size = math.sqrt(dot(mode, mode))
        for node in range(len(mode)):
            mode[node, 0] /= size
            mode[node, 1] /= size
        set_right_side(system, structure, mode, scratch)
        solve(structure, scratch)
        clear(mode, len(mode))
        take_step(system, 1.0, mode, scratch)
        lowest = 1.0 / math.sqrt(dot(mode, mode))
    return lowest


@inlined
def path_departure(
    start: Floats, end: Floats, first: Floats, last: Floats, increment: float
) -> float:
    """Return the departure of an increment from the mean of the tangents at its two ends.

    As a part of the movement. On a smooth path it is of third order in the increment; a jump to
    another branch is in neither tangent.
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

    The tangents at both must account for the movement between them, and the lowest stiffness
    must change so little that no loss of stability in between is missed.

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
    """Return the departure of a response from its tangent at rest, as a part of the movement."""
    return largest_difference(u, at_rest) / largest_component(u)


@kernel
def is_nearly_linear(nonlinearity: float, detour: float) -> bool:
    """Whether a response is so close to linear that it is on the branch reached from rest."""
    return nonlinearity <= LARGEST_NONLINEARITY and detour <= LARGEST_DETOUR
