"""Response of a design, from rest or from the equilibrium of a reference design."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.mechanics.frames.kernels.arrays import (
    KEPT_PATH,
    NEXT_PATH,
    NO_PATH,
    OWN_PATH,
    POINTS,
)
from bellcrank.mechanics.frames.kernels.assembly import (
    elastic_energy,
    find_residual,
    set_right_side,
    solve_step,
    spread_step,
    stiffness_is_definite,
)
from bellcrank.mechanics.frames.kernels.beams import dimension
from bellcrank.mechanics.frames.kernels.newton import newton
from bellcrank.mechanics.frames.kernels.path import LONGEST_STEP, follow_path, lowest_stiffness
from bellcrank.mechanics.frames.kernels.reference_path import (
    follow_reference,
    known_tension,
    place_new_nodes,
)
from bellcrank.mechanics.frames.kernels.state import (
    copy_state,
    move_held_nodes,
    set_to_rest,
)
from bellcrank.mechanics.frames.kernels.structure import (
    build_structure,
    equals_reference,
    place_rest,
    set_reference,
)
from bellcrank.mechanics.kernels._compile import entry, inlined, kernel
from bellcrank.mechanics.kernels.arrays import CONVERGED, MECHANISM, UNCONVERGED, UNVERIFIED

if TYPE_CHECKING:
    from bellcrank.mechanics.frames.kernels.arrays import Frame, Memory, Reference, State, Structure
    from bellcrank.mechanics.kernels.arrays import Bytes, Floats


@kernel
def output_motion(frame: Frame, u: Floats) -> float:
    """Return the sum over output nodes of |u| (2 cos(gamma/2)^n - 1).

    Here gamma is the angle of u to the wanted direction. For n = 2 this is the projection
    t_out . u (Bonfanti et al. 2020, eqs. 1 and 2).
    """
    total = 0.0
    for index in range(len(frame.output_nodes)):
        node = frame.output_nodes[index]
        along = square = 0.0
        for axis in range(dimension(frame)):
            along += u[node, axis] * frame.output_direction[index, axis]
            square += u[node, axis] ** 2
        if frame.exponent == 2.0:
            total += along
        elif square > 0.0:
            size = math.sqrt(square)
            half = max(0.0, 0.5 * (1.0 + along / size))
            total += size * (2.0 * half ** (0.5 * frame.exponent) - 1.0)
    return total


@kernel
def input_motion(frame: Frame, u: Floats) -> float:
    """Return the sum over input nodes of t_in . u."""
    total = 0.0
    for index in range(len(frame.input_nodes)):
        node = frame.input_nodes[index]
        for axis in range(dimension(frame)):
            total += u[node, axis] * frame.input_direction[index, axis]
    return total


@kernel
def efficiency_of(frame: Frame, u: Floats) -> float:
    """Return the efficiency of a displacement."""
    denominator = frame.denominator
    if math.isnan(denominator):
        denominator = frame.denominator_scale * input_motion(frame, u)
    return frame.numerator_scale * output_motion(frame, u) / denominator


@kernel
def add_efficiency_gradient(frame: Frame, u: Floats, gradient: Floats) -> None:
    """Add the derivative of the efficiency by the unknowns of each node."""
    denominator = frame.denominator
    if math.isnan(denominator):
        denominator = frame.denominator_scale * input_motion(frame, u)
        share = efficiency_of(frame, u) * frame.denominator_scale / denominator
        for index in range(len(frame.input_nodes)):
            node = frame.input_nodes[index]
            for axis in range(dimension(frame)):
                gradient[node, axis] -= share * frame.input_direction[index, axis]
    scale = frame.numerator_scale / denominator
    power = 0.5 * frame.exponent
    for index in range(len(frame.output_nodes)):
        node = frame.output_nodes[index]
        along = square = 0.0
        for axis in range(dimension(frame)):
            along += u[node, axis] * frame.output_direction[index, axis]
            square += u[node, axis] ** 2
        size = math.sqrt(square)
        for axis in range(dimension(frame)):
            wanted = frame.output_direction[index, axis]
            slope = wanted
            if frame.exponent != 2.0 and size > 0.0:
                cosine = along / size
                half = max(0.0, 0.5 * (1.0 + cosine))
                direction = u[node, axis] / size
                slope = direction * (2.0 * half**power - 1.0)
                slope += power * half ** (power - 1.0) * (wanted - cosine * direction)
            gradient[node, axis] += scale * slope


@inlined
def find_response(
    frame: Frame,
    mask: Bytes,
    reference: Reference,
    warm_start: bool,
    lower_bound: float,
    largest_increment: float,
    structure: Structure,
    state: State,
    memory: Memory,
) -> tuple[int, float]:
    """Fill `structure` and the state of the design `mask`; return status and efficiency.

    With `warm_start`, start from the reference equilibrium. If no beam that carries load differs
    from the reference, that is the equilibrium. Another one must be on a path next to that of the
    reference; otherwise the design is loaded from rest. An equilibrium that is no more efficient
    than `lower_bound` is not verified, and UNVERIFIED. With a bound, a design that Newton's method
    does not reach from the reference is UNCONVERGED, without a path from rest: of 444 such flips
    in a search, one was better than its reference. Where the path is lost, the state is the last
    stable one, and the efficiency nan.
    """
    status = build_structure(frame, mask, structure, memory)
    memory.path[0] = NO_PATH
    if status == MECHANISM:
        set_to_rest(state)
        return status, math.nan
    if warm_start and equals_reference(frame, structure, reference):
        memory.path[0] = KEPT_PATH
        copy_state(reference.state, state)
        place_rest(frame, mask, structure, 1.0, state, memory)
        return CONVERGED, efficiency_of(frame, state.u)
    status = UNCONVERGED
    if warm_start:
        copy_state(reference.state, state)
        place_new_nodes(frame, mask, structure, reference, state, memory)
        move_held_nodes(frame, 1.0, state)
        for beam in range(len(mask)):
            memory.tension[beam] = known_tension(reference, POINTS, beam)
        status = newton(frame, structure, 1.0, state, memory, frame.tolerance, LONGEST_STEP)
        if status == CONVERGED and efficiency_of(frame, state.u) <= lower_bound:
            place_rest(frame, mask, structure, 1.0, state, memory)
            return UNVERIFIED, efficiency_of(frame, state.u)
        if status != CONVERGED and lower_bound > -math.inf:
            return status, math.nan
    if status == CONVERGED:
        status = follow_reference(frame, mask, structure, reference, state, memory)
        memory.path[0] = NEXT_PATH if status == CONVERGED else NO_PATH
    if status == UNCONVERGED:
        status = follow_path(frame, structure, state, memory, largest_increment)
        memory.path[0] = OWN_PATH if status == CONVERGED else NO_PATH
    reached = 1.0 if memory.path[0] else memory.reached_load[0]
    place_rest(frame, mask, structure, reached, state, memory)
    return status, efficiency_of(frame, state.u) if reached == 1.0 else math.nan


@entry
def respond(
    frame: Frame,
    mask: Bytes,
    reference: Reference,
    warm_start: bool,
    lower_bound: float,
    largest_increment: float,
    structure: Structure,
    state: State,
    memory: Memory,
) -> tuple[int, float, float]:
    """As `find_response`, for calls from Python; returns the elastic energy too."""
    status, efficiency = find_response(
        frame, mask, reference, warm_start, lower_bound, largest_increment, structure, state,
        memory,
    )  # fmt: skip
    energy = math.nan
    if status != MECHANISM:
        energy = elastic_energy(frame, structure, state, memory)
    return status, efficiency, energy


@entry
def keep_reference(
    frame: Frame, structure: Structure, state: State, memory: Memory, reference: Reference
) -> None:
    """As `set_reference`, for calls from Python."""
    set_reference(frame, structure, state, memory, reference)


@entry
def find_reactions(
    frame: Frame, structure: Structure, fraction: float, state: State, memory: Memory
) -> None:
    """Compute in `memory.gradient` the forces on held unknowns, and the residual of the others."""
    find_residual(frame, structure, fraction, state, memory)


@entry
def find_softest_mode(
    frame: Frame,
    structure: Structure,
    fraction: float,
    state: State,
    sweeps: int,
    mode: Floats,
    memory: Memory,
) -> float:
    """Return the lowest stiffness at a state and improve its mode (N, b); -1 if unstable."""
    if not stiffness_is_definite(frame, structure, fraction, state, memory):
        return -1.0
    return lowest_stiffness(frame, structure, mode, sweeps, memory)


@entry
def solve_fields(
    frame: Frame,
    structure: Structure,
    fraction: float,
    state: State,
    fields: Floats,
    memory: Memory,
) -> bool:
    """Replace fields (k, N, b) by K^-1 times them, at a state; False if it is unstable."""
    if not stiffness_is_definite(frame, structure, fraction, state, memory):
        return False
    for index in range(len(fields)):
        set_right_side(frame, structure, fields[index], 1.0, memory)
        solve_step(structure, frame, memory)
        spread_step(frame, fields[index], memory)
    return True
