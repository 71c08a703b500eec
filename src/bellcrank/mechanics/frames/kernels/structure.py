"""The part of a design that carries load, and the pattern of its stiffness.

Dead ends, loose pieces and pieces that hang by a single node carry no load unless they have
weight; they are left out of the equations and follow as rigid bodies.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.mechanics.frames.kernels.arrays import (
    KEPT_PATH,
    NO_PATH,
    OWN_PATH,
    POINTS,
    State,
)
from bellcrank.mechanics.frames.kernels.beams import dimension
from bellcrank.mechanics.frames.kernels.factor import couple, entry_of, fill_in
from bellcrank.mechanics.frames.kernels.state import (
    copy_state,
    drive_share,
    matrix_of,
    point_state,
)
from bellcrank.mechanics.kernels._compile import entry, kernel
from bellcrank.mechanics.kernels.arrays import CONVERGED, KEEP, MECHANISM, PRUNE_ALL
from bellcrank.mechanics.kernels.core import keep_core, other_end
from bellcrank.mechanics.kernels.fields import clear, copy, copy_row

if TYPE_CHECKING:
    from bellcrank.mechanics.frames.kernels.arrays import Frame, Memory, Reference, Structure
    from bellcrank.mechanics.kernels.arrays import Bytes, Floats

SMALLEST_PIVOT = 1e-9
"""Pivot of the rigid motions of a piece below which one of them counts as free."""


@kernel
def discover(frame: Frame, structure: Structure, start: int) -> None:
    """Append all nodes reachable from `start` to the order."""
    active, order, parent = structure.active, structure.order, structure.parent
    count = structure.sizes[0]
    head = count
    active[start] = 1
    parent[start] = -1
    order[count] = start
    count += 1
    while head < count:
        node = order[head]
        head += 1
        for slot in range(frame.incident_start[node], frame.incident_start[node + 1]):
            beam = frame.incident_beam[slot]
            if structure.present[beam]:
                far = other_end(frame, beam, node)
                if not active[far]:
                    active[far] = 1
                    parent[far] = node
                    order[count] = far
                    count += 1
    structure.sizes[0] = count


@kernel
def add_row(gram: Floats, row: Floats) -> None:
    """Add the product of a row with itself."""
    for i in range(6):
        for j in range(6):
            gram[i, j] += row[i] * row[j]


@kernel
def rigid_motions_are_prevented(
    frame: Frame, structure: Structure, first: int, last: int, memory: Memory
) -> bool:
    """Whether supports, drive and output springs prevent the rigid motions of a piece.

    Each held unknown is a row over the rigid motions (three displacements, three rotations); the
    Gram matrix of the rows must have full rank.
    """
    size = len(frame.unit)
    gram, row = memory.tangent_block, memory.force
    clear(gram, 12)
    origin, reach, largest = structure.order[first], 1e-300, 1e-300
    for index in range(first, last):
        node = structure.order[index]
        for axis in range(3):
            reach = max(reach, abs(frame.positions[node, axis] - frame.positions[origin, axis]))
            largest = max(largest, frame.ground[node, axis, axis])
    for index in range(first, last):
        node = structure.order[index]
        for axis in range(size):
            sprung = 0.0
            if axis < 3:
                sprung = frame.ground[node, axis, axis] / largest
            if frame.held[node, axis]:
                add_held_row(frame, node, axis, origin, reach, gram, row)
            elif sprung > 0.0:
                add_spring_row(frame, node, axis, origin, reach, gram, row)
    if size == 3:
        gram[2, 2] = gram[3, 3] = gram[4, 4] = 1.0
        for k in range(6):
            for m in range(2, 5):
                if k != m:
                    gram[k, m] = gram[m, k] = 0.0
    return is_positive(gram)


@kernel
def add_held_row(
    frame: Frame, node: int, axis: int, origin: int, reach: float, gram: Floats, row: Floats
) -> None:
    """Add the row of a held unknown."""
    for k in range(6):
        row[k] = 0.0
    if len(frame.unit) == 3 and axis == 2:
        row[5] = 1.0
    else:
        row[axis] = 1.0
    if axis < dimension(frame):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        # Displacement along the axis by unit rotations about the two others.
        row[3 + i] = (frame.positions[node, j] - frame.positions[origin, j]) / reach
        row[3 + j] = -(frame.positions[node, i] - frame.positions[origin, i]) / reach
    add_row(gram, row)


@kernel
def add_spring_row(
    frame: Frame, node: int, axis: int, origin: int, reach: float, gram: Floats, row: Floats
) -> None:
    """Add the row of an output spring: column `axis` of its stiffness, as a direction."""
    ground = frame.ground[node]
    square = 0.0
    for k in range(3):
        square += ground[k, axis] * ground[k, axis]
    for k in range(6):
        row[k] = 0.0
    for k in range(3):
        along = ground[k, axis] / square**0.5
        row[k] += along
        i, j = (k + 1) % 3, (k + 2) % 3
        row[3 + i] += along * (frame.positions[node, j] - frame.positions[origin, j]) / reach
        row[3 + j] -= along * (frame.positions[node, i] - frame.positions[origin, i]) / reach
    add_row(gram, row)


@kernel
def is_positive(gram: Floats) -> bool:
    """Whether a (6, 6) Gram matrix has full rank, by Cholesky factorisation in place."""
    for j in range(6):
        scale = gram[j, j]
        for k in range(j):
            gram[j, j] -= gram[j, k] * gram[j, k]
        if not gram[j, j] > SMALLEST_PIVOT * max(1.0, scale):
            return False
        gram[j, j] = gram[j, j] ** 0.5
        for i in range(j + 1, 6):
            for k in range(j):
                gram[i, j] -= gram[i, k] * gram[j, k]
            gram[i, j] /= gram[j, j]
    return True


@kernel
def moves_alike(frame: Frame, node: int, other: int) -> bool:
    """Whether the drive moves two nodes by the same displacement, at the same time."""
    same = True
    for axis in range(3):
        same &= frame.drive[node, axis] == frame.drive[other, axis]
    for end in range(2):
        same &= frame.ramp[node, end] == frame.ramp[other, end]
    return same


@kernel
def classify_piece(
    frame: Frame, structure: Structure, first: int, last: int, memory: Memory
) -> int:
    """Return MECHANISM for a driven piece that is not held.

    A piece without load that only the drive holds, and that the drive moves as a whole in one
    direction and at one time, follows without rotation: its nodes are marked as not active.
    """
    order, size = structure.order, len(frame.unit)
    driver = -1
    follows = True
    for index in range(first, last):
        node = order[index]
        if frame.grounded[node]:
            return CONVERGED
        for axis in range(size):
            for group in range(len(frame.load)):
                follows &= frame.load[group, node, axis] == 0.0
            if frame.held[node, axis] and not frame.prescribed[node]:
                follows = False
        for axis in range(3):
            follows &= frame.ground[node, axis, axis] == 0.0
        if frame.prescribed[node]:
            if driver >= 0:
                follows &= moves_alike(frame, node, driver)
            driver = node
    if rigid_motions_are_prevented(frame, structure, first, last, memory):
        return CONVERGED
    if not follows or driver < 0 or frame.has_weight:
        return MECHANISM
    for index in range(first, last):
        structure.active[order[index]] = 0
    return CONVERGED


@kernel
def find_pieces(frame: Frame, structure: Structure, memory: Memory) -> int:
    """Mark the nodes that the drive moves; return CONVERGED or MECHANISM."""
    for node in range(len(structure.active)):
        structure.active[node] = 0
    status = CONVERGED
    structure.sizes[0] = 0
    for start in frame.input_nodes:
        if not structure.active[start]:
            first = structure.sizes[0]
            discover(frame, structure, start)
            status = max(
                status, classify_piece(frame, structure, first, structure.sizes[0], memory)
            )
            if not structure.active[start]:
                structure.sizes[0] = first
    return status


@kernel
def find_pattern(frame: Frame, structure: Structure) -> None:
    """List the active beams; find the pattern of the stiffness and of its factor."""
    clear(structure.column_bits, len(structure.column_bits))
    block, beams = frame.block, frame.beams
    count = 0
    for beam in range(len(structure.present)):
        if structure.present[beam] and structure.active[beams[beam, 0]]:
            structure.beam[count] = beam
            count += 1
            first, second = block[beams[beam, 0]], block[beams[beam, 1]]
            if first >= 0 and second >= 0:
                couple(structure.column_bits, first, second)
    structure.sizes[1] = count
    fill_in(structure.column_bits, structure.column_start, structure.word_start, structure.row)
    for index in range(count):
        beam = structure.beam[index]
        first, second = block[beams[beam, 0]], block[beams[beam, 1]]
        structure.beam_entry[beam] = -1
        if first >= 0 and second >= 0:
            structure.beam_entry[beam] = entry_of(
                structure.column_bits, structure.word_start, first, second
            )


@kernel
def build_structure(frame: Frame, mask: Bytes, structure: Structure, memory: Memory) -> int:
    """Fill `structure` for a design; return CONVERGED or MECHANISM.

    Parameters
    ----------
    mask
        (M,) uint8, 1 where the beam is present.
    """
    keep_core(frame, mask, KEEP if frame.has_weight else PRUNE_ALL, structure)
    status = find_pieces(frame, structure, memory)
    if status == CONVERGED:
        find_pattern(frame, structure)
    return status


@kernel
def follow_node(frame: Frame, state: State, node: int, guide: int, memory: Memory) -> None:
    """Move a node as if it were rigidly joined to another."""
    u, positions = state.u, frame.positions
    x = positions[node, 0] - positions[guide, 0]
    y = positions[node, 1] - positions[guide, 1]
    z = positions[node, 2] - positions[guide, 2]
    turn = memory.work[3]
    if dimension(frame) == 2:
        angle = u[guide, 2]
        c, s = math.cos(angle), math.sin(angle)
        turn[0, 0], turn[0, 1], turn[0, 2] = c, -s, 0.0
        turn[1, 0], turn[1, 1], turn[1, 2] = s, c, 0.0
        turn[2, 0], turn[2, 1], turn[2, 2] = 0.0, 0.0, 1.0
    else:
        matrix_of(state.q, guide, turn)
        for axis in range(4):
            state.q[node, axis] = state.q[guide, axis]
    u[node, 0] = u[guide, 0] + turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z - x
    u[node, 1] = u[guide, 1] + turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z - y
    u[node, 2] = u[guide, 2] + turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z - z
    if dimension(frame) == 2:
        u[node, 2] = u[guide, 2]


@kernel
def place_followers(frame: Frame, mask: Bytes, state: State, memory: Memory) -> None:
    """Move nodes that are joined to nodes in `memory.reached` as rigid bodies, and mark them.

    Supports stay where they are.
    """
    reached, queue = memory.reached, memory.queue
    count = head = 0
    for node in range(len(reached)):
        if reached[node]:
            queue[count] = node
            count += 1
    while head < count:
        node = queue[head]
        head += 1
        if frame.grounded[node]:
            continue
        for slot in range(frame.incident_start[node], frame.incident_start[node + 1]):
            beam = frame.incident_beam[slot]
            if mask[beam]:
                far = other_end(frame, beam, node)
                if not reached[far] and frame.block[far] >= 0 and not frame.partly[far]:
                    reached[far] = 1
                    follow_node(frame, state, far, node, memory)
                    queue[count] = far
                    count += 1


@kernel
def place_rest(
    frame: Frame, mask: Bytes, structure: Structure, fraction: float, state: State, memory: Memory
) -> None:
    """Place the nodes that are not active: dead ends and pieces that hang from one node."""
    reached = memory.reached
    for node in range(len(reached)):
        reached[node] = structure.active[node]
        if not structure.active[node]:
            for axis in range(3):
                state.u[node, axis] = 0.0
            if len(state.q):
                state.q[node, 0] = 1.0
                for axis in range(1, 4):
                    state.q[node, axis] = 0.0
            if frame.prescribed[node]:
                reached[node] = 1
                share = drive_share(frame, node, fraction)
                for axis in range(3):
                    state.u[node, axis] = share * frame.drive[node, axis]
    place_followers(frame, mask, state, memory)


@kernel
def set_reference(
    frame: Frame, structure: Structure, state: State, memory: Memory, reference: Reference
) -> None:
    """Make an equilibrium, whose other nodes are placed, the reference."""
    copy_state(state, reference.state)
    for beam in range(len(reference.present)):
        moves = structure.active[frame.beams[beam, 0]]
        reference.present[beam] = structure.present[beam] and moves
    for node in range(len(reference.active)):
        reference.active[node] = memory.reached[node]
    if memory.path[0] == KEPT_PATH:
        return
    reference.count[0] = memory.count[0]
    reference.count[1] = memory.count[1] if memory.path[0] != NO_PATH else 1
    for index in range(memory.count[0]):
        reference.load[index] = memory.load[index]
        u, q = point_state(frame, memory.points, index)
        v, r = point_state(frame, reference.points, index)
        copy_state(State(u, q), State(v, r))
        copy_row(memory.point_tension[index], reference.tension[index])
    copy_row(memory.point_tension[POINTS], reference.tension[POINTS])
    for index in range(memory.count[0] + 2):
        copy(memory.point_mode[index], reference.mode[index])
        if memory.path[0] == OWN_PATH:
            reference.stiffness[index] = memory.point_stiffness[index]


@kernel
def equals_reference(frame: Frame, structure: Structure, reference: Reference) -> bool:
    """Whether the same beams carry load as in the reference."""
    for beam in range(len(structure.present)):
        node = frame.beams[beam, 0]
        now = structure.present[beam] and structure.active[node] != 0
        if now != (reference.present[beam] != 0):
            return False
    return True


@entry
def find_structure(frame: Frame, mask: Bytes, structure: Structure, memory: Memory) -> int:
    """As `build_structure`, for calls from Python."""
    return build_structure(frame, mask, structure, memory)
