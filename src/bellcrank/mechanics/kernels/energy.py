"""Energy, gradient and stiffness in the beam-rotation form.

With omega_m the rotation of beam m from its rest direction, the energy is

    E = sum_m k (r_m - r0_m)^2 + sum_s w_s (omega_b - omega_a)^2
        + sum_outputs 1/2 u.S u - sum_loads f.u

with w = lambda, or 2 lambda at a node of two beams, whose inner and outer angle
change by the same amount (Bonfanti et al. 2020, Methods, without factors 1/2).
For d the vector along a beam, n its unit vector and t = n turned by 90 degrees:
d omega / d d = t / r and d2 omega / d d2 = -(n t' + t n') / r^2.
"""

from __future__ import annotations

import math

from bellcrank.mechanics.kernels._compile import kernel
from bellcrank.mechanics.kernels.arrays import (
    ACTIVE,
    HELD,
    HELD_X,
    HELD_Y,
    Bytes,
    Floats,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.core import other_end
from bellcrank.mechanics.kernels.fields import clear, pair, triple


@kernel
def beam_rotation(system: System, u: Floats, beam: int) -> float:
    """Return the rotation of a beam from its rest direction, in (-pi, pi]."""
    first, second = pair(system.beams, beam)
    rest_x, rest_y = pair(system.rest_vector, beam)
    x = rest_x + u[second, 0] - u[first, 0]
    y = rest_y + u[second, 1] - u[first, 1]
    return math.atan2(rest_x * y - rest_y * x, rest_x * x + rest_y * y)


@kernel
def measure_beam(system: System, u: Floats, beam: int, scratch: Scratch) -> None:
    """Compute length, direction, rotation and its derivative of one beam at displacement `u`."""
    first, second = pair(system.beams, beam)
    rest_x, rest_y = pair(system.rest_vector, beam)
    x = rest_x + (u[second, 0] - u[first, 0])
    y = rest_y + (u[second, 1] - u[first, 1])
    length = math.sqrt(x * x + y * y)
    inverse = 1.0 / length
    x_axis = x * inverse
    y_axis = y * inverse
    scratch.length[beam] = length
    scratch.axis[beam, 0] = x_axis
    scratch.axis[beam, 1] = y_axis
    scratch.turn[beam, 0] = -y_axis * inverse
    scratch.turn[beam, 1] = x_axis * inverse
    scratch.rotation[beam] = math.atan2(rest_x * y - rest_y * x, rest_x * x + rest_y * y)


@kernel
def measure_held_beams(system: System, structure: Structure, u: Floats, scratch: Scratch) -> None:
    """Measure the beams between held nodes, which do not move at a fixed load."""
    for index in range(structure.sizes[2], len(structure.beam)):
        measure_beam(system, u, structure.beam[index], scratch)


@kernel
def find_gradient(
    system: System, structure: Structure, fraction: float, u: Floats, scratch: Scratch
) -> None:
    """Compute the gradient of the energy by the free coordinates, at `fraction` of the load."""
    torque, turn_weight, gradient = scratch.torque, scratch.turn_weight, scratch.gradient
    movable = structure.sizes[1]
    clear(gradient, len(gradient))
    for index in range(movable):
        beam = structure.beam[index]
        measure_beam(system, u, beam, scratch)
        torque[beam] = 0.0
        turn_weight[beam] = 0.0
    for spring in range(structure.sizes[3]):
        a, b = pair(structure.spring_beams, spring)
        weight = 2.0 * structure.spring_weight[spring]
        moment = weight * (scratch.rotation[b] - scratch.rotation[a])
        torque[b] += moment
        torque[a] -= moment
        turn_weight[a] += weight
        turn_weight[b] += weight
    for index in range(movable):
        beam = structure.beam[index]
        first, second = pair(system.beams, beam)
        tension = 2.0 * system.bond * (scratch.length[beam] - system.rest_length[beam])
        for axis in range(2):
            force = tension * scratch.axis[beam, axis] + torque[beam] * scratch.turn[beam, axis]
            gradient[second, axis] += force
            gradient[first, axis] -= force
    add_loads(system, structure, fraction, u, gradient)


@kernel
def add_loads(
    system: System, structure: Structure, fraction: float, u: Floats, gradient: Floats
) -> None:
    """Add output springs and forces to the gradient; clear its held coordinates."""
    for index in range(structure.sizes[0]):
        node = structure.order[index]
        if structure.active[node] != ACTIVE or system.held[node] == HELD:
            gradient[node, 0] = 0.0
            gradient[node, 1] = 0.0
            continue
        xx, xy, yy = triple(system.ground, node)
        gradient[node, 0] += xx * u[node, 0] + xy * u[node, 1] - fraction * system.load[node, 0]
        gradient[node, 1] += xy * u[node, 0] + yy * u[node, 1] - fraction * system.load[node, 1]
        if system.held[node] & HELD_X:
            gradient[node, 0] = 0.0
        if system.held[node] & HELD_Y:
            gradient[node, 1] = 0.0


@kernel
def add_to_off_diagonal(
    system: System,
    row: int,
    column: int,
    entry: int,
    xx: float,
    xy: float,
    yx: float,
    yy: float,
    scratch: Scratch,
) -> None:
    """Add a block whose rows belong to node `row`; the lower triangle is stored."""
    target = scratch.off_diagonal
    if system.block[row] < system.block[column]:
        xy, yx = yx, xy
    target[entry, 0] += xx
    target[entry, 1] += xy
    target[entry, 2] += yx
    target[entry, 3] += yy


@kernel
def add_beam_stiffness(
    system: System, structure: Structure, beam: int, softening: float, scratch: Scratch
) -> None:
    """Add the block B of one beam: +B on its ends' diagonals, -B between them."""
    first, second = pair(system.beams, beam)
    length = scratch.length[beam]
    x, y = pair(scratch.axis, beam)
    along = 2.0 * system.bond
    tension = scratch.tension[beam] / length
    tension = max(tension, softening * tension)
    skew = softening * scratch.torque[beam] / (length * length)
    across = tension + scratch.turn_weight[beam] / (length * length)
    xx = along * x * x + across * y * y + 2.0 * skew * x * y
    yy = along * y * y + across * x * x - 2.0 * skew * x * y
    xy = (along - across) * x * y - skew * (x * x - y * y)
    for node in (first, second):
        block = system.block[node]
        if block >= 0:
            scratch.diagonal[block, 0] += xx
            scratch.diagonal[block, 1] += xy
            scratch.diagonal[block, 3] += yy
    entry = structure.beam_entry[beam]
    if entry >= 0:
        add_to_off_diagonal(system, first, second, entry, -xx, -xy, -xy, -yy, scratch)


@kernel
def add_spring_stiffness(
    system: System, structure: Structure, spring: int, scratch: Scratch
) -> None:
    """Add the coupling of the two beams of an angular spring.

    The contribution of the spring to each beam alone is already in `turn_weight`. With q_a, q_b
    the derivatives of the rotations by the far ends and X = q_a q_b', the coupling is -2 w X
    between the far ends, +2 w X between far end and node, and -2 w (X + X') at the node.
    """
    node = structure.spring_node[spring]
    a, b = pair(structure.spring_beams, spring)
    weight = 2.0 * structure.spring_weight[spring]
    sign = weight if (system.beams[a, 0] == node) == (system.beams[b, 0] == node) else -weight
    xx = sign * scratch.turn[a, 0] * scratch.turn[b, 0]
    xy = sign * scratch.turn[a, 0] * scratch.turn[b, 1]
    yx = sign * scratch.turn[a, 1] * scratch.turn[b, 0]
    yy = sign * scratch.turn[a, 1] * scratch.turn[b, 1]
    block = system.block[node]
    far_a = other_end(system, a, node)
    far_b = other_end(system, b, node)
    if block >= 0:
        scratch.diagonal[block, 0] -= 2.0 * xx
        scratch.diagonal[block, 1] -= xy + yx
        scratch.diagonal[block, 3] -= 2.0 * yy
        if system.block[far_a] >= 0:
            add_to_off_diagonal(
                system, far_a, node, structure.beam_entry[a], xx, xy, yx, yy, scratch
            )
        if system.block[far_b] >= 0:
            add_to_off_diagonal(
                system, far_b, node, structure.beam_entry[b], xx, yx, xy, yy, scratch
            )
    entry = structure.spring_entry[spring]
    if entry >= 0:
        add_to_off_diagonal(system, far_a, far_b, entry, -xx, -xy, -yx, -yy, scratch)


@kernel
def find_stiffness(
    system: System, structure: Structure, softening: float, scratch: Scratch
) -> None:
    """Assemble the second derivative of the energy.

    Call `find_gradient` first, and `find_tension` or `predict_tension`.

    Parameters
    ----------
    softening
        1 for the stiffness; 0 to leave out the softening by compression and by moments, which
        can make it indefinite.
    """
    clear(scratch.diagonal, len(scratch.diagonal))
    clear(scratch.off_diagonal, structure.column_start[len(scratch.diagonal)])
    for index in range(structure.sizes[1]):
        add_beam_stiffness(system, structure, structure.beam[index], softening, scratch)
    for spring in range(structure.sizes[3]):
        add_spring_stiffness(system, structure, spring, scratch)
    rollers = False
    for node in range(len(system.held)):
        block = system.block[node]
        if block >= 0:
            if structure.active[node] == ACTIVE:
                scratch.diagonal[block, 0] += system.ground[node, 0]
                scratch.diagonal[block, 1] += system.ground[node, 1]
                scratch.diagonal[block, 3] += system.ground[node, 2]
                rollers |= system.held[node] != 0
            else:
                scratch.diagonal[block, 0] = 1.0
                scratch.diagonal[block, 3] = 1.0
    if rollers:
        hold_coordinates(system, system.held, structure, scratch)


@kernel
def hold_coordinates(
    system: System, coordinates: Bytes, structure: Structure, scratch: Scratch
) -> None:
    """Replace the equations of some coordinates with the identity.

    Parameters
    ----------
    coordinates
        (N,) bits HELD_X, HELD_Y: those of rollers, or of boundary nodes.
    """
    diagonal, off_diagonal = scratch.diagonal, scratch.off_diagonal
    held = scratch.link[:, 0]
    for node in range(len(coordinates)):
        block = system.block[node]
        if block >= 0:
            held[block] = coordinates[node]
    for column in range(len(diagonal)):
        if held[column]:
            diagonal[column, 1] = 0.0
            if held[column] & HELD_X:
                diagonal[column, 0] = 1.0
            if held[column] & HELD_Y:
                diagonal[column, 3] = 1.0
        for entry in range(structure.column_start[column], structure.column_start[column + 1]):
            row = structure.row[entry]
            if held[row] & HELD_X or held[column] & HELD_X:
                off_diagonal[entry, 0] = 0.0
            if held[row] & HELD_X or held[column] & HELD_Y:
                off_diagonal[entry, 1] = 0.0
            if held[row] & HELD_Y or held[column] & HELD_X:
                off_diagonal[entry, 2] = 0.0
            if held[row] & HELD_Y or held[column] & HELD_Y:
                off_diagonal[entry, 3] = 0.0


@kernel
def elastic_energy(system: System, structure: Structure, u: Floats, scratch: Scratch) -> float:
    """Return the energy of beams, angular springs and output springs, without the load."""
    total = 0.0
    beams = structure.beam
    for index in range(len(beams)):
        if index < structure.sizes[1] or index >= structure.sizes[2]:
            beam = beams[index]
            measure_beam(system, u, beam, scratch)
            stretch = scratch.length[beam] - system.rest_length[beam]
            total += system.bond * stretch * stretch
    for spring in range(len(structure.spring_node)):
        if spring < structure.sizes[3] or spring >= structure.sizes[4]:
            a, b = pair(structure.spring_beams, spring)
            bend = scratch.rotation[b] - scratch.rotation[a]
            total += structure.spring_weight[spring] * bend * bend
    for index in range(structure.sizes[0]):
        node = structure.order[index]
        if structure.active[node] == ACTIVE:
            xx, xy, yy = triple(system.ground, node)
            x, y = pair(u, node)
            total += 0.5 * (xx * x * x + 2.0 * xy * x * y + yy * y * y)
    return total


@kernel
def work_of_load(system: System, fraction: float, u: Floats) -> float:
    """Return the work of the forces of a force drive at `fraction` of the load."""
    total = 0.0
    for node in system.input_nodes:
        total += system.load[node, 0] * u[node, 0] + system.load[node, 1] * u[node, 1]
    return fraction * total
