"""Which part of a design carries load, and the pattern of its stiffness matrix.

Only what the drive can reach through present beams moves; everything else stays
exactly at rest and is left out of the equations.
"""

from __future__ import annotations

import numpy as np

from bellcrank.mechanics.kernels._compile import kernel
from bellcrank.mechanics.kernels.arrays import (
    CONVERGED,
    HELD,
    HELD_X,
    HELD_Y,
    IGNORED,
    MECHANISM,
    STRIPPED,
    Bytes,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.bits import popcount, trailing_zeros
from bellcrank.mechanics.kernels.fields import clear, pair, triple

ACTIVE = 1
HANGING = 2
"""A piece that hangs from one held node: it follows as a rigid body, without stress."""

ONE = np.uint64(1)
DEPTH, LOW, SLOT, CAME_BY, MARK, STACK = range(6)
"""Columns of `structure.walk`."""


@kernel
def other_end(system: System, beam: int, node: int) -> int:
    """Return the end of `beam` that is not `node`."""
    return system.beams[beam, 0] + system.beams[beam, 1] - node


@kernel
def only_beam(system: System, present: Bytes, node: int) -> int:
    """Return the beam of a node that has exactly one present beam, else -1."""
    found = -1
    for slot in range(system.ring_start[node], system.ring_start[node + 1]):
        beam = system.ring_beam[slot]
        if present[beam]:
            if found >= 0:
                return -1
            found = beam
    return found


@kernel
def strip_dead_ends(system: System, present: Bytes) -> None:
    """Remove, repeatedly, beams that end in an unprotected node of degree one."""
    for start in range(len(system.held)):
        node = start
        while not system.protected[node]:
            beam = only_beam(system, present, node)
            if beam < 0:
                break
            present[beam] = 0
            node = other_end(system, beam, node)


@kernel
def strip_unloaded(system: System, structure: Structure) -> None:
    """Keep of the present beams those on some way between two nodes driven, watched or held.

    With all fixed supports as one root, to which driven, watched and rolling nodes are tied,
    these are the biconnected components that hold the root and a tie; and beams between two
    fixed supports. A walk in depth that begins with a tie finds one of them: what a branch
    has left on the trail is dropped if it reaches no higher than where the branch began
    (Hopcroft and Tarjan, Commun. ACM 16, 372, 1973).
    """
    loaded = structure.loaded
    for beam in range(len(loaded)):
        first, second = pair(system.beams, beam)
        loaded[beam] = structure.present[beam] and (
            system.grounded[first] and system.grounded[second]
        )
    for node in range(len(system.held)):
        structure.walk[node, DEPTH] = 0
    for start in range(len(system.held)):
        tied = system.protected[start] and not system.grounded[start]
        if tied and structure.walk[start, DEPTH] == 0:
            length = walk_from(system, structure, start)
            for index in range(length):
                loaded[structure.beam[index]] = 1
    for beam in range(len(loaded)):
        structure.present[beam] = loaded[beam]


@kernel
def enter(system: System, structure: Structure, node: int, depth: int, by: int, mark: int) -> None:
    """Note how the walk came to a node; a tie leads back to the root at once."""
    walk = structure.walk
    walk[node, DEPTH] = depth
    walk[node, LOW] = 0 if system.protected[node] and depth > 1 else depth
    walk[node, SLOT] = system.ring_start[node]
    walk[node, CAME_BY] = by
    walk[node, MARK] = mark
    walk[depth - 1, STACK] = node


@kernel
def walk_from(system: System, structure: Structure, start: int) -> int:
    """Leave on the trail (`structure.beam`) the component of the tie of `start`; its length."""
    walk, trail = structure.walk, structure.beam
    depth, length = 1, 0
    enter(system, structure, start, 1, -1, 0)
    while depth > 0:
        node = walk[depth - 1, STACK]
        slot = walk[node, SLOT]
        if slot == system.ring_start[node + 1]:
            depth -= 1
            if depth > 0:
                parent = walk[depth - 1, STACK]
                walk[parent, LOW] = min(walk[parent, LOW], walk[node, LOW])
                if walk[node, LOW] >= depth:
                    length = walk[node, MARK]
            continue
        walk[node, SLOT] = slot + 1
        beam = system.ring_beam[slot]
        if not structure.present[beam] or beam == walk[node, CAME_BY]:
            continue
        far = other_end(system, beam, node)
        reach = 0 if system.grounded[far] else walk[far, DEPTH]
        if not system.grounded[far] and reach == 0:
            enter(system, structure, far, depth + 1, beam, length)
            depth += 1
        elif reach < walk[node, DEPTH]:
            walk[node, LOW] = min(walk[node, LOW], reach)
        else:
            continue
        trail[length] = beam
        length += 1
    return length


@kernel
def discover(system: System, structure: Structure, start: int) -> None:
    """Append all nodes reachable from `start` to the order."""
    active, order, parent = structure.active, structure.order, structure.parent
    count = structure.sizes[0]
    head = count
    active[start] = ACTIVE
    parent[start] = -1
    order[count] = start
    count += 1
    while head < count:
        node = order[head]
        head += 1
        for slot in range(system.ring_start[node], system.ring_start[node + 1]):
            beam = system.ring_beam[slot]
            if structure.present[beam]:
                far = other_end(system, beam, node)
                if not active[far]:
                    active[far] = ACTIVE
                    parent[far] = node
                    order[count] = far
                    count += 1
    structure.sizes[0] = count


@kernel
def rigid_motions_are_prevented(
    system: System, structure: Structure, first: int, last: int
) -> bool:
    """Whether supports, drive and output springs hold a piece against its three rigid motions.

    The rows (1, 0, -y) and (0, 1, x) of what is held, or their combination along a spring,
    are summed as a 3 x 3 Gram matrix, which must have full rank.
    """
    origin_x, origin_y = pair(system.positions, structure.order[first])
    reach = 1e-300
    g00 = g01 = g11 = g02 = g12 = g22 = 0.0
    for index in range(first, last):
        node = structure.order[index]
        x = system.positions[node, 0] - origin_x
        y = system.positions[node, 1] - origin_y
        reach = max(reach, x * x + y * y)
        xx, xy, yy = triple(system.ground, node)
        held = system.held[node]
        for axis in range(2):
            across = along = 0.0
            if axis == 0 and (held & HELD_X or xx > 0.0):
                across = 1.0
                if not held & HELD_X:
                    along = xy / xx
            elif (
                axis == 1 and (held & HELD_Y or (yy > 0.0 and xx * yy - xy * xy > 1e-12 * yy * yy))
            ) or (axis == 1 and yy > 0.0 and xx == 0.0):
                along = 1.0
            turn = along * x - across * y
            g00 += across * across
            g01 += across * along
            g11 += along * along
            g02 += across * turn
            g12 += along * turn
            g22 += turn * turn
    determinant = (
        g00 * (g11 * g22 - g12 * g12)
        - g01 * (g01 * g22 - g12 * g02)
        + g02 * (g01 * g12 - g11 * g02)
    )
    return determinant > 1e-9 * reach


@kernel
def judge_piece(system: System, structure: Structure, first: int, last: int) -> int:
    """Decide whether a driven piece is supported, hangs from one node, or is a mechanism."""
    order = structure.order
    held_nodes = 0
    constrained = False
    for index in range(first, last):
        node = order[index]
        held_nodes += system.held[node] == HELD
        constrained |= system.held[node] in (HELD_X, HELD_Y)
        constrained |= system.ground[node, 0] + system.ground[node, 2] > 0.0
        constrained |= system.load[node, 0] != 0.0 or system.load[node, 1] != 0.0
    if held_nodes >= 2 or rigid_motions_are_prevented(system, structure, first, last):
        return CONVERGED
    if held_nodes == 1 and not constrained:
        for index in range(first, last):
            structure.active[order[index]] = HANGING
        return CONVERGED
    return MECHANISM


@kernel
def find_pieces(system: System, structure: Structure) -> int:
    """Mark the nodes that the drive can move; return CONVERGED or MECHANISM."""
    for node in range(len(structure.active)):
        structure.active[node] = 0
    status = CONVERGED
    structure.sizes[0] = 0
    for start in system.input_nodes:
        if not structure.active[start]:
            first = structure.sizes[0]
            discover(system, structure, start)
            status = max(status, judge_piece(system, structure, first, structure.sizes[0]))
    return status


@kernel
def list_beams(system: System, structure: Structure) -> None:
    """List active beams: those with a free end from the front, the others from the back."""
    front, back = 0, len(structure.beam)
    for beam in range(len(structure.present)):
        if structure.present[beam] and structure.active[system.beams[beam, 0]] == ACTIVE:
            if system.movable[beam]:
                structure.beam[front] = beam
                front += 1
            else:
                back -= 1
                structure.beam[back] = beam
    structure.sizes[1] = front
    structure.sizes[2] = back


@kernel
def beams_around(system: System, structure: Structure, node: int) -> int:
    """Collect the present beams of a node in cyclic order; return how many there are."""
    count = 0
    for slot in range(system.ring_start[node], system.ring_start[node + 1]):
        beam = system.ring_beam[slot]
        if structure.present[beam]:
            structure.around[count] = beam
            count += 1
    return count


@kernel
def list_springs(system: System, structure: Structure) -> None:
    """List the angular springs between neighbouring present beams around each active node.

    Springs that can turn stand at the front, those between two held beams at the back.
    A node of two beams has two equal springs, inside and outside: one of double weight.
    """
    front, back = 0, len(structure.spring_node)
    for index in range(structure.sizes[0]):
        node = structure.order[index]
        if structure.active[node] != ACTIVE:
            continue
        count = beams_around(system, structure, node)
        weight = 2.0 * system.angle if count == 2 else system.angle
        for number in range(0 if count > 2 else 1, count):
            a = structure.around[number - 1 if number > 0 else count - 1]
            b = structure.around[number]
            if system.movable[a] or system.movable[b]:
                place = front
                front += 1
            else:
                back -= 1
                place = back
            structure.spring_beams[place, 0] = a
            structure.spring_beams[place, 1] = b
            structure.spring_node[place] = node
            structure.spring_weight[place] = weight
    structure.sizes[3] = front
    structure.sizes[4] = back


@kernel
def couple(structure: Structure, first: int, second: int) -> None:
    """Note that two blocks interact, unless one of them is held."""
    if first >= 0 and second >= 0 and first != second:
        low = min(first, second)
        high = max(first, second)
        structure.column_bits[low, high >> 6] |= ONE << np.uint64(high & 63)


@kernel
def entry_of(structure: Structure, first: int, second: int) -> int:
    """Return where the block of two interacting nodes is stored, -1 if one of them is held."""
    if first < 0 or second < 0:
        return -1
    low = min(first, second)
    high = max(first, second)
    word = structure.column_bits[low, high >> 6]
    below = word & ((ONE << np.uint64(high & 63)) - ONE)
    return structure.word_start[low, high >> 6] + popcount(below)


@kernel
def fill_in(structure: Structure) -> None:
    """Symbolic Cholesky factorisation: a column hands its rows on to its parent."""
    bits = structure.column_bits
    columns, words = bits.shape
    count = 0
    for column in range(columns):
        structure.column_start[column] = count
        parent = -1
        for word in range(column >> 6, words):
            rest = bits[column, word]
            structure.word_start[column, word] = count
            while rest:
                row = (word << 6) + trailing_zeros(rest)
                rest &= rest - ONE
                if parent < 0:
                    parent = row
                structure.row[count] = row
                count += 1
        if parent >= 0:
            for word in range(parent >> 6, words):
                bits[parent, word] |= bits[column, word]
            bits[parent, parent >> 6] &= ~(ONE << np.uint64(parent & 63))
    structure.column_start[columns] = count


@kernel
def find_pattern(system: System, structure: Structure) -> None:
    """Find the pattern of the stiffness and of its factor, and where each part adds to it."""
    clear(structure.column_bits, len(structure.column_bits))
    block, beams = system.block, system.beams
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        couple(structure, block[beams[beam, 0]], block[beams[beam, 1]])
    for spring in range(structure.sizes[3]):
        node = structure.spring_node[spring]
        first = block[other_end(system, structure.spring_beams[spring, 0], node)]
        second = block[other_end(system, structure.spring_beams[spring, 1], node)]
        couple(structure, first, second)
    fill_in(structure)
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        structure.beam_entry[beam] = entry_of(
            structure, block[beams[beam, 0]], block[beams[beam, 1]]
        )
    for spring in range(structure.sizes[3]):
        node = structure.spring_node[spring]
        first = block[other_end(system, structure.spring_beams[spring, 0], node)]
        second = block[other_end(system, structure.spring_beams[spring, 1], node)]
        structure.spring_entry[spring] = entry_of(structure, first, second)


@kernel
def build_structure(system: System, mask: Bytes, core: int, structure: Structure) -> int:
    """Fill `structure` for the design `mask`; return CONVERGED or MECHANISM.

    Parameters
    ----------
    mask
        (M,) uint8, 1 where the beam is present.
    core
        What to leave out: nothing, dead ends, or all that no load can reach
        (`COUNTED`, `IGNORED`, `STRIPPED`).
    """
    for beam in range(len(mask)):
        structure.present[beam] = mask[beam]
    if core == IGNORED:
        strip_dead_ends(system, structure.present)
    elif core == STRIPPED:
        strip_unloaded(system, structure)
    status = find_pieces(system, structure)
    if status == CONVERGED:
        list_beams(system, structure)
        list_springs(system, structure)
        find_pattern(system, structure)
    return status
