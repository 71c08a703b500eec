"""Energy, residual and tangent stiffness of a frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.mechanics.frames.kernels.beams import (
    axial_force,
    beam_force,
    beam_tangent,
    dimension,
    elongation,
    keep_plane_axial,
    measure,
    plane_beam_of,
)
from bellcrank.mechanics.frames.kernels.factor import factorise, solve
from bellcrank.mechanics.frames.kernels.plane import (
    add_plane_force,
    add_plane_stiffness,
    plane_stiffness,
)
from bellcrank.mechanics.frames.kernels.state import force_share, move_node
from bellcrank.mechanics.kernels._compile import inlined, kernel

if TYPE_CHECKING:
    from bellcrank.mechanics.frames.kernels.arrays import Frame, Memory, State, Structure
    from bellcrank.mechanics.kernels.arrays import Floats


@kernel
def elastic_energy(frame: Frame, structure: Structure, state: State, memory: Memory) -> float:
    """Return the elastic energy of the beams and the springs."""
    total = 0.0
    d = memory.work[8, 0]
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        section = frame.section[beam]
        measure(frame.unit, frame, state, beam, memory, d)
        stretched = elongation(frame, beam, d)
        total += 0.5 * section[0] * stretched * stretched
        if len(frame.unit) == 3:
            total += 0.5 * (section[1] * d[1] * d[1] + section[3] * d[2] * d[2])
            total += section[2] * d[1] * d[2]
        else:
            total += 0.5 * section[1] * d[1] * d[1]
            for k in range(2):
                own1, other, own2 = section[2 + 3 * k], section[3 + 3 * k], section[4 + 3 * k]
                a, b = d[2 + k], d[4 + k]
                total += 0.5 * (own1 * a * a + own2 * b * b) + other * a * b
    for node in frame.spring_nodes:
        for i in range(3):
            for j in range(3):
                total += 0.5 * frame.ground[node, i, j] * state.u[node, i] * state.u[node, j]
    return total


@kernel
def clear_stiffness(structure: Structure, memory: Memory) -> None:
    """Set the stiffness to zero."""
    diagonal, entries = memory.diagonal, memory.entries
    size = diagonal.shape[1]
    for j in range(len(diagonal)):
        for a in range(size):
            for b in range(size):
                diagonal[j, a, b] = 0.0
    for t in range(structure.column_start[len(diagonal)]):
        for a in range(size):
            for b in range(size):
                entries[t, a, b] = 0.0


@kernel
def add_loads(
    frame: Frame, structure: Structure, fraction: float, state: State, gradient: Floats
) -> None:
    """Add the forces of loads, own weight and springs to the gradient."""
    size = len(frame.unit)
    for group in range(len(frame.load)):
        share = force_share(frame, group, fraction)
        for index in range(structure.sizes[0]):
            node = structure.order[index]
            for axis in range(size):
                gradient[node, axis] -= share * frame.load[group, node, axis]
    for node in frame.spring_nodes:
        for i in range(3):
            for j in range(3):
                gradient[node, i] += frame.ground[node, i, j] * state.u[node, j]
    if frame.has_weight:
        half = 0.5 * force_share(frame, frame.weight_group, fraction)
        for index in range(structure.sizes[1]):
            beam = structure.beam[index]
            for end in range(2):
                node = frame.beams[beam, end]
                for axis in range(dimension(frame)):
                    gradient[node, axis] -= half * frame.weight[beam, axis]


@kernel
def clear_held(frame: Frame, gradient: Floats) -> None:
    """Set the gradient to zero where an unknown is held."""
    for node in range(len(gradient)):
        for axis in range(len(frame.unit)):
            if frame.held[node, axis]:
                gradient[node, axis] = 0.0


@kernel
def find_residual(
    frame: Frame, structure: Structure, fraction: float, state: State, memory: Memory
) -> None:
    """Compute the gradient of the potential energy, held unknowns included."""
    size = len(frame.unit)
    gradient, force = memory.gradient, memory.force
    for node in range(len(gradient)):
        for axis in range(size):
            gradient[node, axis] = 0.0
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        first, second = frame.beams[beam, 0], frame.beams[beam, 1]
        if size == 3:
            result = plane_beam_of(frame, state, beam)
            keep_plane_axial(result, beam, memory)
            add_plane_force(result, gradient[first], gradient[second])
            continue
        beam_force(frame.unit, frame, state, beam, memory)
        for axis in range(size):
            gradient[first, axis] += force[axis]
            gradient[second, axis] += force[size + axis]
    add_loads(frame, structure, fraction, state, gradient)


@kernel
def hold_ends(frame: Frame, beam: int, tangent: Floats) -> None:
    """Clear rows and columns of held unknowns in the stiffness of a beam."""
    size = len(frame.unit)
    for end in range(2):
        node = frame.beams[beam, end]
        if frame.partly[node]:
            for a in range(size):
                if frame.held[node, a]:
                    for b in range(2 * size):
                        tangent[size * end + a, b] = 0.0
                        tangent[b, size * end + a] = 0.0


@kernel
def scatter(frame: Frame, structure: Structure, beam: int, memory: Memory) -> None:
    """Add the stiffness of a beam to that of the frame."""
    size = len(frame.unit)
    tangent, diagonal, entries = memory.tangent_block, memory.diagonal, memory.entries
    i, j = frame.block[frame.beams[beam, 0]], frame.block[frame.beams[beam, 1]]
    hold_ends(frame, beam, tangent)
    if i >= 0:
        for a in range(size):
            for b in range(size):
                diagonal[i, a, b] += tangent[a, b]
    if j >= 0:
        for a in range(size):
            for b in range(size):
                diagonal[j, a, b] += tangent[size + a, size + b]
    t = structure.beam_entry[beam]
    if t >= 0:
        # Rows belong to the block that is eliminated last.
        row, column = (size, 0) if i < j else (0, size)
        for a in range(size):
            for b in range(size):
                entries[t, a, b] += tangent[row + a, column + b]


@kernel
def complete_diagonal(frame: Frame, structure: Structure, memory: Memory) -> None:
    """Add springs, and ones where an unknown is held or does not move."""
    size = len(frame.unit)
    for node in frame.spring_nodes:
        block = frame.block[node]
        if block >= 0 and structure.active[node]:
            for i in range(3):
                for j in range(3):
                    if not frame.held[node, i] and not frame.held[node, j]:
                        memory.diagonal[block, i, j] += frame.ground[node, i, j]
    for node in range(len(frame.block)):
        block = frame.block[node]
        if block >= 0 and (frame.partly[node] or not structure.active[node]):
            for a in range(size):
                if frame.held[node, a] or not structure.active[node]:
                    memory.diagonal[block, a, a] = 1.0


@kernel
def assemble(
    frame: Frame,
    structure: Structure,
    fraction: float,
    state: State,
    softening: float,
    memory: Memory,
) -> None:
    """Compute the gradient, and the stiffness with the tensions in `memory.tension`."""
    size = len(frame.unit)
    gradient, force = memory.gradient, memory.force
    for node in range(len(gradient)):
        for axis in range(size):
            gradient[node, axis] = 0.0
    clear_stiffness(structure, memory)
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        first, second = frame.beams[beam, 0], frame.beams[beam, 1]
        if size == 3 and not (frame.partly[first] or frame.partly[second]):
            add_plane_beam(frame, structure, state, beam, softening, memory)
            continue
        beam_tangent(frame.unit, frame, state, beam, memory.tension[beam], softening, memory)
        for axis in range(size):
            gradient[first, axis] += force[axis]
            gradient[second, axis] += force[size + axis]
        scatter(frame, structure, beam, memory)
    complete_diagonal(frame, structure, memory)
    add_loads(frame, structure, fraction, state, gradient)


@inlined
def add_plane_beam(
    frame: Frame, structure: Structure, state: State, beam: int, softening: float, memory: Memory
) -> None:
    """Add force and stiffness of a beam in the plane, without memory for its matrix."""
    first, second = frame.beams[beam, 0], frame.beams[beam, 1]
    result = plane_beam_of(frame, state, beam)
    stiffness = plane_stiffness(
        result, frame.section[beam], frame.bow[beam], memory.tension[beam], softening
    )
    keep_plane_axial(result, beam, memory)
    add_plane_force(result, memory.gradient[first], memory.gradient[second])
    add_plane_stiffness(
        stiffness, frame.block[first], frame.block[second], structure.beam_entry[beam],
        memory.diagonal, memory.entries,
    )  # fmt: skip


@kernel
def clear_tension(memory: Memory) -> None:
    """Set all tensions to zero."""
    for beam in range(len(memory.tension)):
        memory.tension[beam] = 0.0


@kernel
def add_tension_at(
    frame: Frame, structure: Structure, state: State, share: float, memory: Memory
) -> None:
    """Add `share` times the axial forces in a state."""
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        memory.tension[beam] += share * axial_force(frame, state, beam, memory)


@kernel
def find_tension(frame: Frame, structure: Structure, state: State, memory: Memory) -> None:
    """Set the tensions to the axial forces in a state."""
    clear_tension(memory)
    add_tension_at(frame, structure, state, 1.0, memory)


@kernel
def predict_tension(frame: Frame, structure: Structure, scale: float, memory: Memory) -> None:
    """Compute the tensions to first order after `scale` times the step.

    A Newton step rotates beams along straight lines and so stretches them, by far more than at
    the equilibrium that it leads to. With the tension as an unknown of its own, taken from the
    linear step, the stiffness after the step is accurate (Magisano, Leonetti and Garcea, Comput.
    Methods Appl. Mech. Eng. 313, 2017).
    """
    size = len(frame.unit)
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        i, j = frame.block[frame.beams[beam, 0]], frame.block[frame.beams[beam, 1]]
        rate = 0.0
        for k in range(size):
            if i >= 0:
                rate += memory.axial_slope[beam, k] * memory.step[i, k]
            if j >= 0:
                rate += memory.axial_slope[beam, size + k] * memory.step[j, k]
        memory.tension[beam] = memory.axial[beam] + scale * frame.section[beam, 0] * rate


@kernel
def set_right_side(
    frame: Frame, structure: Structure, field: Floats, scale: float, memory: Memory
) -> None:
    """Copy a field times a factor to `memory.step`, zero where an unknown does not move."""
    step, size = memory.step, len(frame.unit)
    for node in range(len(frame.block)):
        block = frame.block[node]
        if block >= 0:
            for axis in range(size):
                moves = structure.active[node] and not frame.held[node, axis]
                step[block, axis] = scale * field[node, axis] if moves else 0.0


@kernel
def solve_step(structure: Structure, frame: Frame, memory: Memory) -> None:
    """Solve for `memory.step` with the current factor."""
    solve(
        frame.unit, structure.column_start, structure.row, memory.diagonal, memory.entries,
        memory.step,
    )  # fmt: skip


@kernel
def spread_step(frame: Frame, field: Floats, memory: Memory) -> None:
    """Copy `memory.step` to a field; zero at held nodes."""
    for node in range(len(frame.block)):
        block = frame.block[node]
        for axis in range(len(frame.unit)):
            field[node, axis] = memory.step[block, axis] if block >= 0 else 0.0


@kernel
def take_step(frame: Frame, scale: float, state: State, memory: Memory) -> None:
    """Move the free nodes by `scale` times the step."""
    for node in range(len(frame.block)):
        if frame.block[node] >= 0:
            move_node(state, node, scale, memory.step[frame.block[node]])


@kernel
def factorise_stiffness(frame: Frame, structure: Structure, memory: Memory) -> bool:
    """Factorise the stiffness; False if it is not positive definite."""
    return factorise(
        frame.unit, structure.column_start, structure.row, memory.diagonal, memory.entries,
        memory.column, memory.link,
    )  # fmt: skip


@kernel
def stiffness_is_definite(
    frame: Frame, structure: Structure, fraction: float, state: State, memory: Memory
) -> bool:
    """Factorise the stiffness of a state; False if the state is unstable."""
    find_tension(frame, structure, state, memory)
    assemble(frame, structure, fraction, state, 1.0, memory)
    return factorise_stiffness(frame, structure, memory)
