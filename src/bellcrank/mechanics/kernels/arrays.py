"""What the kernels work on: three bundles of arrays and nothing else.

`System` is fixed by the problem, `Structure` by the design (the mask),
`Scratch` is working memory. All are allocated once, by
`bellcrank.mechanics.system`; kernels only fill them.

N nodes, M beams; n free nodes (at least one free coordinate), each a 2 x 2
*block* of the stiffness matrix, numbered in elimination order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]
Words = NDArray[np.uint64]

HELD_X = 1
HELD_Y = 2
HELD = 3

CONVERGED = 0
SNAPPED = 1
MECHANISM = 2
UNCONVERGED = 3
UNVERIFIED = 6

COUNTED = 0
IGNORED = 1
STRIPPED = 2


class System(NamedTuple):
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
    ring_start: Ints
    """(N + 1,) where each node's beams begin in `ring_beam`."""
    ring_beam: Ints
    """(2 M,) beams around each node, counter-clockwise at rest."""
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


class Structure(NamedTuple):
    """The load-bearing graph of one design, and the pattern of its stiffness."""

    present: Bytes
    """(M,) beams that count: the mask, less dead ends where these are ignored."""
    loaded: Bytes
    """(M,) beams on some way between two nodes that are driven, watched or held."""
    walk: Ints
    """(N, 6) how a walk through the beams came by each node, and its stack."""
    active: Bytes
    """(N,) 1 for nodes that the drive can move through present beams."""
    order: Ints
    """(N,) active nodes in the order of discovery."""
    parent: Ints
    """(N,) node from which each was discovered, -1 for the first of a piece."""
    around: Ints
    """(largest degree,) beams around the node at hand."""
    beam: Ints
    """(M,) active beams."""
    beam_entry: Ints
    """(M,) where beam's off-diagonal block lies, -1 if an end is held."""
    spring_beams: Ints
    """(2 M, 2) the two beams of each angular spring."""
    spring_node: Ints
    """(2 M,) the node it sits at."""
    spring_weight: Floats
    """(2 M,) lambda, doubled at a node of two beams."""
    spring_entry: Ints
    """(2 M,) block that couples the two far ends, -1 if one is held."""
    column_bits: Words
    """(n, W) rows below the diagonal in each column of the factor, as bits."""
    word_start: Ints
    """(n, W) entry at which each word's rows begin."""
    column_start: Ints
    """(n + 1,)"""
    row: Ints
    """(capacity,) row of each entry."""
    sizes: Ints
    """(5,) nodes in `order`; end of the movable beams, start of the held ones in `beam`;
    the same two for springs."""


class Known(NamedTuple):
    """An equilibrium at full load from which that of a similar design can be found."""

    present: Bytes
    """(M,) as in `Structure`."""
    active: Bytes
    """(N,)"""
    u: Floats
    """(N, 2) displacement."""


class Scratch(NamedTuple):
    """Working memory, and the factor of the stiffness last computed."""

    length: Floats
    rotation: Floats
    """(M,) omega."""
    axis: Floats
    """(M, 2) unit vector along the beam."""
    turn: Floats
    """(M, 2) derivative of omega by the second end."""
    tension: Floats
    """(M,) derivative of the energy by the length, as the stiffness is to see it."""
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
    vectors: Floats
    """(ROWS, N, 2) displacements and directions kept by the minimisers."""
    knots: Floats
    """(MOST_KNOTS, 2) load and lowest stiffness of equilibria between rest and full load."""
