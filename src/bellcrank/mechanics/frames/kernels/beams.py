"""Deformations, forces and tangent stiffness of beams, in the plane and in space."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.mechanics.frames.kernels.plane import (
    add_plane_force,
    fill_plane_tangent,
    plane_beam,
    plane_deformations,
    plane_stiffness,
)
from bellcrank.mechanics.frames.kernels.space import space_deformations, space_force, space_tangent
from bellcrank.mechanics.frames.kernels.state import matrix_of
from bellcrank.mechanics.kernels._compile import entry, kernel

if TYPE_CHECKING:
    from bellcrank.mechanics.frames.kernels.arrays import Frame, Memory, State
    from bellcrank.mechanics.frames.kernels.plane import PlaneBeam
    from bellcrank.mechanics.kernels.arrays import Floats, Ints


@kernel
def dimension(frame: Frame) -> int:
    """Return the dimension of the space."""
    return 2 if len(frame.unit) == 3 else 3


@kernel
def plane_beam_of(frame: Frame, state: State, beam: int) -> PlaneBeam:
    """Compute the forces of a beam in the plane."""
    first, second = frame.beams[beam, 0], frame.beams[beam, 1]
    return plane_beam(
        frame.rest[beam, 0], frame.rest_length[beam], frame.section[beam], frame.bow[beam],
        state.u[first], state.u[second],
    )  # fmt: skip


@kernel
def measure(
    unit: tuple[float, ...], frame: Frame, state: State, beam: int, memory: Memory, out: Floats
) -> None:
    """Compute the deformations of a beam: 3 in the plane, 6 in space; the first is elongation."""
    first, second = frame.beams[beam, 0], frame.beams[beam, 1]
    if len(unit) == 3:
        stretched, one, two, _, _, _ = plane_deformations(
            frame.rest[beam, 0], frame.rest_length[beam], state.u[first], state.u[second]
        )
        out[0], out[1], out[2] = stretched, one, two
    else:
        shift, turn = memory.work[8, 4], memory.work[3]
        for axis in range(3):
            shift[axis] = state.u[second, axis] - state.u[first, axis]
        matrix_of(state.q, first, turn[0:3])
        matrix_of(state.q, second, turn[3:6])
        space_deformations(frame.rest[beam], shift, turn[0:3], turn[3:6], memory.work, out)


@kernel
def beam_force(
    unit: tuple[float, ...], frame: Frame, state: State, beam: int, memory: Memory
) -> float:
    """Compute the end forces of a beam in `memory.force`; store and return its axial force."""
    first, second = frame.beams[beam, 0], frame.beams[beam, 1]
    work = memory.work
    if len(unit) == 3:
        result = plane_beam_of(frame, state, beam)
        fill_plane_force(result, memory.force)
        keep_plane_axial(result, beam, memory)
        return result.axial
    shift, turn = work[8, 4], work[3]
    for axis in range(3):
        shift[axis] = state.u[second, axis] - state.u[first, axis]
    matrix_of(state.q, first, turn[0:3])
    matrix_of(state.q, second, turn[3:6])
    space_force(
        frame.rest[beam],
        frame.section[beam],
        frame.bow[beam],
        shift,
        turn[0:3],
        turn[3:6],
        work,
        memory.force,
    )
    keep_space_axial(beam, memory)
    return work[8, 1, 0]


@kernel
def beam_tangent(
    unit: tuple[float, ...],
    frame: Frame,
    state: State,
    beam: int,
    tension: float,
    softening: float,
    memory: Memory,
) -> float:
    """As `beam_force`, and compute the tangent stiffness in `memory.tangent_block`."""
    if len(unit) == 3:
        result = plane_beam_of(frame, state, beam)
        stiffness = plane_stiffness(
            result, frame.section[beam], frame.bow[beam], tension, softening
        )
        fill_plane_force(result, memory.force)
        fill_plane_tangent(stiffness, memory.tangent_block)
        keep_plane_axial(result, beam, memory)
        return result.axial
    axial = beam_force(unit, frame, state, beam, memory)
    space_tangent(
        frame.section[beam], frame.bow[beam], tension, softening, memory.work,
        memory.tangent_block,
    )  # fmt: skip
    return axial


@kernel
def elongation(frame: Frame, beam: int, d: Floats) -> float:
    """Return the elongation of a beam, with the shortening by bending, from its deformations."""
    stretched, bow = d[0], frame.bow[beam]
    if len(frame.unit) == 3:
        return stretched + bow[0] * d[1] * d[1] + bow[1] * d[1] * d[2] + bow[2] * d[2] * d[2]
    for k in range(2, 4):
        a, b = d[k], d[k + 2]
        stretched += bow[0] * a * a + bow[1] * a * b + bow[2] * b * b
    return stretched


@kernel
def axial_force(frame: Frame, state: State, beam: int, memory: Memory) -> float:
    """Return the axial force of a beam."""
    d = memory.work[8, 0]
    measure(frame.unit, frame, state, beam, memory, d)
    return frame.section[beam, 0] * elongation(frame, beam, d)


@kernel
def fill_plane_force(result: PlaneBeam, force: Floats) -> None:
    """Store (6,) the forces and moments on both ends."""
    for k in range(6):
        force[k] = 0.0
    add_plane_force(result, force[0:3], force[3:6])


@kernel
def keep_plane_axial(result: PlaneBeam, beam: int, memory: Memory) -> None:
    """Store the axial force of a beam and its derivative by the motions of both ends."""
    slope = memory.axial_slope[beam]
    memory.axial[beam] = result.axial
    slope[0], slope[1], slope[2] = result.slope_x, result.slope_y, result.bow1
    slope[3], slope[4], slope[5] = -result.slope_x, -result.slope_y, result.bow2


@kernel
def keep_space_axial(beam: int, memory: Memory) -> None:
    """As `keep_plane_axial`, in space."""
    slope = memory.axial_slope[beam]
    memory.axial[beam] = memory.work[8, 1, 0]
    for k in range(12):
        if k % 6 < 3:
            slope[k] = (1.0 if k >= 6 else -1.0) * memory.work[0, 6, k % 6]
        else:
            slope[k] = memory.work[0, 6, k if k < 6 else k - 3]


@entry
def plane_beams(
    ends: Ints,
    rest: Floats,
    section: Floats,
    bow: Floats,
    u: Floats,
    force: Floats,
    tangent: Floats,
) -> None:
    """Compute the forces (m, 6) and the stiffness (m, 6, 6) of beams in the plane."""
    for beam in range(len(ends)):
        first, second = u[ends[beam, 0]], u[ends[beam, 1]]
        length = math.sqrt(rest[beam, 0] ** 2 + rest[beam, 1] ** 2)
        result = plane_beam(rest[beam], length, section[beam], bow[beam], first, second)
        stiffness = plane_stiffness(result, section[beam], bow[beam], result.axial, 1.0)
        fill_plane_force(result, force[beam])
        fill_plane_tangent(stiffness, tangent[beam])


@entry
def space_beams(
    ends: Ints,
    rest: Floats,
    section: Floats,
    bow: Floats,
    u: Floats,
    rotation: Floats,
    work: Floats,
    force: Floats,
    tangent: Floats,
) -> None:
    """Compute the forces (m, 12) and the stiffness (m, 12, 12) of beams in space."""
    shift = work[8, 4]
    for beam in range(len(ends)):
        first, second = ends[beam, 0], ends[beam, 1]
        for i in range(3):
            shift[i] = u[second, i] - u[first, i]
        space_force(
            rest[beam],
            section[beam],
            bow[beam],
            shift,
            rotation[first],
            rotation[second],
            work,
            force[beam],
        )
        space_tangent(section[beam], bow[beam], work[8, 1, 0], 1.0, work, tangent[beam])
