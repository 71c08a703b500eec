"""The part of a design that moves: its pieces, beams and angular springs.

Only pieces that the drive reaches through present beams move; all others stay exactly at rest
and are left out of the equations.
"""

from __future__ import annotations

from bellcrank.mechanics.kernels._compile import entry, kernel
from bellcrank.mechanics.kernels.arrays import (
    ACTIVE,
    CONVERGED,
    HANGING,
    HELD,
    HELD_X,
    HELD_Y,
    MECHANISM,
    PRUNE_ALL,
    Bytes,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.core import keep_core, other_end
from bellcrank.mechanics.kernels.fields import pair, triple
from bellcrank.mechanics.kernels.pattern import find_pattern


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
        for slot in range(system.incident_start[node], system.incident_start[node + 1]):
            beam = system.incident_beam[slot]
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
    """Whether supports, drive and output springs prevent the three rigid motions of a piece.

    The rows (1, 0, -y) and (0, 1, x) of the held coordinates, or their combination along a
    spring, are summed as a 3 x 3 Gram matrix, which must have full rank.
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
def classify_piece(system: System, structure: Structure, first: int, last: int) -> int:
    """Return MECHANISM for a driven piece without support; mark one that hangs from a node."""
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
    """Mark the nodes that the drive moves; return CONVERGED or MECHANISM."""
    for node in range(len(structure.active)):
        structure.active[node] = 0
    status = CONVERGED
    structure.sizes[0] = 0
    for start in system.input_nodes:
        if not structure.active[start]:
            first = structure.sizes[0]
            discover(system, structure, start)
            status = max(status, classify_piece(system, structure, first, structure.sizes[0]))
    return status


@kernel
def list_beams(system: System, structure: Structure) -> None:
    """List active beams: movable ones from the front, beams between held nodes from the back."""
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
    """List the present beams of a node in cyclic order; return their number."""
    count = 0
    for slot in range(system.incident_start[node], system.incident_start[node + 1]):
        beam = system.incident_beam[slot]
        if structure.present[beam]:
            structure.around[count] = beam
            count += 1
    return count


@kernel
def list_springs(system: System, structure: Structure) -> None:
    """List the angular springs between neighbouring present beams around each active node.

    Springs that can deform are at the front, those between two held beams at the back. A node of
    two beams has two equal springs, inside and outside; they are one of double weight.
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
                spring = front
                front += 1
            else:
                back -= 1
                spring = back
            structure.spring_beams[spring, 0] = a
            structure.spring_beams[spring, 1] = b
            structure.spring_node[spring] = node
            structure.spring_weight[spring] = weight
    structure.sizes[3] = front
    structure.sizes[4] = back


@kernel
def build_structure(system: System, mask: Bytes, core: int, structure: Structure) -> int:
    """Fill `structure` for the design `mask`; return CONVERGED or MECHANISM.

    Parameters
    ----------
    mask
        (M,) uint8, 1 where the beam is present.
    core
        KEEP, PRUNE_DEAD_ENDS or PRUNE_ALL.
    """
    keep_core(system, mask, core, structure)
    status = find_pieces(system, structure)
    if status == CONVERGED:
        list_beams(system, structure)
        list_springs(system, structure)
        find_pattern(system, structure)
    return status


@entry
def find_core(system: System, mask: Bytes, core: int, structure: Structure, found: Bytes) -> None:
    """Mark in `found` (M,) the beams in the core of a design that the drive reaches.

    Overwrites `structure`. The parameters are those of `keep_core`.
    """
    keep_core(system, mask, core, structure)
    find_pieces(system, structure)
    for beam in range(len(mask)):
        first, second = pair(system.beams, beam)
        reached = structure.active[first] != 0 or structure.active[second] != 0
        found[beam] = 1 if structure.present[beam] and reached else 0


@entry
def find_loaded(system: System, mask: Bytes, structure: Structure) -> None:
    """Leave in `structure.present` the beams of a design on a path between two terminals."""
    keep_core(system, mask, PRUNE_ALL, structure)


@entry
def find_structure(system: System, mask: Bytes, core: int, structure: Structure) -> int:
    """As `build_structure`, for calls from Python."""
    return build_structure(system, mask, core, structure)
