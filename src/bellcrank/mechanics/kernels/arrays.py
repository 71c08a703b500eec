"""Bundles of arrays that the kernels work on.

`System` is fixed by the problem, `Structure` by the design (the mask), `Scratch` is working
memory. All are allocated once, by `bellcrank.mechanics.system`; kernels only fill them.

N nodes, M beams; n free nodes (with at least one free coordinate). Each free node is a 2 x 2
*block* of the stiffness matrix; blocks are numbered in elimination order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bellcrank.mechanics.kernels.bundle import Bundle

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]
BitSets = NDArray[np.uint64]

HELD_X, HELD_Y, HELD = 1, 2, 3
"""Bits of `System.held`."""

CONVERGED, SNAPPED, MECHANISM, UNCONVERGED, UNVERIFIED = 0, 1, 2, 3, 6
"""Codes of `bellcrank.mechanics.Status`."""

KEEP, PRUNE_DEAD_ENDS, PRUNE_ALL = 0, 1, 2
"""Codes of `bellcrank.mechanics.UnloadedBeams`."""

ACTIVE = 1
"""A node of a piece that the drive moves."""
HANGING = 2
"""A node of a piece that hangs from one held node: it follows as a rigid body, without stress."""


@dataclass(frozen=True, eq=False)
class System(Bundle):
    """A problem as arrays. Lengths in lattice units."""

    positions: Floats
    """(N, 2) nodes at rest."""
    beams: Ints
    """(M, 2) end nodes."""
    rest_vector: Floats
    """(M, 2) from first to second end at rest."""
    rest_length: Floats
    """(M,)"""
    movable: Bytes
    """(M,) 1 for beams with a free end."""
    incident_start: Ints
    """(N + 1,) index in `incident_beam` at which the beams of each node begin."""
    incident_beam: Ints
    """(2 M,) beams incident to each node, counter-clockwise at rest."""
    held: Bytes
    """(N,) bits HELD_X, HELD_Y: coordinates prescribed by a support or the drive."""
    protected: Bytes
    """(N,) 1 for nodes at which a single beam is not a dead end."""
    grounded: Bytes
    """(N,) 1 for fixed supports."""
    block: Ints
    """(N,) elimination index of a free node, -1 for a fully held one."""
    drive: Floats
    """(N, 2) prescribed displacement at full load."""
    load: Floats
    """(N, 2) force at full load."""
    ground: Floats
    """(N, 3) output springs: xx, xy, yy of the stiffness S in 1/2 u.S u."""
    bond: float
    angle: float
    input_nodes: Ints
    input_direction: Floats
    output_nodes: Ints
    output_direction: Floats
    numerator_scale: float
    """Efficiency = scale * sum over output nodes of |u| f(gamma) / denominator."""
    exponent: float
    """n in f = 2 cos(gamma/2)^n - 1."""
    denominator: float
    """Constant denominator, or nan: scaled sum of t_in . u over the input nodes."""
    denominator_scale: float
    tolerance: float
    """Displacement error that changes the efficiency by less than its tolerance."""


@dataclass(frozen=True, eq=False)
class Structure(Bundle):
    """The load-bearing graph of one design, and the pattern of its stiffness."""

    present: Bytes
    """(M,) beams of the mask that are not pruned."""
    loaded: Bytes
    """(M,) beams on a path between two nodes that are driven, watched or held."""
    search: Ints
    """(N, 6) state of each node in a depth-first search; columns in `core`."""
    active: Bytes
    """(N,) ACTIVE or HANGING for nodes that the drive reaches through present beams, else 0."""
    order: Ints
    """(N,) active nodes in the order of discovery."""
    parent: Ints
    """(N,) node from which each was discovered, -1 for the first of a piece."""
    around: Ints
    """(largest degree,) beams incident to the current node."""
    beam: Ints
    """(M,) active beams."""
    beam_entry: Ints
    """(M,) index of the off-diagonal block of each beam, -1 if an end is held."""
    spring_beams: Ints
    """(2 M, 2) the two beams of each angular spring."""
    spring_node: Ints
    """(2 M,) the node of the spring."""
    spring_weight: Floats
    """(2 M,) lambda, doubled at a node of two beams."""
    spring_entry: Ints
    """(2 M,) block that couples the two far ends, -1 if one is held."""
    column_bits: BitSets
    """(n, W) rows below the diagonal in each column of the factor, as bits."""
    word_start: Ints
    """(n, W) entry at which the rows of each word begin."""
    column_start: Ints
    """(n + 1,)"""
    row: Ints
    """(capacity,) row of each entry."""
    sizes: Ints
    """(5,) nodes in `order`; end of the movable beams, start of the held ones in `beam`;
    the same two for springs."""


@dataclass(frozen=True, eq=False)
class Reference(Bundle):
    """Equilibrium at full load of a reference design, from which warm starts begin."""

    present: Bytes
    """(M,) as in `Structure`."""
    active: Bytes
    """(N,) as in `Structure`."""
    u: Floats
    """(N, 2) displacement."""


MAX_KNOTS = 8


@dataclass(frozen=True, eq=False)
class Vectors(Bundle):
    """Displacements and directions on the loading path; (N, 2) each unless stated."""

    previous: Floats
    """Equilibrium at the start of the increment, or another point to compare with."""
    shifted: Floats
    """Displacement with the held nodes at a slightly larger load."""
    tangent: Floats
    """Tangent of the path at the start of the increment."""
    next_tangent: Floats
    """Tangent at its end."""
    last_tangent: Floats
    """Tangent one increment before."""
    tangent_at_rest: Floats
    mode: Floats
    """Softest motion."""
    softest_mode: Floats
    """Softest motion where the stiffness along the path is lowest."""
    at_softest: Floats
    """Displacement there."""
    tentative: Floats
    """Displacement after a tentative step."""
    guess: Floats
    """Displacement at which a warm start begins."""
    adjoint: Floats
    """K^-1 d(efficiency)/du."""
    rotation: Floats
    """(N,) rigid rotation of nodes that the reference does not move."""
    knot: Floats
    """(MAX_KNOTS, N, 2) equilibria between rest and full load."""
    knot_tangent: Floats
    """(MAX_KNOTS, N, 2) tangents there."""
    knot_load: Floats
    """(MAX_KNOTS,) fractions of the load there."""
    knot_stiffness: Floats
    """(MAX_KNOTS,) lowest stiffness there."""


@dataclass(frozen=True, eq=False)
class Scratch(Bundle):
    """Working memory, and the factor of the stiffness computed last."""

    length: Floats
    rotation: Floats
    """(M,) omega."""
    axis: Floats
    """(M, 2) unit vector along the beam."""
    turn: Floats
    """(M, 2) derivative of omega by the second end."""
    tension: Floats
    """(M,) derivative of the energy by the length with which the stiffness is assembled."""
    torque: Floats
    """(M,) derivative of the energy by omega."""
    turn_weight: Floats
    """(M,) sum of 2 lambda over the beam's springs."""
    gradient: Floats
    """(N, 2)"""
    diagonal: Floats
    """(n, 4) blocks of the stiffness."""
    off_diagonal: Floats
    """(capacity, 4)"""
    factor_diagonal: Floats
    """(n, 4): l00, l10, l11 of the Cholesky block, unused."""
    factor: Floats
    """(capacity, 4)"""
    column: Floats
    """(n, 4) the column being eliminated."""
    link: Ints
    """(n, 3) lists of columns that reach a row: head, next, position."""
    step: Floats
    """(n, 2) right-hand side and solution."""
    vectors: Vectors
