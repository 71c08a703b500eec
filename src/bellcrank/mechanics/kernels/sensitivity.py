"""First-order change of the efficiency by each flip, from one adjoint solve.

At equilibrium g(u) = 0. A flip adds dg to the gradient; to first order the
displacement changes by -K^-1 dg and the efficiency by -a.dg, where the adjoint a
solves K a = d(efficiency)/du. With S = n.(a_2 - a_1) and W = t.(a_2 - a_1) / r, the
rates at which the adjoint stretches and turns a beam, a bond contributes
2 k (r - r0) S and an angular spring 2 w (omega_b - omega_a) (W_b - W_a) to a.dg.
"""

from __future__ import annotations

import math

from bellcrank.mechanics.kernels._compile import entry, kernel
from bellcrank.mechanics.kernels.arrays import (
    HELD,
    HELD_X,
    HELD_Y,
    Bytes,
    Floats,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.cholesky import solve
from bellcrank.mechanics.kernels.energy import measure_beam
from bellcrank.mechanics.kernels.fields import clear
from bellcrank.mechanics.kernels.newton import take_step
from bellcrank.mechanics.kernels.response import efficiency_of, input_motion
from bellcrank.mechanics.kernels.structure import ACTIVE
from bellcrank.mechanics.kernels.tangents import stiffness_is_definite


@kernel
def add_efficiency_gradient(system: System, u: Floats, gradient: Floats) -> None:
    """Add the derivative of the efficiency by the displacement of each node."""
    denominator = system.denominator
    if math.isnan(denominator):
        denominator = system.denominator_scale * input_motion(system, u)
        share = efficiency_of(system, u) * system.denominator_scale / denominator
        for index in range(len(system.input_nodes)):
            node = system.input_nodes[index]
            for axis in range(2):
                gradient[node, axis] -= share * system.input_direction[index, axis]
    scale = system.numerator_scale / denominator
    half_exponent = 0.5 * system.exponent
    for index in range(len(system.output_nodes)):
        node = system.output_nodes[index]
        size = math.sqrt(u[node, 0] ** 2 + u[node, 1] ** 2)
        for axis in range(2):
            wanted = system.output_direction[index, axis]
            slope = wanted
            if system.exponent != 2.0 and size > 0.0:
                along = (
                    u[node, 0] * system.output_direction[index, 0]
                    + u[node, 1] * system.output_direction[index, 1]
                ) / size
                half = max(0.0, 0.5 * (1.0 + along))
                unit = u[node, axis] / size
                slope = unit * (2.0 * half**half_exponent - 1.0)
                slope += half_exponent * half ** (half_exponent - 1.0) * (wanted - along * unit)
            gradient[node, axis] += scale * slope


@kernel
def solve_adjoint(
    system: System, structure: Structure, u: Floats, adjoint: Floats, scratch: Scratch
) -> None:
    """Solve K adjoint = d(efficiency)/du with the factor at hand."""
    gradient = scratch.gradient
    clear(gradient, len(gradient))
    add_efficiency_gradient(system, u, gradient)
    for node in range(len(gradient)):
        block = system.block[node]
        if block >= 0:
            moves = structure.active[node] == ACTIVE
            held = system.held[node]
            scratch.step[block, 0] = gradient[node, 0] if moves and not held & HELD_X else 0.0
            scratch.step[block, 1] = gradient[node, 1] if moves and not held & HELD_Y else 0.0
    solve(structure, scratch)
    clear(adjoint, len(adjoint))
    take_step(system, 1.0, adjoint, scratch)


@kernel
def neighbours_around(
    system: System, structure: Structure, beam: int, node: int
) -> tuple[int, int]:
    """Return the present beams before and after `beam` around a node, -1 where there are none."""
    start, end = system.ring_start[node], system.ring_start[node + 1]
    slot = start
    while system.ring_beam[slot] != beam:
        slot += 1
    before = after = -1
    count = end - start
    for shift in range(1, count):
        if (
            after < 0
            and structure.present[system.ring_beam[start + (slot - start + shift) % count]]
        ):
            after = system.ring_beam[start + (slot - start + shift) % count]
        if (
            before < 0
            and structure.present[system.ring_beam[start + (slot - start - shift) % count]]
        ):
            before = system.ring_beam[start + (slot - start - shift) % count]
    return before, after


@kernel
def find_anchored(system: System, structure: Structure, anchored: Bytes) -> None:
    """Mark in (N,) the nodes that something holds: moved by the drive, or tied to a support."""
    for node in range(len(anchored)):
        anchored[node] = structure.active[node] == ACTIVE or system.held[node] == HELD
    spreading = True
    while spreading:
        spreading = False
        for beam in range(len(structure.present)):
            first, second = system.beams[beam, 0], system.beams[beam, 1]
            if structure.present[beam] and anchored[first] != anchored[second]:
                anchored[first] = anchored[second] = 1
                spreading = True


@kernel
def spring_share(weight: float, a: int, b: int, rotation: Floats, rate: Floats) -> float:
    """Contribution of one angular spring to a.dg."""
    return 2.0 * weight * (rotation[b] - rotation[a]) * (rate[b] - rate[a])


@kernel
def presence_share(
    system: System,
    structure: Structure,
    beam: int,
    counts: Bytes,
    bond_share: float,
    rotation: Floats,
    rate: Floats,
) -> float:
    """a.dg of a beam being there: its bond, and its springs instead of the one they split.

    A beam with an end that is loose is a dead end: unstressed, and turned by half the
    angle between its neighbours at the other end.
    """
    first, second = system.beams[beam, 0], system.beams[beam, 1]
    dead_end = not (counts[first] and counts[second])
    total = 0.0 if dead_end else bond_share
    for end in range(2):
        node = system.beams[beam, end]
        before, after = neighbours_around(system, structure, beam, node)
        if not counts[node] or before < 0:
            continue
        if dead_end:
            total -= 0.5 * spring_share(system.angle, before, after, rotation, rate)
        else:
            total += spring_share(system.angle, before, beam, rotation, rate)
            total += spring_share(system.angle, beam, after, rotation, rate)
            total -= spring_share(system.angle, before, after, rotation, rate)
    return total


@entry
def find_sensitivity(
    system: System,
    mask: Bytes,
    core: int,
    structure: Structure,
    u: Floats,
    scratch: Scratch,
    counts: Bytes,
    sensitivity: Floats,
) -> bool:
    """Fill `sensitivity` (M,) with the first-order change of the efficiency by each flip.

    `structure` and `u` must be those of the design's equilibrium. False if it is
    unstable, so that no such change is defined. `counts` (N,) is working memory.
    """
    if not stiffness_is_definite(system, structure, 1.0, u, scratch):
        return False
    adjoint = scratch.vectors[0]
    solve_adjoint(system, structure, u, adjoint, scratch)
    rotation, rate = scratch.rotation, scratch.turn_weight
    for beam in range(len(mask)):
        first, second = system.beams[beam, 0], system.beams[beam, 1]
        measure_beam(system, u, beam, scratch)
        rate[beam] = 0.0
        sensitivity[beam] = 0.0
        for axis in range(2):
            stretch = adjoint[second, axis] - adjoint[first, axis]
            rate[beam] += scratch.turn[beam, axis] * stretch
            sensitivity[beam] += scratch.axis[beam, axis] * stretch
        extension = scratch.length[beam] - system.rest_length[beam]
        sensitivity[beam] *= 2.0 * system.bond * extension
    find_anchored(system, structure, counts)
    for beam in range(len(mask)):
        first, second = system.beams[beam, 0], system.beams[beam, 1]
        moved = structure.active[first] == ACTIVE or structure.active[second] == ACTIVE
        felt = moved and (not core or (counts[first] and counts[second]))
        if not felt or mask[beam] != structure.present[beam]:
            sensitivity[beam] = 0.0
            continue
        share = presence_share(system, structure, beam, counts, sensitivity[beam], rotation, rate)
        sensitivity[beam] = share if mask[beam] else -share
    return True
