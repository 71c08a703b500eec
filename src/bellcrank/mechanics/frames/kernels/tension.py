"""Axial forces along a path: stored at a state, and extrapolated from there."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.mechanics.kernels._compile import inlined, kernel

if TYPE_CHECKING:
    from bellcrank.mechanics.frames.kernels.arrays import Frame, Memory, Structure


@inlined
def extrapolate_tension(structure: Structure, increment: float, memory: Memory) -> None:
    """Compute the axial forces at the end of an increment to first order."""
    stored = memory.path_tension
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        memory.tension[beam] = stored[0, beam] + increment * stored[1, beam]


@kernel
def keep_tension(structure: Structure, increment: float, memory: Memory) -> None:
    """Store the axial forces of a state and their mean change per unit of load before it.

    Those along the tangent would be inaccurate: where beams turn, the small error of the direction
    of a beam times its large axial stiffness is a force.
    """
    stored = memory.path_tension
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        stored[1, beam] = (memory.tension[beam] - stored[0, beam]) / increment
        stored[0, beam] = memory.tension[beam]


@kernel
def begin_tension(frame: Frame, structure: Structure, memory: Memory) -> None:
    """Store the axial forces at rest, and their change per unit of load along the tangent."""
    size, slope, tangent = len(frame.unit), memory.axial_slope, memory.tangent
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        first, second = frame.beams[beam, 0], frame.beams[beam, 1]
        rate = 0.0
        for k in range(size):
            rate += slope[beam, k] * tangent[first, k] + slope[beam, size + k] * tangent[second, k]
        memory.path_tension[0, beam] = 0.0
        memory.path_tension[1, beam] = frame.section[beam, 0] * rate
