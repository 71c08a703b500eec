"""Which beams of a design can carry load at all: its core, known before any equilibrium."""

from __future__ import annotations

from bellcrank.mechanics.kernels._compile import kernel
from bellcrank.mechanics.kernels.arrays import IGNORED, STRIPPED, Bytes, Structure, System
from bellcrank.mechanics.kernels.fields import pair

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
def keep_core(system: System, mask: Bytes, core: int, structure: Structure) -> None:
    """Mark as present the beams of a design that are in its core of one kind.

    Parameters
    ----------
    mask
        (M,) uint8, 1 where the beam is in the design.
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
