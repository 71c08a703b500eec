"""Static condensation of a frame to motions of its boundary nodes.

As `bellcrank.mechanics.kernels.condensation`, with rotations. The motions of the boundary are held
unknowns of the frame; the forces K m by these motions m are found beam by beam, and the interior
follows by the factorised stiffness.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.mechanics.frames.kernels.assembly import (
    assemble,
    elastic_energy,
    factorise_stiffness,
    find_tension,
    set_right_side,
    solve_step,
    spread_step,
)
from bellcrank.mechanics.frames.kernels.beams import beam_tangent
from bellcrank.mechanics.frames.kernels.path import SWEEPS, lowest_stiffness
from bellcrank.mechanics.frames.kernels.state import difference, move
from bellcrank.mechanics.frames.kernels.structure import build_structure
from bellcrank.mechanics.kernels._compile import entry, kernel

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.mechanics.frames.kernels.arrays import Frame, Memory, State, Structure
    from bellcrank.mechanics.kernels.arrays import Bytes, Floats


@entry
def find_structure(frame: Frame, mask: Bytes, structure: Structure, memory: Memory) -> int:
    """As `build_structure`, for calls from Python."""
    return build_structure(frame, mask, structure, memory)


@entry
def energy_at(frame: Frame, structure: Structure, state: State, memory: Memory) -> float:
    """As `elastic_energy`, for calls from Python."""
    return elastic_energy(frame, structure, state, memory)


@entry
def move_by(state: State, motion: Floats) -> None:
    """As `move`, for calls from Python."""
    move(state, 1.0, motion)


@entry
def motion_between(start: State, end: State, motion: Floats) -> None:
    """As `difference`, for calls from Python."""
    difference(start, end, motion)


@entry
def tension_after(frame: Frame, structure: Structure, motion: Floats, memory: Memory) -> None:
    """Compute the tensions to first order after a motion (N, b) from the state condensed last.

    As `predict_tension`, where boundary nodes move too.
    """
    size = len(frame.unit)
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        first, second = frame.beams[beam, 0], frame.beams[beam, 1]
        rate = 0.0
        for k in range(size):
            rate += memory.axial_slope[beam, k] * motion[first, k]
            rate += memory.axial_slope[beam, size + k] * motion[second, k]
        memory.tension[beam] = memory.axial[beam] + frame.section[beam, 0] * rate


@kernel
def add_forces_of_motions(
    frame: Frame,
    structure: Structure,
    state: State,
    softening: float,
    motions: NDArray[np.float64],
    forcing: NDArray[np.float64],
    memory: Memory,
) -> None:
    """Fill `forcing` (m, N, b) with the stiffness times each motion of the boundary nodes."""
    size, tangent = len(frame.unit), memory.tangent_block
    for number in range(forcing.shape[0]):
        for node in range(forcing.shape[1]):
            for axis in range(size):
                forcing[number, node, axis] = 0.0
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        if not (frame.prescribed[frame.beams[beam, 0]] or frame.prescribed[frame.beams[beam, 1]]):
            continue
        beam_tangent(frame.unit, frame, state, beam, memory.tension[beam], softening, memory)
        for end in range(2):
            node = frame.beams[beam, end]
            for other in range(2):
                moved = frame.beams[beam, other]
                if frame.prescribed[moved]:
                    for number in range(motions.shape[0]):
                        for a in range(size):
                            total = 0.0
                            for b in range(size):
                                total += (
                                    tangent[size * end + a, size * other + b]
                                    * motions[number, moved, b]
                                )
                            forcing[number, node, a] += total


@entry
def condense(
    frame: Frame,
    structure: Structure,
    state: State,
    softening: float,
    predicted: bool,
    motions: NDArray[np.float64],
    forcing: NDArray[np.float64],
    responses: NDArray[np.float64],
    interior_step: Floats,
    mode: Floats,
    memory: Memory,
) -> float:
    """Condense the stiffness at a state to motions of the boundary nodes.

    Leaves the gradient by node in `memory.gradient`. Returns the lowest stiffness of the interior
    while the boundary is held, infinite if there is no interior; -1 if it is not stable.

    Parameters
    ----------
    frame
        With held and *driven* boundary nodes.
    softening
        As in `plane_beam`.
    predicted
        Use the tensions of `tension_after` instead of those at the state.
    motions
        (m, N, b) motions of the boundary nodes.
    forcing, responses
        (m, N, b) filled: the stiffness times each motion, and the motion with the interior's.
    interior_step
        (N, b) filled: Newton step of the interior with the boundary held.
    mode
        (N, b) approximate softest motion of the interior; improved.
    """
    if not predicted:
        find_tension(frame, structure, state, memory)
    assemble(frame, structure, 0.0, state, softening, memory)
    add_forces_of_motions(frame, structure, state, softening, motions, forcing, memory)
    if not factorise_stiffness(frame, structure, memory):
        return -1.0
    lowest = lowest_stiffness(frame, structure, mode, 2 * SWEEPS, memory)
    for number in range(len(motions)):
        set_right_side(frame, structure, forcing[number], -1.0, memory)
        solve_step(structure, frame, memory)
        spread_step(frame, responses[number], memory)
        for node in range(motions.shape[1]):
            for axis in range(len(frame.unit)):
                responses[number, node, axis] += motions[number, node, axis]
    set_right_side(frame, structure, memory.gradient, -1.0, memory)
    solve_step(structure, frame, memory)
    spread_step(frame, interior_step, memory)
    return lowest
