"""The load-bearing core of a design, found before any equilibrium; of springs and of frames."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.mechanics.kernels._compile import kernel
from bellcrank.mechanics.kernels.arrays import PRUNE_ALL, PRUNE_DEAD_ENDS
from bellcrank.mechanics.kernels.fields import pair

if TYPE_CHECKING:
    from typing import TypeAlias

    from bellcrank.mechanics.frames.kernels import arrays as frames
    from bellcrank.mechanics.kernels import arrays as springs
    from bellcrank.mechanics.kernels.arrays import Bytes

    System: TypeAlias = springs.System | frames.Frame
    Structure: TypeAlias = springs.Structure | frames.Structure

DEPTH, LOW, SLOT, ARRIVED_BY, MARK, STACK = range(6)
"""Columns of `structure.search`."""


@kernel
def other_end(system: System, beam: int, node: int) -> int:
    """Return the end of `beam` that is not `node`."""
    return system.beams[beam, 0] + system.beams[beam, 1] - node


@kernel
def only_beam(system: System, present: Bytes, node: int) -> int:
    """Return the beam of a node that has exactly one present beam, else -1."""
    found = -1
    for slot in range(system.incident_start[node], system.incident_start[node + 1]):
        beam = system.incident_beam[slot]
        if present[beam]:
            if found >= 0:
                return -1
            found = beam
    return found


@kernel
def prune_dead_ends(system: System, present: Bytes) -> None:
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
def prune_unloaded(system: System, structure: Structure) -> None:
    """Keep the present beams on a path between two nodes that are driven, watched or held.

    All fixed supports are merged into one root, and a virtual edge (a tie) joins the root to each
    driven, watched and rolling node. The beams to keep are those of the biconnected components
    that contain the root and a tie, and beams between two fixed supports. A depth-first search
    that starts with a tie finds one component: the edges below a node are dropped if the subtree
    reaches no node above it (Hopcroft and Tarjan, Commun. ACM 16, 372, 1973).
    """
    loaded = structure.loaded
    for beam in range(len(loaded)):
        first, second = pair(system.beams, beam)
        loaded[beam] = structure.present[beam] and (
            system.grounded[first] and system.grounded[second]
        )
    for node in range(len(system.held)):
        structure.search[node, DEPTH] = 0
    for start in range(len(system.held)):
        tied = system.protected[start] and not system.grounded[start]
        if tied and structure.search[start, DEPTH] == 0:
            length = component_of(system, structure, start)
            for index in range(length):
                loaded[structure.beam[index]] = 1
    for beam in range(len(loaded)):
        structure.present[beam] = loaded[beam]


@kernel
def visit(system: System, structure: Structure, node: int, depth: int, by: int, mark: int) -> None:
    """Record the arrival of the search at a node; a tie leads back to the root."""
    search = structure.search
    search[node, DEPTH] = depth
    search[node, LOW] = 0 if system.protected[node] and depth > 1 else depth
    search[node, SLOT] = system.incident_start[node]
    search[node, ARRIVED_BY] = by
    search[node, MARK] = mark
    search[depth - 1, STACK] = node


@kernel
def component_of(system: System, structure: Structure, start: int) -> int:
    """List in `structure.beam` the component of the tie of `start`; return its length."""
    search, edges = structure.search, structure.beam
    depth, length = 1, 0
    visit(system, structure, start, 1, -1, 0)
    while depth > 0:
        node = search[depth - 1, STACK]
        slot = search[node, SLOT]
        if slot == system.incident_start[node + 1]:
            depth -= 1
            if depth > 0:
                parent = search[depth - 1, STACK]
                search[parent, LOW] = min(search[parent, LOW], search[node, LOW])
                if search[node, LOW] >= depth:
                    length = search[node, MARK]
            continue
        search[node, SLOT] = slot + 1
        beam = system.incident_beam[slot]
        if not structure.present[beam] or beam == search[node, ARRIVED_BY]:
            continue
        far = other_end(system, beam, node)
        reach = 0 if system.grounded[far] else search[far, DEPTH]
        if not system.grounded[far] and reach == 0:
            visit(system, structure, far, depth + 1, beam, length)
            depth += 1
        elif reach < search[node, DEPTH]:
            search[node, LOW] = min(search[node, LOW], reach)
        else:
            continue
        edges[length] = beam
        length += 1
    return length


@kernel
def keep_core(system: System, mask: Bytes, core: int, structure: Structure) -> None:
    """Mark as present the beams of a design that are in its core.

    Parameters
    ----------
    mask
        (M,) uint8, 1 where the beam is in the design.
    core
        KEEP, PRUNE_DEAD_ENDS or PRUNE_ALL.
    """
    for beam in range(len(mask)):
        structure.present[beam] = mask[beam]
    if core == PRUNE_DEAD_ENDS:
        prune_dead_ends(system, structure.present)
    elif core == PRUNE_ALL:
        prune_unloaded(system, structure)
