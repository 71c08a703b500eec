"""Equilibria between the stored states of a path, and products with their stiffness."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.mechanics.frames.kernels.assembly import add_tension_at, clear_tension
from bellcrank.mechanics.frames.kernels.beams import axial_force, beam_tangent
from bellcrank.mechanics.frames.kernels.newton import newton
from bellcrank.mechanics.frames.kernels.path import LONGEST_STEP
from bellcrank.mechanics.frames.kernels.state import copy_state, difference, move, move_held_nodes
from bellcrank.mechanics.frames.kernels.structure import place_rest
from bellcrank.mechanics.kernels._compile import entry
from bellcrank.mechanics.kernels.fields import clear

if TYPE_CHECKING:
    from bellcrank.mechanics.frames.kernels.arrays import Frame, Memory, State, Structure
    from bellcrank.mechanics.kernels.arrays import Bytes, Floats


@entry
def find_equilibrium(
    frame: Frame,
    mask: Bytes,
    structure: Structure,
    fraction: float,
    lower: State,
    upper: State,
    share: float,
    state: State,
    memory: Memory,
) -> int:
    """Fill `state` with the equilibrium at a fraction of the load; return its status.

    Newton's method begins at the part `share` of the motion from `lower` to `upper`, two
    equilibria of the path.
    """
    copy_state(lower, state)
    difference(lower, upper, memory.difference)
    move(state, share, memory.difference)
    move_held_nodes(frame, fraction, state)
    clear_tension(memory)
    add_tension_at(frame, structure, lower, 1.0 - share, memory)
    add_tension_at(frame, structure, upper, share, memory)
    status = newton(frame, structure, fraction, state, memory, frame.tolerance, LONGEST_STEP)
    place_rest(frame, mask, structure, fraction, state, memory)
    return status


@entry
def stiffness_product(
    frame: Frame,
    structure: Structure,
    state: State,
    motion: Floats,
    product: Floats,
    memory: Memory,
) -> None:
    """Fill `product` (N, b) with the stiffness at a state times a motion, held unknowns included.

    Beams and springs; dead loads have no stiffness.
    """
    size, tangent = len(frame.unit), memory.tangent_block
    clear(product, len(product))
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        tension = axial_force(frame, state, beam, memory)
        beam_tangent(frame.unit, frame, state, beam, tension, 1.0, memory)
        for end in range(2):
            node = frame.beams[beam, end]
            for a in range(size):
                total = 0.0
                for other in range(2):
                    moved = frame.beams[beam, other]
                    for b in range(size):
                        total += tangent[size * end + a, size * other + b] * motion[moved, b]
                product[node, a] += total
    for node in frame.spring_nodes:
        for i in range(3):
            for j in range(3):
                product[node, i] += frame.ground[node, i, j] * motion[node, j]
