"""Deformations, forces and tangent stiffness of beams, in the plane and in space."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.mechanics.frames.kernels.plane import plane_beam, plane_deformations, plane_force
from bellcrank.mechanics.frames.kernels.space import space_deformations, space_force, space_tangent
from bellcrank.mechanics.frames.kernels.state import matrix_of
from bellcrank.mechanics.kernels._compile import entry, kernel

if TYPE_CHECKING:
    from bellcrank.mechanics.frames.kernels.arrays import Frame, Memory, State
    from bellcrank.mechanics.kernels.arrays import Floats, Ints


@kernel
def dimension(frame: Frame) -> int:
    """Return the dimension of the space."""
    return 2 if len(frame.unit) == 3 else 3


@kernel
def measure(
    unit: tuple[float, ...], frame: Frame, state: State, beam: int, memory: Memory, out: Floats
) -> None:
    """Compute the deformations of a beam: 3 in the plane, 6 in space; the first is elongation."""
    first, second = frame.beams[beam, 0], frame.beams[beam, 1]
    if len(unit) == 3:
        plane_deformations(frame.rest[beam, 0], state.u[first], state.u[second], out)
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
    """Compute the end forces of a beam in `memory.force`; return its axial force."""
    first, second = frame.beams[beam, 0], frame.beams[beam, 1]
    work = memory.work
    if len(unit) == 3:
        plane_force(
            frame.rest[beam, 0], frame.section[beam], frame.bow[beam], state.u[first],
            state.u[second], memory.local, memory.force,
        )  # fmt: skip
        return memory.local[6]
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
    """Compute the end forces and the tangent stiffness of a beam; return its axial force."""
    if len(unit) == 3:
        first, second = frame.beams[beam, 0], frame.beams[beam, 1]
        plane_beam(
            frame.rest[beam, 0], frame.section[beam], frame.bow[beam], state.u[first],
            state.u[second], tension, softening, memory.local, memory.force, memory.tangent_block,
        )  # fmt: skip
        return memory.local[6]
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
        return stretched + bow * (2.0 * (d[1] * d[1] + d[2] * d[2]) - d[1] * d[2])
    for k in range(2, 4):
        a, b = d[k], d[k + 2]
        stretched += bow * (2.0 * (a * a + b * b) - a * b)
    return stretched


@kernel
def axial_force(frame: Frame, state: State, beam: int, memory: Memory) -> float:
    """Return the axial force of a beam."""
    d = memory.work[8, 0]
    measure(frame.unit, frame, state, beam, memory, d)
    return frame.section[beam, 0] * elongation(frame, beam, d)


@kernel
def keep_axial(frame: Frame, beam: int, axial: float, memory: Memory) -> None:
    """Store the axial force of a beam and its derivative by the motions of both ends."""
    size, slope = len(frame.unit), memory.axial_slope
    memory.axial[beam] = axial
    for k in range(2 * size):
        if size == 3:
            slope[beam, k] = memory.local[8 + k]
        elif k % 6 < 3:
            slope[beam, k] = (1.0 if k >= 6 else -1.0) * memory.work[0, 6, k % 6]
        else:
            slope[beam, k] = memory.work[0, 6, k if k < 6 else k - 3]


@entry
def plane_beams(
    ends: Ints,
    rest: Floats,
    section: Floats,
    u: Floats,
    work: Floats,
    force: Floats,
    tangent: Floats,
) -> None:
    """Compute the forces (m, 6) and the stiffness (m, 6, 6) of beams in the plane."""
    for beam in range(len(ends)):
        first, second = u[ends[beam, 0]], u[ends[beam, 1]]
        plane_deformations(rest[beam], first, second, work)
        tension = section[beam, 0] * work[0]
        plane_beam(
            rest[beam],
            section[beam],
            0.0,
            first,
            second,
            tension,
            1.0,
            work,
            force[beam],
            tangent[beam],
        )


@entry
def space_beams(
    ends: Ints,
    rest: Floats,
    section: Floats,
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
            0.0,
            shift,
            rotation[first],
            rotation[second],
            work,
            force[beam],
        )
        space_tangent(section[beam], 0.0, work[8, 1, 0], 1.0, work, tangent[beam])
