"""The pattern of the stiffness matrix and of its factor: symbolic Cholesky factorisation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics.kernels._compile import kernel
from bellcrank.mechanics.kernels.bits import popcount, trailing_zeros
from bellcrank.mechanics.kernels.core import other_end
from bellcrank.mechanics.kernels.fields import clear

if TYPE_CHECKING:
    from bellcrank.mechanics.kernels.arrays import Structure, System

ONE = np.uint64(1)


@kernel
def couple(structure: Structure, first: int, second: int) -> None:
    """Mark two blocks as coupled, unless one of them is held."""
    if first >= 0 and second >= 0 and first != second:
        low = min(first, second)
        high = max(first, second)
        structure.column_bits[low, high >> 6] |= ONE << np.uint64(high & 63)


@kernel
def entry_of(structure: Structure, first: int, second: int) -> int:
    """Return the entry of the block of two coupled nodes, -1 if one of them is held."""
    if first < 0 or second < 0:
        return -1
    low = min(first, second)
    high = max(first, second)
    word = structure.column_bits[low, high >> 6]
    below = word & ((ONE << np.uint64(high & 63)) - ONE)
    return structure.word_start[low, high >> 6] + popcount(below)


@kernel
def fill_in(structure: Structure) -> None:
    """Symbolic Cholesky factorisation: the rows of a column are added to its parent column."""
    bits = structure.column_bits
    columns, width = bits.shape
    count = 0
    for column in range(columns):
        structure.column_start[column] = count
        parent = -1
        for word in range(column >> 6, width):
            rest = bits[column, word]
            structure.word_start[column, word] = count
            while rest:
                row = (word << 6) + trailing_zeros(rest)
                rest &= rest - ONE
                if parent < 0:
                    parent = row
                structure.row[count] = row
                count += 1
        if parent >= 0:
            for word in range(parent >> 6, width):
                bits[parent, word] |= bits[column, word]
            bits[parent, parent >> 6] &= ~(ONE << np.uint64(parent & 63))
    structure.column_start[columns] = count


@kernel
def find_pattern(system: System, structure: Structure) -> None:
    """Find the pattern of the stiffness and of its factor, and the entries of beams and springs."""
    clear(structure.column_bits, len(structure.column_bits))
    block, beams = system.block, system.beams
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        couple(structure, block[beams[beam, 0]], block[beams[beam, 1]])
    for spring in range(structure.sizes[3]):
        node = structure.spring_node[spring]
        first = block[other_end(system, structure.spring_beams[spring, 0], node)]
        second = block[other_end(system, structure.spring_beams[spring, 1], node)]
        couple(structure, first, second)
    fill_in(structure)
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        structure.beam_entry[beam] = entry_of(
            structure, block[beams[beam, 0]], block[beams[beam, 1]]
        )
    for spring in range(structure.sizes[3]):
        node = structure.spring_node[spring]
        first = block[other_end(system, structure.spring_beams[spring, 0], node)]
        second = block[other_end(system, structure.spring_beams[spring, 1], node)]
        structure.spring_entry[spring] = entry_of(structure, first, second)
