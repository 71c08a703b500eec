"""Change of forces by each flip, predicted by one Newton step for all flips at once.

At an equilibrium with stiffness K, adding (s = 1) or removing (s = -1) a beam between two nodes
changes the gradient of the potential energy by s f and the stiffness by s k, f the end forces of
the beam, less its own weight, and k its tangent stiffness, both of the 2 b unknowns of its ends.
One Newton step from the old equilibrium changes a quantity Q by

    -a.x,    (1 + s k G) x = s f,

with the adjoint a = K^-1 dQ/du and G the blocks of K^-1 at the two ends. All flips share G, which
is computed on the pattern of the factor alone (K. Takahashi, J. Fagan, M.-S. Chen, 1973), so
memory grows with the number of beams. The derivative of Q by the presence of a beam is -a.f.

On held unknowns, where a quantity is a reaction, a is minus the weight of the reaction, so that
the force of the flipped beam itself is included.

A linear motion z = K^-1 w of the equilibrium changes in the same way: a.w = w.K^-1 w, for example,
by -a.y with (1 + s k G) y = s k z.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.mechanics.frames.kernels.assembly import (
    assemble,
    factorise_stiffness,
    find_tension,
    set_right_side,
    solve_step,
    spread_step,
)
from bellcrank.mechanics.frames.kernels.beams import axial_force, beam_tangent, dimension
from bellcrank.mechanics.frames.kernels.factor import couple, entry_of, fill_in
from bellcrank.mechanics.frames.kernels.response import add_efficiency_gradient, efficiency_of
from bellcrank.mechanics.frames.kernels.state import force_share
from bellcrank.mechanics.kernels._compile import entry, kernel
from bellcrank.mechanics.kernels.fields import clear

if TYPE_CHECKING:
    from bellcrank.mechanics.frames.kernels.arrays import Flips, Frame, Memory, State, Structure
    from bellcrank.mechanics.kernels.arrays import Floats, Ints

REMAINDER = 1e-6
"""Part of a removed beam that remains in the equations: pieces that it held alone follow without
stress, instead of making the equations singular."""
SMALLEST_PIVOT = 1e-14


@kernel
def carries(frame: Frame, structure: Structure, beam: int) -> bool:
    """Whether a beam would join two nodes that are active or held."""
    first, second = frame.beams[beam, 0], frame.beams[beam, 1]
    free = (structure.active[first] and frame.block[first] >= 0) or (
        structure.active[second] and frame.block[second] >= 0
    )
    held = structure.active[first] or frame.grounded[first]
    held_too = structure.active[second] or frame.grounded[second]
    return free and held and held_too


@kernel
def find_whole_pattern(frame: Frame, structure: Structure, beams: Ints) -> None:
    """Find the pattern of the factor with all flips; `structure` has the pattern to be filled."""
    bits, block = structure.column_bits, frame.block
    clear(bits, len(bits))
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        first, second = block[frame.beams[beam, 0]], block[frame.beams[beam, 1]]
        if first >= 0 and second >= 0:
            couple(bits, first, second)
    for beam in beams:
        first, second = block[frame.beams[beam, 0]], block[frame.beams[beam, 1]]
        if first >= 0 and second >= 0 and carries(frame, structure, beam):
            couple(bits, first, second)
    fill_in(bits, structure.column_start, structure.word_start, structure.row)
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        first, second = block[frame.beams[beam, 0]], block[frame.beams[beam, 1]]
        structure.beam_entry[beam] = -1
        if first >= 0 and second >= 0:
            structure.beam_entry[beam] = entry_of(bits, structure.word_start, first, second)


@kernel
def divide_by_pivot(size: int, own: Floats, block: Floats, out: Floats) -> None:
    """Compute block own^-1, with own a lower factor that has inverse pivots."""
    for a in range(size):
        for b in range(size - 1, -1, -1):
            total = block[a, b]
            for c in range(b + 1, size):
                total -= out[a, c] * own[c, b]
            out[a, b] = total * own[b, b]


@kernel
def invert_pivot(unit: tuple[float, ...], own: Floats, small: Floats) -> None:
    """Replace a lower factor with inverse pivots by the inverse of the block it belongs to."""
    size = len(unit)
    for b in range(size):
        for a in range(size):
            total = 1.0 if a == b else 0.0
            for c in range(b, a):
                total -= own[a, c] * small[c, b]
            small[a, b] = total * own[a, a] if a >= b else 0.0
    for a in range(size):
        for b in range(size):
            total = 0.0
            for c in range(max(a, b), size):
                total += small[c, a] * small[c, b]
            own[a, b] = total


@kernel
def add_product(
    unit: tuple[float, ...], inverse: Floats, transposed: bool, ratio: Floats, out: Floats
) -> None:
    """Subtract the product of a block of the inverse and a block of `ratio` from `out`."""
    size = len(unit)
    for a in range(size):
        for b in range(size):
            total = 0.0
            for c in range(size):
                total += (inverse[c, a] if transposed else inverse[a, c]) * ratio[c, b]
            out[a, b] -= total


@kernel
def invert_on_pattern(frame: Frame, structure: Structure, memory: Memory) -> None:
    """Replace the factor by the blocks of the inverse stiffness on its pattern."""
    unit, size = frame.unit, len(frame.unit)
    start, row = structure.column_start, structure.row
    diagonal, entries, ratio = memory.diagonal, memory.entries, memory.column
    small = memory.tangent_block
    for j in range(len(diagonal) - 1, -1, -1):
        first, last = start[j], start[j + 1]
        for t in range(first, last):
            divide_by_pivot(size, diagonal[j], entries[t], ratio[row[t]])
            for a in range(size):
                for b in range(size):
                    entries[t, a, b] = 0.0
        invert_pivot(unit, diagonal[j], small)
        for s in range(first, last):
            k = row[s]
            add_product(unit, diagonal[k], False, ratio[k], entries[s])
            for t in range(s + 1, last):
                i = row[t]
                offset = entry_of(structure.column_bits, structure.word_start, k, i)
                add_product(unit, entries[offset], False, ratio[k], entries[t])
                add_product(unit, entries[offset], True, ratio[i], entries[s])
        for t in range(first, last):
            k = row[t]
            for a in range(size):
                for b in range(size):
                    total = 0.0
                    for c in range(size):
                        total += ratio[k, c, a] * entries[t, c, b]
                    diagonal[j, a, b] -= total


@kernel
def fill_coupling(
    frame: Frame, structure: Structure, beam: int, memory: Memory, coupling: Floats
) -> None:
    """Fill G, (2 b, 2 b): the inverse stiffness at the ends of a beam; zero where held."""
    size = len(frame.unit)
    for a in range(2 * size):
        for b in range(2 * size):
            coupling[a, b] = 0.0
    for end in range(2):
        node = frame.beams[beam, end]
        i = frame.block[node]
        if i < 0 or not structure.active[node]:
            continue
        for a in range(size):
            for b in range(size):
                coupling[size * end + a, size * end + b] = memory.diagonal[i, a, b]
    first, second = frame.beams[beam, 0], frame.beams[beam, 1]
    i, j = frame.block[first], frame.block[second]
    if i >= 0 and j >= 0 and structure.active[first] and structure.active[second]:
        t = entry_of(structure.column_bits, structure.word_start, i, j)
        for a in range(size):
            for b in range(size):
                value = memory.entries[t, b, a] if i < j else memory.entries[t, a, b]
                coupling[a, size + b] = value
                coupling[size + b, a] = value
    for end in range(2):
        clear_held_rows(frame, frame.beams[beam, end], size * end, coupling)


@kernel
def clear_held_rows(frame: Frame, node: int, offset: int, coupling: Floats) -> None:
    """Set rows and columns of the held unknowns of a node to zero."""
    size = len(frame.unit)
    if frame.partly[node]:
        for a in range(size):
            if frame.held[node, a]:
                for b in range(2 * size):
                    coupling[offset + a, b] = coupling[b, offset + a] = 0.0


@kernel
def solve_small(count: int, matrix: Floats) -> bool:
    """Replace the last columns of a matrix (c, c + r) by the solutions; False if it is singular."""
    width = matrix.shape[1]
    for column in range(count):
        pivot = column
        for p in range(column + 1, count):
            if abs(matrix[p, column]) > abs(matrix[pivot, column]):
                pivot = p
        if not abs(matrix[pivot, column]) > SMALLEST_PIVOT:
            return False
        for q in range(column, width):
            value = matrix[column, q]
            matrix[column, q] = matrix[pivot, q]
            matrix[pivot, q] = value
        for p in range(column + 1, count):
            ratio = matrix[p, column] / matrix[column, column]
            if ratio != 0.0:
                for q in range(column + 1, width):
                    matrix[p, q] -= ratio * matrix[column, q]
    for r in range(count, width):
        for p in range(count - 1, -1, -1):
            total = matrix[p, r]
            for q in range(p + 1, count):
                total -= matrix[p, q] * matrix[q, r]
            matrix[p, r] = total / matrix[p, p]
    return True


@kernel
def set_right_sides(
    frame: Frame, beam: int, sign: float, fraction: float, motions: Floats, memory: Memory,
    matrix: Floats,
) -> None:  # fmt: skip
    """Set the last columns of a matrix to s f and s k z; f and k are in the memory."""
    size = len(frame.unit)
    for a in range(2 * size):
        matrix[a, 2 * size] = sign * memory.force[a]
    if frame.has_weight:
        half = 0.5 * sign * force_share(frame, frame.weight_group, fraction)
        for axis in range(dimension(frame)):
            matrix[axis, 2 * size] -= half * frame.weight[beam, axis]
            matrix[size + axis, 2 * size] -= half * frame.weight[beam, axis]
    for number in range(len(motions)):
        for a in range(2 * size):
            total = 0.0
            for end in range(2):
                node = frame.beams[beam, end]
                for b in range(size):
                    total += memory.tangent_block[a, size * end + b] * motions[number, node, b]
            matrix[a, 2 * size + 1 + number] = sign * total


@kernel
def solve_flip(
    frame: Frame, structure: Structure, beam: int, sign: float, memory: Memory, space: Flips
) -> bool:
    """Replace the right-hand sides by the solutions of (1 + s k G) x = s f."""
    count = 2 * len(frame.unit)
    matrix = space.matrix
    fill_coupling(frame, structure, beam, memory, space.coupling)
    for a in range(count):
        for b in range(count):
            total = 1.0 if a == b else 0.0
            for c in range(count):
                total += sign * memory.tangent_block[a, c] * space.coupling[c, b]
            matrix[a, b] = total
    return solve_small(count, matrix)


@kernel
def solve_adjoint(
    frame: Frame, structure: Structure, field: Floats, on_held: Floats, memory: Memory
) -> None:
    """Replace the derivative of a quantity by its adjoint."""
    set_right_side(frame, structure, field, 1.0, memory)
    solve_step(structure, frame, memory)
    spread_step(frame, field, memory)
    for node in range(len(frame.block)):
        for axis in range(len(frame.unit)):
            if frame.held[node, axis]:
                field[node, axis] = on_held[node, axis]


@entry
def efficiency_at(frame: Frame, u: Floats) -> float:
    """As `efficiency_of`, for calls from Python."""
    return efficiency_of(frame, u)


@entry
def efficiency_gradient(frame: Frame, u: Floats, gradient: Floats) -> None:
    """Fill (N, b) the derivative of the efficiency by the unknowns of each node."""
    clear(gradient, len(gradient))
    add_efficiency_gradient(frame, u, gradient)


@entry
def predict_flips(
    frame: Frame,
    beams: Ints,
    first_order: bool,
    fraction: float,
    structure: Structure,
    state: State,
    memory: Memory,
    space: Flips,
    fields: Floats,
    on_held: Floats,
    motions: Floats,
    change: Floats,
    strain: Floats,
) -> bool:
    """Fill `change` with the forces x by which flips of `beams` change the equilibrium.

    False if the equilibrium is unstable.

    Parameters
    ----------
    first_order
        Compute derivatives by the presence of the beams instead, for present and absent ones.
    structure
        That of the equilibrium, with arrays of its own for the pattern.
    fields
        (k, N, b) derivatives of quantities by the unknowns; replaced by the adjoints.
    on_held
        (k, N, b) adjoints on held unknowns.
    motions
        (m, N, b) linear motions z.
    change
        (n, 1 + m, 2 b) filled with x and the y of each motion; zero for beams that carry no load.
    strain
        (n,) filled with the strain of each of `beams`, or of an absent one between its ends as
        they are. The larger it is, the less accurate is one Newton step.
    """
    size = len(frame.unit)
    find_whole_pattern(frame, structure, beams)
    find_tension(frame, structure, state, memory)
    assemble(frame, structure, fraction, state, 1.0, memory)
    if not factorise_stiffness(frame, structure, memory):
        return False
    for index in range(len(fields)):
        solve_adjoint(frame, structure, fields[index], on_held[index], memory)
    if not first_order:
        invert_on_pattern(frame, structure, memory)
    for index in range(len(beams)):
        beam = beams[index]
        tension = axial_force(frame, state, beam, memory)
        strain[index] = tension / (frame.section[beam, 0] * frame.rest_length[beam])
        loaded = carries(frame, structure, beam)
        if loaded:
            beam_tangent(frame.unit, frame, state, beam, tension, 1.0, memory)
            removed = structure.present[beam] and not first_order
            sign = -(1.0 - REMAINDER) if removed else 1.0
            set_right_sides(frame, beam, sign, fraction, motions, memory, space.matrix)
            loaded = first_order or solve_flip(frame, structure, beam, sign, memory, space)
        for number in range(change.shape[1]):
            for a in range(2 * size):
                x = space.matrix[a, 2 * size + number] if loaded else 0.0
                change[index, number, a] = x
    return True
