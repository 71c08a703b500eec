"""Change of the efficiency by each flip, predicted by one Newton step for all flips at once.

At an equilibrium, a flip of beam b between nodes i and j changes the energy by s times

    k (r - r0)^2 + sum over i, j of 2 lambda (omega_b - omega_p) (omega_b - omega_n),

p and n the beams before and after b around the node, s = 1 for adding and -1 for removing:
two angular springs instead of the one that they split. It depends on few quantities, the length
of b and the rotations of five beams. With their gradients as the columns of V, the gradient
changes by V h and the stiffness by V C V' (a low-rank update), and one Newton step from the old
equilibrium is

    du = -(K + V C V')^-1 V h = -K^-1 V (I + C G)^-1 h,   G = V' K^-1 V.

All flips share K^-1, of which G needs the blocks of the ends of those beams, at most three beams
apart (`bellcrank.mechanics.kernels.inverse`), and the adjoint a = K^-1 d(efficiency)/du; each flip
costs a system of six equations. The effect of a change of
torque on the stiffness of the neighbours is left out: with it, in rank ten, the predictions for
the crane rank the flips no better (correlations equal to 0.002). The first-order change, the
sensitivity, is -a.(V h).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bellcrank.mechanics.kernels._compile import entry, kernel
from bellcrank.mechanics.kernels.adjoint import find_anchored, neighbours_around, solve_adjoint
from bellcrank.mechanics.kernels.arrays import ACTIVE
from bellcrank.mechanics.kernels.bundle import Bundle
from bellcrank.mechanics.kernels.energy import measure_beam
from bellcrank.mechanics.kernels.fields import clear
from bellcrank.mechanics.kernels.inverse import Inverse, near_index, reset
from bellcrank.mechanics.kernels.tangents import stiffness_is_definite

if TYPE_CHECKING:
    from bellcrank.mechanics.kernels.arrays import Bytes, Floats, Ints, Scratch, Structure, System

RANK = 6
SMALLEST_PIVOT = 1e-14
REMAINDER = 1e-6
"""Part of a removed beam that remains in the equations: pieces that it held alone follow without
stress, instead of making the equations singular."""


@dataclass(frozen=True, eq=False)
class FlipWorkspace(Bundle):
    """Working memory of `predict_flips`. N nodes."""

    inverse: Inverse
    anchored: Bytes
    """(N,) nodes that are moved by the drive or connected to a support."""
    around: Ints
    """(RANK,) the beam that each column of V belongs to, -1 for none."""
    nodes: Ints
    """(RANK,) blocks of the end nodes of those beams, -1 for none and where a node is held."""
    ends: Ints
    """(RANK, 2) its end nodes, as numbers in `nodes`."""
    near: Ints
    """(RANK, RANK) index in `inverse.near` of two of `nodes`, -1 where one of them is held."""
    vectors: Floats
    """(RANK, 2) the columns of V, at the beam's second end; the negative at its first."""
    change: Floats
    """(RANK, RANK) C."""
    coupling: Floats
    """(RANK, RANK) G."""
    matrix: Floats
    """(RANK, RANK + 1) I + C G and h."""
    force: Floats
    """(RANK,) h, then the solution."""


@kernel
def find_blocks_between(structure: Structure, scratch: Scratch, space: FlipWorkspace) -> None:
    """Find the blocks of the inverse between all nodes of the current flip."""
    for p in range(RANK):
        i = space.nodes[p]
        for q in range(p + 1):
            j = space.nodes[q]
            index = -1
            if i >= 0 and j >= 0:
                index = near_index(structure, scratch, space.inverse, min(i, j), max(i, j))
            space.near[p, q] = space.near[q, p] = index


@kernel
def add_coupling(space: FlipWorkspace, i: int, j: int, p: int, q: int, sign: float) -> float:
    """Return the contribution of node i of beam p and node j of beam q to v_p' K^-1 v_q."""
    index = space.near[i, j]
    if index < 0:
        return 0.0
    px, py = space.vectors[p, 0], space.vectors[p, 1]
    qx, qy = space.vectors[q, 0], space.vectors[q, 1]
    if space.nodes[i] > space.nodes[j]:
        px, qx = qx, px
        py, qy = qy, py
    block = space.inverse.near_block
    along = block[index, 0] * qx + block[index, 1] * qy
    across = block[index, 2] * qx + block[index, 3] * qy
    return sign * (px * along + py * across)


@kernel
def find_coupling(space: FlipWorkspace) -> None:
    """Compute G = V' K^-1 V of the current flip."""
    ends = space.ends
    for p in range(RANK):
        for q in range(p + 1):
            total = 0.0
            if space.around[p] >= 0 and space.around[q] >= 0:
                total += add_coupling(space, ends[p, 1], ends[q, 1], p, q, 1.0)
                total += add_coupling(space, ends[p, 0], ends[q, 0], p, q, 1.0)
                total += add_coupling(space, ends[p, 1], ends[q, 0], p, q, -1.0)
                total += add_coupling(space, ends[p, 0], ends[q, 1], p, q, -1.0)
            space.coupling[p, q] = total
            space.coupling[q, p] = total


@kernel
def set_column(
    system: System,
    structure: Structure,
    space: FlipWorkspace,
    column: int,
    beam: int,
    directions: Floats,
    flipped: int,
) -> None:
    """Set a column of V to a gradient of `beam`, which is or shares a node with `flipped`."""
    space.around[column] = beam
    for end in range(2):
        node = system.beams[beam, end]
        number = column
        for known in range(2):
            if node == system.beams[flipped, known]:
                number = known
        moves = structure.active[node] == ACTIVE
        space.nodes[number] = system.block[node] if moves else -1
        space.ends[column, end] = number
    space.vectors[column, 0] = directions[beam, 0]
    space.vectors[column, 1] = directions[beam, 1]


@kernel
def add_springs(
    scratch: Scratch,
    space: FlipWorkspace,
    beam: int,
    before: int,
    after: int,
    column: int,
    weight: float,
) -> float:
    """Add the springs at one end of the flipped beam to h and C; return its torque."""
    p = scratch.rotation[beam] - scratch.rotation[before]
    q = scratch.rotation[beam] - scratch.rotation[after]
    b, n = column, column + 1
    c, h = space.change, space.force
    h[1] += weight * (p + q)
    h[b] -= weight * q
    h[n] -= weight * p
    c[1, 1] += 2.0 * weight
    c[1, b] -= weight
    c[b, 1] -= weight
    c[1, n] -= weight
    c[n, 1] -= weight
    c[b, n] += weight
    c[n, b] += weight
    return weight * (p + q)


@kernel
def eliminate(m: Floats, column: int) -> bool:
    """Eliminate a column below the diagonal, with pivoting; False if the matrix is singular."""
    pivot = column
    for p in range(column + 1, RANK):
        if abs(m[p, column]) > abs(m[pivot, column]):
            pivot = p
    if not abs(m[pivot, column]) > SMALLEST_PIVOT:
        return False
    for q in range(column, RANK + 1):
        m[column, q], m[pivot, q] = m[pivot, q], m[column, q]
    for p in range(column + 1, RANK):
        ratio = m[p, column] / m[column, column]
        for q in range(column + 1, RANK + 1):
            m[p, q] -= ratio * m[column, q]
    return True


@kernel
def solve_small(space: FlipWorkspace) -> bool:
    """Replace h in `force` by (I + C G)^-1 h; False if the matrix is singular."""
    m, h = space.matrix, space.force
    for p in range(RANK):
        for q in range(RANK):
            total = 1.0 if p == q else 0.0
            for k in range(RANK):
                total += space.change[p, k] * space.coupling[k, q]
            m[p, q] = total
        m[p, RANK] = h[p]
    for column in range(RANK):
        if not eliminate(m, column):
            return False
    for p in range(RANK - 1, -1, -1):
        total = m[p, RANK]
        for q in range(p + 1, RANK):
            total -= m[p, q] * h[q]
        h[p] = total / m[p, p]
    return True


@kernel
def find_change(
    system: System,
    structure: Structure,
    scratch: Scratch,
    space: FlipWorkspace,
    beam: int,
    sign: float,
) -> None:
    """Fill V, C and h for the flip of one beam."""
    clear(space.change, RANK)
    for p in range(RANK):
        space.force[p] = 0.0
        space.around[p] = -1
        space.nodes[p] = -1
    first, second = system.beams[beam, 0], system.beams[beam, 1]
    dead_end = not (space.anchored[first] and space.anchored[second])
    length = scratch.length[beam]
    set_column(system, structure, space, 0, beam, scratch.axis, beam)
    set_column(system, structure, space, 1, beam, scratch.turn, beam)
    torque = 0.0
    for end in range(2):
        node = system.beams[beam, end]
        before, after = neighbours_around(system, structure, beam, node)
        if before < 0 or not space.anchored[node]:
            continue
        column = 2 + 2 * end
        set_column(system, structure, space, column, before, scratch.turn, beam)
        set_column(system, structure, space, column + 1, after, scratch.turn, beam)
        if dead_end:
            weight = -sign * system.angle
            c, h = space.change, space.force
            bend = scratch.rotation[after] - scratch.rotation[before]
            h[column + 1] += weight * bend
            h[column] -= weight * bend
            c[column, column] += weight
            c[column + 1, column + 1] += weight
            c[column, column + 1] -= weight
            c[column + 1, column] -= weight
        else:
            torque += add_springs(
                scratch, space, beam, before, after, column, sign * 2.0 * system.angle
            )
    if not dead_end:
        tension = sign * 2.0 * system.bond * (length - system.rest_length[beam])
        space.force[0] += tension
        space.change[0, 0] += sign * 2.0 * system.bond
        space.change[1, 1] += tension * length
        space.change[0, 1] -= torque / length
        space.change[1, 0] -= torque / length


@kernel
def adjoint_change(system: System, space: FlipWorkspace, adjoint: Floats) -> float:
    """Return -a.(V h), with h in `force`."""
    change = 0.0
    for p in range(RANK):
        beam = space.around[p]
        if beam >= 0:
            first, second = system.beams[beam, 0], system.beams[beam, 1]
            rate = 0.0
            for axis in range(2):
                rate += space.vectors[p, axis] * (adjoint[second, axis] - adjoint[first, axis])
            change -= rate * space.force[p]
    return change


@entry
def predict_flips(
    system: System,
    mask: Bytes,
    core: int,
    beams: Ints,
    first_order: bool,
    structure: Structure,
    u: Floats,
    scratch: Scratch,
    space: FlipWorkspace,
    change: Floats,
    strain: Floats,
) -> bool:
    """Fill `change` with the predicted change of the efficiency by flipping each of `beams`.

    `structure` and `u` must be those of the design's equilibrium. False if it is unstable.

    Parameters
    ----------
    first_order
        Compute the sensitivity only; `space.inverse` may then be empty.
    strain
        Filled with the strain of each of `beams`, or of an absent one between its ends as they
        are. The larger it is, the less accurate is one Newton step.
    """
    if not stiffness_is_definite(system, structure, 1.0, u, scratch):
        return False
    adjoint = scratch.vectors.adjoint
    solve_adjoint(system, structure, u, adjoint, scratch)
    if not first_order:
        reset(structure, space.inverse)
    for beam in range(len(mask)):
        measure_beam(system, u, beam, scratch)
    find_anchored(system, structure, space.anchored)
    for index in range(len(beams)):
        beam = beams[index]
        first, second = system.beams[beam, 0], system.beams[beam, 1]
        change[index] = 0.0
        strain[index] = scratch.length[beam] / system.rest_length[beam] - 1.0
        moved = structure.active[first] == ACTIVE or structure.active[second] == ACTIVE
        loaded = moved and (not core or (space.anchored[first] and space.anchored[second]))
        if not loaded or mask[beam] != structure.present[beam]:
            continue
        removed = -1.0 if first_order else -(1.0 - REMAINDER)
        find_change(system, structure, scratch, space, beam, removed if mask[beam] else 1.0)
        if not first_order:
            find_blocks_between(structure, scratch, space)
            find_coupling(space)
            if not solve_small(space):
                continue
        change[index] = adjoint_change(system, space, adjoint)
    return True
