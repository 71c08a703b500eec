"""Whether the path of a design is next to that of a reference design, without following it.

An equilibrium found from that of a similar design counts if equilibria lie next to those at which
the path of that design was followed. Otherwise the path is followed from rest: an equilibrium on
another branch would pass on to all designs that follow.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.mechanics.frames.kernels.arrays import POINTS, State
from bellcrank.mechanics.frames.kernels.assembly import stiffness_is_definite
from bellcrank.mechanics.frames.kernels.newton import newton
from bellcrank.mechanics.frames.kernels.path import (
    DIP,
    FEW_SWEEPS,
    LONGEST_STEP,
    departure_of,
    find_tangent,
    is_fine,
    lowest_stiffness,
)
from bellcrank.mechanics.frames.kernels.state import (
    copy_state,
    difference,
    is_kink,
    move,
    move_held_nodes,
    point_state,
    set_to_rest,
)
from bellcrank.mechanics.frames.kernels.structure import place_followers
from bellcrank.mechanics.kernels._compile import inlined, kernel
from bellcrank.mechanics.kernels.arrays import CONVERGED, SNAPPED, UNCONVERGED
from bellcrank.mechanics.kernels.fields import clear, copy, copy_row

if TYPE_CHECKING:
    from bellcrank.mechanics.frames.kernels.arrays import Frame, Memory, Reference, Structure
    from bellcrank.mechanics.kernels.arrays import Bytes, Floats

JUMP = 0.25
"""Largest motion (lattice units, radians) from a state of the reference of a design that counts as
next to it."""
RELATIVE_JUMP = 0.15
"""The same as a part of the largest motion from rest, where that is more."""
LEAST_KEPT = 0.5
"""Least lowest stiffness of such a design, as a part of that of the last design whose path was
followed."""
CLEAR_DIP = 0.25
"""Lowest stiffness along its path, as a part of its values at both ends, below which that path is
followed."""
CLEAR_KINK = 0.2
"""The same between its states, where it is estimated."""
DEPARTURE = 0.3
"""Largest departure between two successive states; along a path that is followed it is less."""
SOFTENING = 0.4
"""Least ratio of the lowest stiffness of two successive states, in either direction."""
POINT_TOLERANCE = 1e-4
"""Displacement error of the states compared."""


@kernel
def follow_reference(  # noqa: PLR0911 - one test after the other
    frame: Frame,
    mask: Bytes,
    structure: Structure,
    reference: Reference,
    state: State,
    memory: Memory,
) -> int:
    """Return whether an equilibrium at full load is on a stable path next to that of the reference.

    The path of the reference, or of a design before it, was followed from rest. CONVERGED if the
    design has equilibria near all its states, is not much softer there, and moves and softens
    between them as a path may. SNAPPED if one of these equilibria is as soft as that of a design
    that snaps (`path.DIP`). Otherwise UNCONVERGED: the path must be followed. The current factor
    must be that of `state`. The states found are left in `memory.points`.
    """
    if reference.count[1]:
        return UNCONVERGED
    last = reference.count[0] + 1
    memory.count[0], memory.count[1] = reference.count[0], 0
    copy_row(memory.tension, memory.point_tension[POINTS])
    if not is_near(frame, structure, reference, last, reference.state, state, memory):
        return UNCONVERGED
    begin_changes(structure, reference, memory)
    before = reference.load[last - 2] if last > 1 else 0.0
    find_tangent(frame, structure, state, 0.5 * (before + 1.0), memory.last_tangent, memory)
    rest = memory.previous
    set_to_rest(rest)
    if not stiffness_is_definite(frame, structure, 0.0, rest, memory):
        return UNCONVERGED
    find_softest(frame, structure, reference, 0, memory)
    following = reference.load[0] if last > 1 else 1.0
    find_tangent(frame, structure, rest, 0.5 * following, memory.tangent, memory)
    stiffness = memory.point_stiffness
    ends = min(stiffness[0], stiffness[last])
    before, softest = 0.0, ends
    for index in range(1, last + 1):
        load = 1.0
        if index < last:
            load = memory.load[index - 1] = reference.load[index - 1]
            predict_changes(structure, (load - before) / (1.0 - before), memory)
            stiffness[index] = math.inf
            near = follow_point(frame, mask, structure, reference, index, load, memory)
            if stiffness[index] <= DIP * ends:
                memory.reached_load[0], memory.reached_load[1] = 1.0, stiffness[index] / ends
                return SNAPPED
            if not near:
                return UNCONVERGED
        departure = departure_before(frame, structure, index, before, load, state, memory)
        first, second = stiffness[index - 1], stiffness[index]
        followed = second > SOFTENING * first and first > SOFTENING * second
        if departure > DEPARTURE or not (followed or is_fine(load - before)):
            return UNCONVERGED
        softest = min(softest, second)
        copy(memory.next_tangent, memory.tangent)
        if is_kink(frame, load):
            following = reference.load[index] if index + 1 < last else 1.0
            turn_tangent(frame, structure, index, 0.5 * (load + following), memory)
        before = load
    clear = softest >= CLEAR_DIP * ends and lowest_between(frame, memory) > CLEAR_KINK * ends
    return CONVERGED if clear else UNCONVERGED


@kernel
def turn_tangent(
    frame: Frame, structure: Structure, index: int, within: float, memory: Memory
) -> None:
    """Compute the tangent at a state beyond its kink; the current factor must be its own."""
    u, q = point_state(frame, memory.points, index - 1)
    find_tangent(frame, structure, State(u, q), within, memory.tangent, memory)


@kernel
def lowest_between(frame: Frame, memory: Memory) -> float:
    """Estimate the lowest stiffness between the states in `memory.points`.

    In each interval, the straight lines through the two states before and the two after it are
    extrapolated to where they meet. At rest, at full load and at kinks, both are equally steep.
    """
    value, load, last = memory.point_stiffness, memory.load, memory.count[0]
    lowest = math.inf
    for index in range(last + 1):
        left = load[index - 1] if index > 0 else 0.0
        right = load[index] if index < last else 1.0
        falling, rising = -math.inf, math.inf
        begins = index == 0 or is_kink(frame, left)
        ends = index == last or is_kink(frame, right)
        if not begins:
            falling = (value[index] - value[index - 1]) / (
                left - (load[index - 2] if index > 1 else 0.0)
            )
        if not ends:
            rising = (value[index + 2] - value[index + 1]) / (
                (load[index + 1] if index + 1 < last else 1.0) - right
            )
        if begins:
            falling = -rising
        if ends:
            rising = -falling
        if falling < 0.0 < rising < math.inf:
            gap = value[index + 1] - rising * (right - left) - value[index]
            part = min(right - left, max(0.0, gap / (falling - rising)))
            lowest = min(lowest, value[index] + falling * part)
    return lowest


@kernel
def departure_before(
    frame: Frame,
    structure: Structure,
    index: int,
    before: float,
    load: float,
    state: State,
    memory: Memory,
) -> float:
    """Return the departure from the state before; computes the tangent in `memory.next_tangent`.

    `before` and `load` are the loads of both, and `state` is that at full load. The current factor
    must be that of the state otherwise.
    """
    start = memory.previous
    set_to_rest(start)
    if index > 1:
        u, q = point_state(frame, memory.points, index - 2)
        copy_state(State(u, q), start)
    if index > memory.count[0]:
        difference(start, state, memory.difference)
        copy(memory.last_tangent, memory.next_tangent)
    else:
        u, q = point_state(frame, memory.points, index - 1)
        here = State(u, q)
        difference(start, here, memory.difference)
        find_tangent(frame, structure, here, 0.5 * (before + load), memory.next_tangent, memory)
    return departure_of(
        frame, structure, memory.difference, memory.tangent, memory.next_tangent, load - before
    )


@kernel
def follow_point(
    frame: Frame,
    mask: Bytes,
    structure: Structure,
    reference: Reference,
    index: int,
    load: float,
    memory: Memory,
) -> bool:
    """Find the equilibrium next to a state of the path of the reference; whether there is one.

    It is left in `memory.points`, and its factor is the current one.
    """
    u, q = point_state(frame, reference.points, index - 1)
    v, r = point_state(frame, memory.points, index - 1)
    before, here = State(u, q), State(v, r)
    copy_state(before, here)
    move(here, 1.0, memory.change)
    place_new_nodes(frame, mask, structure, reference, here, memory)
    move_held_nodes(frame, load, here)
    for order in range(structure.sizes[1]):
        beam = structure.beam[order]
        known = known_tension(reference, index - 1, beam)
        memory.tension[beam] = known + memory.tension_change[0, beam]
    status = newton(frame, structure, load, here, memory, POINT_TOLERANCE, LONGEST_STEP)
    if status != CONVERGED:
        return False
    copy_row(memory.tension, memory.point_tension[index - 1])
    find_changes(structure, reference, index - 1, memory)
    return is_near(frame, structure, reference, index, before, here, memory)


@inlined
def known_tension(reference: Reference, point: int, beam: int) -> float:
    """Return the axial force of a beam in a state of the reference; 0 if it carries no load."""
    return reference.tension[point, beam] if reference.present[beam] else 0.0


@kernel
def find_changes(structure: Structure, reference: Reference, point: int, memory: Memory) -> None:
    """Compute how far the axial forces in `memory.tension` differ from those of the reference."""
    for order in range(structure.sizes[1]):
        beam = structure.beam[order]
        known = known_tension(reference, point, beam)
        memory.tension_change[0, beam] = memory.tension[beam] - known


@kernel
def begin_changes(structure: Structure, reference: Reference, memory: Memory) -> None:
    """Store the changes at full load; those at rest are zero."""
    find_changes(structure, reference, POINTS, memory)
    copy_row(memory.tension_change[0], memory.tension_change[1])
    copy(memory.change, memory.full_change)
    clear(memory.tension_change, 1)
    clear(memory.change, len(memory.change))


@kernel
def predict_changes(structure: Structure, part: float, memory: Memory) -> None:
    """Interpolate the changes: advance them by a part of the way to those at full load."""
    change, full = memory.change, memory.full_change
    for node in range(len(change)):
        for axis in range(change.shape[1]):
            change[node, axis] += part * (full[node, axis] - change[node, axis])
    for order in range(structure.sizes[1]):
        beam = structure.beam[order]
        now, last = memory.tension_change[0, beam], memory.tension_change[1, beam]
        memory.tension_change[0, beam] = now + part * (last - now)


@kernel
def is_near(
    frame: Frame,
    structure: Structure,
    reference: Reference,
    index: int,
    before: State,
    here: State,
    memory: Memory,
) -> bool:
    """Whether a state is near one of the reference, and not much softer; the factor is its own.

    `memory.change` becomes the motion between both, of the nodes that move in both designs.
    """
    difference(before, here, memory.change)
    for node in range(len(memory.change)):
        if not (reference.active[node] and structure.active[node]):
            for axis in range(memory.change.shape[1]):
                memory.change[node, axis] = 0.0
    jump = largest_motion(structure, reference, memory.change)
    set_to_rest(memory.previous)
    difference(memory.previous, here, memory.difference)
    if jump > max(JUMP, RELATIVE_JUMP * largest_motion(structure, reference, memory.difference)):
        return False
    lowest = find_softest(frame, structure, reference, index, memory)
    return lowest > LEAST_KEPT * reference.stiffness[index]


@kernel
def find_softest(
    frame: Frame, structure: Structure, reference: Reference, index: int, memory: Memory
) -> float:
    """Store the softest motion of a state, whose factor is current; return its stiffness."""
    copy(reference.mode[index], memory.point_mode[index])
    lowest = lowest_stiffness(frame, structure, memory.point_mode[index], FEW_SWEEPS, memory)
    memory.point_stiffness[index] = lowest
    return lowest


@kernel
def largest_motion(structure: Structure, reference: Reference, motion: Floats) -> float:
    """Return the largest component of a motion of nodes that move now and in the reference."""
    largest = 0.0
    for index in range(structure.sizes[0]):
        node = structure.order[index]
        if reference.active[node]:
            for axis in range(motion.shape[1]):
                largest = max(largest, abs(motion[node, axis]))
    return largest


@kernel
def place_new_nodes(
    frame: Frame,
    mask: Bytes,
    structure: Structure,
    reference: Reference,
    state: State,
    memory: Memory,
) -> None:
    """Place nodes that move now and were loose in the reference; they follow their neighbours."""
    complete = True
    for node in range(len(memory.reached)):
        memory.reached[node] = reference.active[node]
        complete &= not structure.active[node] or reference.active[node] != 0
    if not complete:
        place_followers(frame, mask, state, memory)
