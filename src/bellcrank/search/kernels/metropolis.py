"""Compiled Metropolis chain over designs: one block of single flips."""

from __future__ import annotations

import math
from typing import NamedTuple

from bellcrank.mechanics.kernels._compile import entry, kernel
from bellcrank.mechanics.kernels.arrays import (
    CONVERGED,
    Bytes,
    Floats,
    Ints,
    Reference,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.response import (
    find_response,
    set_reference,
)
from bellcrank.search.kernels.acceptance import (
    exponential_cost,
    metropolis_accepts,
    negative_cost,
)

EXPONENTIAL = 0
"""Code of `exponential_cost` in `bellcrank.search.markov.costs`; 1 is `negative_cost`."""

accepts = kernel(metropolis_accepts)
exponential = kernel(exponential_cost)
negative = kernel(negative_cost)


class Chain(NamedTuple):
    """State of a chain, updated in place."""

    mask: Bytes
    """(M,) the current design."""
    packed: Bytes
    """The current design as packed bits."""
    value: Floats
    """(3,) efficiency and cost of the current design, best efficiency so far."""
    accepted: Ints
    """(1,) accepted steps."""


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
    """Return the cost of an efficiency."""
    if code == EXPONENTIAL:
        return exponential(efficiency)
    return negative(efficiency)


@kernel
def flip(chain: Chain, beam: int) -> None:
    """Remove a present beam or add an absent one."""
    chain.mask[beam] ^= 1
    chain.packed[beam >> 3] ^= 128 >> (beam & 7)


@entry
def advance(
    system: System,
    designable: Ints,
    cost_code: int,
    core: int,
    temperatures: Floats,
    uniforms: Floats,
    chain: Chain,
    reference: Reference,
    structure: Structure,
    u: Floats,
    scratch: Scratch,
    records: Records,
) -> None:
    """Make one proposal for each row of `uniforms`.

    A design without a unique, stable response is rejected at any temperature.

    Parameters
    ----------
    temperatures
        Temperature after 0, 1, 2, ... accepted steps; the last entry holds afterwards.
    uniforms
        (n, 2) random numbers in [0, 1) that select the beam and decide on acceptance.
    reference
        Equilibrium of the current design; updated.
    """
    for step in range(len(uniforms)):
        beam = designable[int(uniforms[step, 0] * len(designable))]
        flip(chain, beam)
        temperature = temperatures[min(chain.accepted[0], len(temperatures) - 1)]
        status, efficiency = find_response(
            system, chain.mask, core, reference, True, -math.inf, 1.0, structure, u, scratch
        )
        cost = cost_of(cost_code, efficiency)
        log_ratio = (chain.value[1] - cost) / temperature
        accepted = status == CONVERGED and accepts(log_ratio, uniforms[step, 1])
        for byte in range(len(chain.packed)):
            records.mask[step, byte] = chain.packed[byte]
        records.efficiency[step] = efficiency
        records.cost[step] = cost
        records.temperature[step] = temperature
        records.accepted[step] = accepted
        records.status[step] = status
        if accepted:
            chain.value[0] = efficiency
            chain.value[1] = cost
            chain.value[2] = max(efficiency, chain.value[2])
            chain.accepted[0] += 1
            set_reference(structure, u, reference)
        else:
            flip(chain, beam)
