"""Derivative of the residual of a frame by the load."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.mechanics.frames.kernels.beams import axial_force, beam_tangent, dimension
from bellcrank.mechanics.frames.kernels.state import drive_rate, force_rate
from bellcrank.mechanics.kernels._compile import kernel

if TYPE_CHECKING:
    from bellcrank.mechanics.frames.kernels.arrays import Frame, Memory, State, Structure
    from bellcrank.mechanics.kernels.arrays import Floats


@kernel
def add_driven_rate(
    frame: Frame, state: State, beam: int, within: float, rate: Floats, memory: Memory
) -> None:
    """Add the forces of a beam per unit of load by the motion of its driven ends."""
    size, tangent = len(frame.unit), memory.tangent_block
    tension = axial_force(frame, state, beam, memory)
    beam_tangent(frame.unit, frame, state, beam, tension, 1.0, memory)
    for end in range(2):
        node = frame.beams[beam, end]
        for other in range(2):
            moved = frame.beams[beam, other]
            if frame.prescribed[moved]:
                speed = drive_rate(frame, moved, within)
                for a in range(size):
                    for b in range(size):
                        motion = speed * frame.drive[moved, b]
                        rate[node, a] += tangent[size * end + a, size * other + b] * motion


@kernel
def set_force_rate(frame: Frame, structure: Structure, within: float, rate: Floats) -> None:
    """Set (N, b) the derivative of the gradient by the load to that of the forces."""
    size = len(frame.unit)
    for node in range(len(rate)):
        for axis in range(size):
            rate[node, axis] = 0.0
    for group in range(len(frame.load)):
        speed = force_rate(frame, group, within)
        for node in range(len(rate)):
            if structure.active[node]:
                for axis in range(size):
                    rate[node, axis] -= speed * frame.load[group, node, axis]


@kernel
def find_load_rate(
    frame: Frame, structure: Structure, state: State, within: float, rate: Floats, memory: Memory
) -> None:
    """Compute (N, b) the derivative of the gradient by the load, at fixed free unknowns.

    `within` is a load on the side of the derivative, up to the next kink.
    """
    set_force_rate(frame, structure, within, rate)
    half = 0.5 * force_rate(frame, frame.weight_group, within)
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        first, second = frame.beams[beam, 0], frame.beams[beam, 1]
        if frame.has_weight:
            for axis in range(dimension(frame)):
                rate[first, axis] -= half * frame.weight[beam, axis]
                rate[second, axis] -= half * frame.weight[beam, axis]
        if not (frame.prescribed[first] or frame.prescribed[second]):
            continue
        add_driven_rate(frame, state, beam, within, rate, memory)
    for node in frame.spring_nodes:
        if frame.prescribed[node]:
            drive_speed = drive_rate(frame, node, within)
            for i in range(3):
                for j in range(3):
                    rate[node, i] += frame.ground[node, i, j] * (drive_speed * frame.drive[node, j])
