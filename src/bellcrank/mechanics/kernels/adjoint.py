"""Adjoint of the efficiency, compliance of the output, and the neighbours of a flipped beam.

At equilibrium the gradient g(u) vanishes. A change dg of it changes the displacement by -K^-1 dg
to first order, and the efficiency by -a.dg with the adjoint a, K a = d(efficiency)/du.
"""

from __future__ import annotations

import math

from bellcrank.mechanics.kernels._compile import entry, kernel
from bellcrank.mechanics.kernels.arrays import (
    ACTIVE,
    HELD,
    Bytes,
    Floats,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.cholesky import solve
from bellcrank.mechanics.kernels.fields import clear
from bellcrank.mechanics.kernels.newton import take_step
from bellcrank.mechanics.kernels.response import efficiency_of, input_motion
from bellcrank.mechanics.kernels.tangents import set_right_side, stiffness_is_definite


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
    """Solve K adjoint = d(efficiency)/du with the current factor."""
    gradient = scratch.gradient
    clear(gradient, len(gradient))
    add_efficiency_gradient(system, u, gradient)
    set_right_side(system, structure, gradient, scratch)
    solve(structure, scratch)
    clear(adjoint, len(adjoint))
    take_step(system, 1.0, adjoint, scratch)


@entry
def output_compliance(system: System, structure: Structure, u: Floats, scratch: Scratch) -> float:
    """Return t.(K^-1 t), t the mean direction of the output, at the equilibrium `u`.

    K is the tangent stiffness, with the input held if it is driven by a displacement. The mean is
    over the output nodes that the structure holds; 0 if there are none, -1 if K is not positive
    definite.
    """
    if not stiffness_is_definite(system, structure, 1.0, u, scratch):
        return -1.0
    direction, step = scratch.vectors.adjoint, scratch.step
    clear(direction, len(direction))
    count = 0
    for index in range(len(system.output_nodes)):
        node = system.output_nodes[index]
        if system.block[node] >= 0 and structure.active[node] == ACTIVE:
            count += 1
            direction[node, 0] = system.output_direction[index, 0]
            direction[node, 1] = system.output_direction[index, 1]
    if count == 0:
        return 0.0
    set_right_side(system, structure, direction, scratch)
    solve(structure, scratch)
    total = 0.0
    for node in system.output_nodes:
        block = system.block[node]
        if block >= 0:
            total += step[block, 0] * direction[node, 0]
            total += step[block, 1] * direction[node, 1]
    return total / (count * count)


@kernel
def neighbours_around(
    system: System, structure: Structure, beam: int, node: int
) -> tuple[int, int]:
    """Return the present beams before and after `beam` around a node, -1 where there are none."""
    start, end = system.incident_start[node], system.incident_start[node + 1]
    slot = start
    while system.incident_beam[slot] != beam:
        slot += 1
    before = after = -1
    count = end - start
    for shift in range(1, count):
        following = system.incident_beam[start + (slot - start + shift) % count]
        preceding = system.incident_beam[start + (slot - start - shift) % count]
        if after < 0 and structure.present[following]:
            after = following
        if before < 0 and structure.present[preceding]:
            before = preceding
    return before, after


@kernel
def find_anchored(system: System, structure: Structure, anchored: Bytes) -> None:
    """Mark in (N,) the nodes that are moved by the drive or connected to a support."""
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
