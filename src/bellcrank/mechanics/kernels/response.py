"""The efficiency of a design: from rest, or from the equilibrium of a neighbour."""

from __future__ import annotations

import math

from bellcrank.mechanics.kernels._compile import entry, inlined, kernel
from bellcrank.mechanics.kernels.arrays import (
    CONVERGED,
    MECHANISM,
    UNCONVERGED,
    UNVERIFIED,
    Bytes,
    Floats,
    Known,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.branch import is_reached_from_rest
from bellcrank.mechanics.kernels.energy import beam_rotation, elastic_energy
from bellcrank.mechanics.kernels.fields import clear, copy, pair
from bellcrank.mechanics.kernels.loading import (
    follow_path,
    place_hanging_pieces,
)
from bellcrank.mechanics.kernels.newton import newton
from bellcrank.mechanics.kernels.structure import ACTIVE, build_structure
from bellcrank.mechanics.kernels.tangents import GUESS, LONGEST_STEP, move_held_nodes
from bellcrank.mechanics.kernels.tension import add_tension_at, clear_tension


@kernel
def output_motion(system: System, u: Floats) -> float:
    """Sum over output nodes of |u| (2 cos(gamma/2)^n - 1), gamma the angle to the wanted direction.

    For n = 2 this is the projection t_out . u (Bonfanti et al. 2020, eqs. 1 and 2).
    """
    total = 0.0
    for index in range(len(system.output_nodes)):
        x, y = pair(u, system.output_nodes[index])
        along = x * system.output_direction[index, 0] + y * system.output_direction[index, 1]
        if system.exponent == 2.0:
            total += along
        else:
            size = math.sqrt(x * x + y * y)
            if size > 0.0:
                half = max(0.0, 0.5 * (1.0 + along / size))
                total += size * (2.0 * half ** (0.5 * system.exponent) - 1.0)
    return total


@kernel
def input_motion(system: System, u: Floats) -> float:
    """Sum over input nodes of t_in . u."""
    total = 0.0
    for index in range(len(system.input_nodes)):
        node = system.input_nodes[index]
        total += (
            u[node, 0] * system.input_direction[index, 0]
            + u[node, 1] * system.input_direction[index, 1]
        )
    return total


@kernel
def efficiency_of(system: System, u: Floats) -> float:
    """Efficiency at displacement `u`."""
    denominator = system.denominator
    if math.isnan(denominator):
        denominator = system.denominator_scale * input_motion(system, u)
    return system.numerator_scale * output_motion(system, u) / denominator


@kernel
def rotation_at(system: System, known: Known, node: int) -> float:
    """Rotation of some beam at a node of the known equilibrium."""
    for slot in range(system.ring_start[node], system.ring_start[node + 1]):
        beam = system.ring_beam[slot]
        if known.present[beam]:
            return beam_rotation(system, known.u, beam)
    return 0.0


@kernel
def guess_from_neighbour(
    system: System,
    known: Known,
    structure: Structure,
    u: Floats,
    scratch: Scratch,
) -> None:
    """Start from the known equilibrium; pieces that were loose follow where they attach.

    A node that moved neither before nor is held takes the displacement of its parent
    plus the turn of its offset by the parent's rotation.
    """
    rotation = scratch.vectors[8, :, 0]
    for node in range(len(u)):
        active = structure.active[node] == ACTIVE
        for axis in range(2):
            u[node, axis] = known.u[node, axis] if active else 0.0
    move_held_nodes(system, 1.0, u)
    for index in range(structure.sizes[0]):
        node = structure.order[index]
        parent = structure.parent[node]
        if known.active[node] == ACTIVE or parent < 0 or system.block[node] < 0:
            continue
        if known.active[parent] == ACTIVE:
            angle = rotation_at(system, known, parent)
        else:
            angle = rotation[parent]
        rotation[node] = angle
        x = system.positions[node, 0] - system.positions[parent, 0]
        y = system.positions[node, 1] - system.positions[parent, 1]
        u[node, 0] = u[parent, 0] + x * (math.cos(angle) - 1.0) - y * math.sin(angle)
        u[node, 1] = u[parent, 1] + x * math.sin(angle) + y * (math.cos(angle) - 1.0)
    move_held_nodes(system, 1.0, u)


@kernel
def remember(structure: Structure, u: Floats, known: Known) -> None:
    """Keep an equilibrium as the one to start from."""
    copy(u, known.u)
    for beam in range(len(known.present)):
        known.present[beam] = structure.present[beam]
    for node in range(len(known.active)):
        known.active[node] = structure.active[node]


@kernel
def is_known(system: System, structure: Structure, known: Known) -> bool:
    """Whether the drive moves the same beams as in the known equilibrium, and no others."""
    for beam in range(len(structure.present)):
        node = system.beams[beam, 0]
        now = structure.present[beam] and structure.active[node] != 0
        before = known.present[beam] and known.active[node] != 0
        if now != before:
            return False
    return True


@inlined
def find_response(
    system: System,
    mask: Bytes,
    core: int,
    known: Known,
    nearby: bool,
    least: float,
    largest_increment: float,
    structure: Structure,
    u: Floats,
    scratch: Scratch,
) -> tuple[int, float]:
    """Fill `structure` and the displacement `u` of the design `mask`; return status, efficiency.

    With `nearby`, start from the known equilibrium of a similar design. Only an
    accelerator: if no moving beam differs it is that equilibrium, and one found from there
    must be judged to be the one reached from rest, else the design is loaded from rest after
    all. Neither is done for one that is not more efficient than `least`: it is UNVERIFIED.
    """
    clear(u, len(u))
    status = build_structure(system, mask, core, structure)
    if status == MECHANISM:
        return status, math.nan
    if nearby and is_known(system, structure, known):
        copy(known.u, u)
        return CONVERGED, efficiency_of(system, u)
    status = UNCONVERGED
    guess = scratch.vectors[GUESS]
    if nearby:
        guess_from_neighbour(system, known, structure, u, scratch)
        copy(u, guess)
        clear_tension(scratch)
        add_tension_at(system, structure, known.u, 1.0, scratch)
        for beam in range(len(mask)):
            if not known.present[beam]:
                scratch.tension[beam] = 0.0
        status = newton(system, structure, 1.0, u, scratch, system.tolerance, LONGEST_STEP)
        if status == CONVERGED and efficiency_of(system, u) <= least:
            return UNVERIFIED, efficiency_of(system, u)
    if status != CONVERGED or not is_reached_from_rest(system, structure, guess, u, scratch):
        status = follow_path(system, structure, u, scratch, largest_increment)
    place_hanging_pieces(system, structure, u)
    return status, efficiency_of(system, u)


@entry
def respond(
    system: System,
    mask: Bytes,
    core: int,
    known: Known,
    nearby: bool,
    least: float,
    largest_increment: float,
    structure: Structure,
    u: Floats,
    scratch: Scratch,
) -> tuple[int, float, float]:
    """As `find_response`, for calls from Python; returns the elastic energy too."""
    status, efficiency = find_response(
        system, mask, core, known, nearby, least, largest_increment, structure, u, scratch
    )
    energy = math.nan
    if status != MECHANISM:
        energy = elastic_energy(system, structure, u, scratch)
    return status, efficiency, energy
