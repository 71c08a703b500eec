"""What carries load, without a response; and how stiff the output is, after one."""

from __future__ import annotations

from bellcrank.mechanics.kernels._compile import entry
from bellcrank.mechanics.kernels.arrays import (
    HELD_X,
    HELD_Y,
    Bytes,
    Floats,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.cholesky import solve
from bellcrank.mechanics.kernels.core import keep_core
from bellcrank.mechanics.kernels.structure import ACTIVE, find_pieces
from bellcrank.mechanics.kernels.tangents import stiffness_is_definite


@entry
def find_core(system: System, mask: Bytes, kind: int, structure: Structure, core: Bytes) -> None:
    """Mark in `core` (M,) the beams of a design that carry load; overwrites `structure`.

    Without loose pieces, and without what its `kind` leaves out, as in `keep_core`.
    """
    keep_core(system, mask, kind, structure)
    find_pieces(system, structure)
    for beam in range(len(mask)):
        first, second = system.beams[beam, 0], system.beams[beam, 1]
        reached = structure.active[first] != 0 or structure.active[second] != 0
        core[beam] = 1 if structure.present[beam] and reached else 0


@entry
def output_compliance(system: System, structure: Structure, u: Floats, scratch: Scratch) -> float:
    """Return t.(K^-1 t), t the mean direction of the output, at the equilibrium `u`.

    K is the tangent stiffness there, input held if it is displaced. The mean is over the
    output nodes that the structure holds; 0 if there are none, -1 if K is not positive definite.
    """
    if not stiffness_is_definite(system, structure, 1.0, u, scratch):
        return -1.0
    step = scratch.step
    for block in range(len(step)):
        step[block, 0] = step[block, 1] = 0.0
    count = 0
    for index in range(len(system.output_nodes)):
        node = system.output_nodes[index]
        block, held = system.block[node], system.held[node]
        if block >= 0 and structure.active[node] == ACTIVE:
            count += 1
            step[block, 0] = 0.0 if held & HELD_X else system.output_direction[index, 0]
            step[block, 1] = 0.0 if held & HELD_Y else system.output_direction[index, 1]
    if count == 0:
        return 0.0
    solve(structure, scratch)
    total = 0.0
    for index in range(len(system.output_nodes)):
        node = system.output_nodes[index]
        block = system.block[node]
        if block >= 0 and structure.active[node] == ACTIVE:
            total += step[block, 0] * system.output_direction[index, 0]
            total += step[block, 1] * system.output_direction[index, 1]
    return total / (count * count)
