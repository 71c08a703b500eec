"""Response of a design, from rest or from the equilibrium of a reference design."""

from __future__ import annotations

import math

from bellcrank.mechanics.kernels._compile import entry, inlined, kernel
from bellcrank.mechanics.kernels.arrays import (
    ACTIVE,
    CONVERGED,
    MECHANISM,
    UNCONVERGED,
    UNVERIFIED,
    Bytes,
    Floats,
    Reference,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.branch import is_reached_from_rest
from bellcrank.mechanics.kernels.energy import beam_rotation, elastic_energy
from bellcrank.mechanics.kernels.fields import clear, copy, pair
from bellcrank.mechanics.kernels.loading import follow_path, place_hanging_pieces
from bellcrank.mechanics.kernels.newton import add_tension_at, clear_tension, newton
from bellcrank.mechanics.kernels.structure import build_structure
from bellcrank.mechanics.kernels.tangents import LONGEST_STEP, move_held_nodes


@kernel
def output_motion(system: System, u: Floats) -> float:
    """Return the sum over output nodes of |u| (2 cos(gamma/2)^n - 1).

    Here gamma is the angle of u to the wanted direction. For n = 2 this is the projection
    t_out . u (Bonfanti et al. 2020, eqs. 1 and 2).
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
    """Return the sum over input nodes of t_in . u."""
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
    """Return the efficiency at displacement `u`."""
    denominator = system.denominator
    if math.isnan(denominator):
        denominator = system.denominator_scale * input_motion(system, u)
    return system.numerator_scale * output_motion(system, u) / denominator


@kernel
def rotation_at(system: System, reference: Reference, node: int) -> float:
    """Return the rotation of some beam at a node in the reference equilibrium."""
    for slot in range(system.incident_start[node], system.incident_start[node + 1]):
        beam = system.incident_beam[slot]
        if reference.present[beam]:
            return beam_rotation(system, reference.u, beam)
    return 0.0


@kernel
def extend_reference(
    system: System, reference: Reference, structure: Structure, u: Floats, scratch: Scratch
) -> None:
    """Fill `u` with the reference displacement, extended to nodes that were loose there.

    Such a node takes the displacement of its parent, and its offset from the parent is rotated
    with the parent.
    """
    rotation = scratch.vectors.rotation
    for node in range(len(u)):
        active = structure.active[node] == ACTIVE
        for axis in range(2):
            u[node, axis] = reference.u[node, axis] if active else 0.0
    move_held_nodes(system, 1.0, u)
    for index in range(structure.sizes[0]):
        node = structure.order[index]
        parent = structure.parent[node]
        if reference.active[node] == ACTIVE or parent < 0 or system.block[node] < 0:
            continue
        if reference.active[parent] == ACTIVE:
            angle = rotation_at(system, reference, parent)
        else:
            angle = rotation[parent]
        rotation[node] = angle
        x = system.positions[node, 0] - system.positions[parent, 0]
        y = system.positions[node, 1] - system.positions[parent, 1]
        u[node, 0] = u[parent, 0] + x * (math.cos(angle) - 1.0) - y * math.sin(angle)
        u[node, 1] = u[parent, 1] + x * math.sin(angle) + y * (math.cos(angle) - 1.0)
    move_held_nodes(system, 1.0, u)


@kernel
def set_reference(structure: Structure, u: Floats, reference: Reference) -> None:
    """Make an equilibrium the reference."""
    copy(u, reference.u)
    for beam in range(len(reference.present)):
        reference.present[beam] = structure.present[beam]
    for node in range(len(reference.active)):
        reference.active[node] = structure.active[node]


@kernel
def equals_reference(system: System, structure: Structure, reference: Reference) -> bool:
    """Whether the drive moves the same beams as in the reference, and no others."""
    for beam in range(len(structure.present)):
        node = system.beams[beam, 0]
        now = structure.present[beam] and structure.active[node] != 0
        before = reference.present[beam] and reference.active[node] != 0
        if now != before:
            return False
    return True


@inlined
def find_response(
    system: System,
    mask: Bytes,
    core: int,
    reference: Reference,
    warm_start: bool,
    lower_bound: float,
    largest_increment: float,
    structure: Structure,
    u: Floats,
    scratch: Scratch,
) -> tuple[int, float]:
    """Fill `structure` and the displacement `u` of the design `mask`; return status, efficiency.

    With `warm_start`, start from the reference equilibrium. If no moving beam differs from the
    reference, that is the equilibrium. Another one must be verified to be the one reached from
    rest; otherwise the design is loaded from rest. An equilibrium that is no more efficient than
    `lower_bound` is not verified, and UNVERIFIED. With a bound, no design is loaded from rest: most
    that would be snap. The status is then UNVERIFIED too, or UNCONVERGED.
    """
    clear(u, len(u))
    status = build_structure(system, mask, core, structure)
    if status == MECHANISM:
        return status, math.nan
    if warm_start and equals_reference(system, structure, reference):
        copy(reference.u, u)
        return CONVERGED, efficiency_of(system, u)
    status = UNCONVERGED
    guess = scratch.vectors.guess
    if warm_start:
        extend_reference(system, reference, structure, u, scratch)
        copy(u, guess)
        clear_tension(scratch)
        add_tension_at(system, structure, reference.u, 1.0, scratch)
        for beam in range(len(mask)):
            if not reference.present[beam]:
                scratch.tension[beam] = 0.0
        status = newton(system, structure, 1.0, u, scratch, system.tolerance, LONGEST_STEP)
        if status == CONVERGED and efficiency_of(system, u) <= lower_bound:
            return UNVERIFIED, efficiency_of(system, u)
        if status != CONVERGED and lower_bound > -math.inf:
            return status, math.nan
    if status != CONVERGED or not is_reached_from_rest(system, structure, guess, u, scratch):
        if warm_start and lower_bound > -math.inf:
            return UNVERIFIED, efficiency_of(system, u)
        status = follow_path(system, structure, u, scratch, largest_increment)
    place_hanging_pieces(system, structure, u)
    return status, efficiency_of(system, u)


@entry
def respond(
    system: System,
    mask: Bytes,
    core: int,
    reference: Reference,
    warm_start: bool,
    lower_bound: float,
    largest_increment: float,
    structure: Structure,
    u: Floats,
    scratch: Scratch,
) -> tuple[int, float, float]:
    """As `find_response`, for calls from Python; returns the elastic energy too."""
    status, efficiency = find_response(
        system, mask, core, reference, warm_start, lower_bound, largest_increment,
        structure, u, scratch,
    )  # fmt: skip
    energy = math.nan
    if status != MECHANISM:
        energy = elastic_energy(system, structure, u, scratch)
    return status, efficiency, energy
