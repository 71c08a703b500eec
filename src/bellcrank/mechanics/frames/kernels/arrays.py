"""Bundles of arrays that the kernels of frames work on.

N nodes, M beams, b unknowns of a node: 3 in the plane (displacement and rotation), 6 in space
(displacement and spin). n free nodes, with at least one free unknown; each is a b x b *block* of
the stiffness, and blocks are numbered in elimination order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from bellcrank.mechanics.kernels.bundle import Bundle

if TYPE_CHECKING:
    from bellcrank.mechanics.kernels.arrays import BitSets, Bytes, Floats, Ints


class State(NamedTuple):
    """A configuration of the nodes."""

    u: Floats
    """(N, 3) displacement and rotation in the plane; displacement in space."""
    q: Floats
    """(N, 4) orientation in space, unit quaternions (scalar first); (0, 4) in the plane."""


@dataclass(frozen=True, eq=False)
class Frame(Bundle):
    """A problem as arrays. Lengths in lattice units."""

    unit: tuple[float, ...]
    """b zeros: the size of a block, known when the kernels are compiled."""
    positions: Floats
    """(N, 3) nodes at rest; the third coordinate is 0 in the plane."""
    beams: Ints
    """(M, 2) end nodes."""
    rest: Floats
    """(M, 4, 3) vector along each beam at rest, then the triad of its ends, one vector a row."""
    rest_length: Floats
    """(M,)"""
    section: Floats
    """(M, 4) or (M, 8) stiffness of the beams; columns as in `plane_beam` or `space_force`."""
    bow: Floats
    """(M, 2) coefficients of the shortening of bent beams where it is included, else 0."""
    width: Floats
    """(M,) width in the plane of the lattice, in space the diameter."""
    rigid: Floats
    """(M, 2) lengths of the ends that do not bend."""
    incident_start: Ints
    """(N + 1,) index in `incident_beam` at which the beams of each node begin."""
    incident_beam: Ints
    """(2 M,) beams incident to each node."""
    held: Bytes
    """(N, b) unknowns prescribed by a support or the drive."""
    protected: Bytes
    """(N,) 1 for nodes at which a single beam is not a dead end."""
    grounded: Bytes
    """(N,) 1 for nodes of which all unknowns are held at rest."""
    prescribed: Bytes
    """(N,) 1 for nodes that the drive moves."""
    partly: Bytes
    """(N,) 1 for nodes of which some unknowns are held and others free."""
    block: Ints
    """(N,) elimination index of a free node, -1 for a fully held one."""
    drive: Floats
    """(N, b) prescribed motion at full load."""
    ramp: Floats
    """(N, 2) fractions of the load between which a node of the drive moves."""
    has_ramps: bool
    """Whether these, or those of forces, differ from 0 and 1."""
    kinks: Floats
    """Fractions within the load at which a range of the drive or of forces begins or ends,
    ascending."""
    load: Floats
    """(G, N, b) full forces and moments, those of one range together."""
    load_range: Floats
    """(G, 2) fractions of the load between which they grow."""
    weight: Floats
    """(M, 3) force on each beam at full load, one half on either end."""
    weight_group: int
    """Group of forces with which the own weight grows."""
    has_weight: bool
    ground: Floats
    """(N, 3, 3) stiffness of springs to the ground."""
    spring_nodes: Ints
    """Nodes with such springs."""
    input_nodes: Ints
    input_direction: Floats
    """(i, 3)"""
    output_nodes: Ints
    output_direction: Floats
    """(o, 3)"""
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
    """The load-bearing part of one design, and the pattern of its stiffness."""

    present: Bytes
    """(M,) beams of the design that carry load."""
    loaded: Bytes
    """(M,) memory of the search for these beams."""
    search: Ints
    """(N, 6) state of each node in a depth-first search."""
    active: Bytes
    """(N,) 1 for nodes that the drive reaches through present beams."""
    order: Ints
    """(N,) active nodes in the order of discovery."""
    parent: Ints
    """(N,) node from which each was discovered, -1 for the first of a piece."""
    beam: Ints
    """(M,) active beams."""
    beam_entry: Ints
    """(M,) index of the off-diagonal block of each beam, -1 if an end is held."""
    column_bits: BitSets
    """(n, W) rows below the diagonal in each column of the factor, as bits."""
    word_start: Ints
    """(n, W) entry at which the rows of each word begin."""
    column_start: Ints
    """(n + 1,)"""
    row: Ints
    """(capacity,) row of each entry."""
    sizes: Ints
    """(2,) nodes in `order`, beams in `beam`."""


POINTS = 32
"""Largest number of states that are kept of a path, between rest and full load."""


@dataclass(frozen=True, eq=False)
class Reference(Bundle):
    """Equilibrium at full load of a reference design, from which warm starts begin."""

    present: Bytes
    """(M,) as in `Structure`."""
    active: Bytes
    """(N,) nodes that the reference moves, dead ends included."""
    state: State
    count: Ints
    """(2,) number of states of its path that are kept; 1 if there are others, which are not."""
    load: Floats
    """(POINTS,) fraction of the load at these states."""
    points: State
    """(POINTS N, ...) these states, one after the other."""
    tension: Floats
    """(POINTS + 1, M) axial forces at these states; those at full load last."""
    mode: Floats
    """(POINTS + 2, N, b) softest motion at rest, at these states, and at full load."""
    stiffness: Floats
    """(POINTS + 2,) lowest stiffness there, of the last design whose path was followed."""


NO_PATH, OWN_PATH, NEXT_PATH, KEPT_PATH = 0, 1, 2, 3
"""Codes of `Memory.path`: none; followed from rest; next to that of the reference; the same."""


@dataclass(frozen=True, eq=False)
class Memory(Bundle):
    """Working memory, and the factor of the stiffness computed last.

    States, and fields (N, b): displacements and spins of the nodes.
    """

    tension: Floats
    """(M,) axial force with which the stiffness is assembled."""
    path_tension: Floats
    """(2, M) axial force at the start of an increment, and its change per unit of load."""
    gradient: Floats
    """(N, b) derivative of the potential energy."""
    diagonal: Floats
    """(n, b, b) blocks of the stiffness, then of its factor."""
    entries: Floats
    """(capacity, b, b) the same below the diagonal."""
    column: Floats
    """(n, b, b) the column being eliminated."""
    link: Ints
    """(n, 3) lists of columns that reach a row: head, next, position."""
    step: Floats
    """(n, b) right-hand side and solution."""
    force: Floats
    """(12,) end forces of a beam."""
    tangent_block: Floats
    """(12, 12) stiffness of a beam."""
    work: Floats
    """(9, 9, 9) memory of a beam in space."""
    axial: Floats
    """(M,) axial force of each beam in the state assembled last."""
    axial_slope: Floats
    """(M, 2 b) its derivative by the motions of both ends, over EA/L."""
    reached: Bytes
    """(N,) nodes that are placed."""
    path: Ints
    """(1,) where the states in `points` are from."""
    queue: Ints
    """(N,)"""
    previous: State
    """Equilibrium at the start of the increment, or another one to compare with."""
    count: Ints
    """(2,) as in `Reference`, of the path followed last."""
    load: Floats
    """(POINTS,) as in `Reference`."""
    points: State
    """(POINTS N, ...) as in `Reference`."""
    point_tension: Floats
    """(POINTS + 1, M) as `Reference.tension`."""
    point_mode: Floats
    """(POINTS + 2, N, b) softest motion at rest, there, and at full load."""
    point_stiffness: Floats
    """(POINTS + 2,) lowest stiffness there."""
    difference: Floats
    """Motion from one state to another."""
    change: Floats
    """Motion from a state of the reference to that of the design at the same load."""
    full_change: Floats
    """The same at full load."""
    tension_change: Floats
    """(2, M) changes of the axial forces with these motions."""
    tangent: Floats
    """Tangent of the path at the start of the increment."""
    next_tangent: Floats
    """Tangent at its end."""
    last_tangent: Floats
    """Tangent one increment before."""
    mode: Floats
    """Softest motion."""
    reached_load: Floats
    """(2,) fraction of the load up to which the path was followed last; lowest stiffness along it,
    as a part of its values at both ends."""


@dataclass(frozen=True, eq=False)
class Flips(Bundle):
    """Working memory of `predict_flips`."""

    coupling: Floats
    """(2 b, 2 b) G."""
    matrix: Floats
    """(2 b, 2 b + 1 + m) 1 + s k G and s f; for m linear motions s k z."""
