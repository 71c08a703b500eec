"""The Metropolis chain over designs, a block of steps at a time."""

from __future__ import annotations

import math
from typing import NamedTuple

from bellcrank.mechanics.kernels._compile import entry, kernel
from bellcrank.mechanics.kernels.arrays import (
    CONVERGED,
    Bytes,
    Floats,
    Ints,
    Known,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.response import (
    find_from_neighbour,
    remember,
)

EXPONENTIAL = 0
NEGATIVE = 1


class Records(NamedTuple):
    """One row for each proposal of a block of n, filled by `advance`."""

    mask: Bytes
    """(n, bytes) the proposed design, packed."""
    efficiency: Floats
    """(n,) of the proposed design, accepted or not."""
    cost: Floats
    temperature: Floats
    accepted: Bytes
    status: Bytes


@kernel
def cost_of(code: int, efficiency: float) -> float:
    """Cost that the search lowers: exp(-efficiency) or -efficiency."""
    if code == EXPONENTIAL:
        return math.exp(-efficiency)
    return -efficiency


@kernel
def accepts(old_cost: float, new_cost: float, temperature: float, uniform: float) -> bool:
    """Metropolis' rule: always downhill, uphill with probability exp(-rise / T)."""
    return new_cost <= old_cost or uniform < math.exp((old_cost - new_cost) / temperature)


@entry
def advance(
    system: System,
    designable: Ints,
    core: bool,
    cost_code: int,
    temperatures: Floats,
    uniforms: Floats,
    mask: Bytes,
    packed: Bytes,
    state: Floats,
    known: Known,
    structure: Structure,
    u: Floats,
    scratch: Scratch,
    records: Records,
) -> None:
    """Make one proposal for each row of `uniforms`.

    Parameters
    ----------
    temperatures
        Temperature after 0, 1, 2, ... accepted steps; the last one holds for ever.
    uniforms
        (n, 2) random numbers in [0, 1): which beam, and whether uphill.
    mask, packed
        The current design, as bytes and as bits; updated.
    state
        Current efficiency, current cost, number of accepted steps; updated.
    known
        Equilibrium of the current design; updated.
    """
    for step in range(len(uniforms)):
        beam = designable[int(uniforms[step, 0] * len(designable))]
        bit = 128 >> (beam & 7)
        mask[beam] ^= 1
        packed[beam >> 3] ^= bit
        status, efficiency = find_from_neighbour(system, mask, core, known, structure, u, scratch)
        cost = cost_of(cost_code, efficiency)
        temperature = temperatures[min(int(state[2]), len(temperatures) - 1)]
        accepted = status == CONVERGED and accepts(state[1], cost, temperature, uniforms[step, 1])
        for byte in range(len(packed)):
            records.mask[step, byte] = packed[byte]
        records.efficiency[step] = efficiency
        records.cost[step] = cost
        records.temperature[step] = temperature
        records.accepted[step] = accepted
        records.status[step] = status
        if accepted:
            state[0] = efficiency
            state[1] = cost
            state[2] += 1.0
            remember(structure, u, known)
        else:
            mask[beam] ^= 1
            packed[beam >> 3] ^= bit
