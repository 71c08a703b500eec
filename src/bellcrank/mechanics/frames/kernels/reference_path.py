"""Whether the path of a design is next to that of a reference design, without following it.

An equilibrium found from that of a similar design counts if equilibria at the quarters of the load,
and at the softest state, lie next to those of that design, whose path was followed. Otherwise the
path is followed from rest: an equilibrium on another branch would pass on to all designs that
follow.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.mechanics.frames.kernels.arrays import FULL, KNOTS, SOFTEST, State
from bellcrank.mechanics.frames.kernels.assembly import (
    add_tension_at,
    clear_tension,
    stiffness_is_definite,
)
from bellcrank.mechanics.frames.kernels.newton import newton
from bellcrank.mechanics.frames.kernels.path import (
    DIP,
    FEW_SWEEPS,
    LARGEST_DEPARTURE,
    LONGEST_STEP,
    departure_at,
    find_tangent,
    lowest_stiffness,
)
from bellcrank.mechanics.frames.kernels.state import (
    copy_state,
    difference,
    knot_state,
    move_held_nodes,
    set_to_rest,
)
from bellcrank.mechanics.frames.kernels.structure import place_followers
from bellcrank.mechanics.kernels._compile import kernel
from bellcrank.mechanics.kernels.arrays import CONVERGED
from bellcrank.mechanics.kernels.fields import copy

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
LEAST_MARGIN = 0.35
"""Lowest stiffness along the path of a reference, as a part of its values at both ends, below which
the paths of designs next to it are followed."""
CLEAR_MARGIN = 0.95
"""The same above which the softest state is not checked."""
DEPARTURE_GROWTH = 1.25
"""Largest departure between two quarters of the load, as a multiple of that along the path that was
followed, where this is more than `LARGEST_DEPARTURE`."""
UNCLEAR_DEPARTURE = 0.6
"""Departure above which a jump between two quarters would not be noticed."""
KNOT_TOLERANCE = 1e-4
"""Displacement error of the states compared."""
CLEAR_DIP = 1.25
"""Lowest stiffness next to the softest state of a reference, as a multiple of that at which a
design counts as snapping, below which its path is followed."""


@kernel
def follows_reference(  # noqa: PLR0911 - one test after the other
    frame: Frame,
    mask: Bytes,
    structure: Structure,
    reference: Reference,
    state: State,
    memory: Memory,
) -> bool:
    """Whether an equilibrium at full load is on a stable path next to that of the reference.

    The path of the reference was followed from rest, and its states at the quarters of the load and
    its softest state are known. True if the design has equilibria near all of them, is not much
    softer there than a design whose path was followed, and its motion between them follows from the
    tangents. The current factor must be that of `state`. The states found are left in
    `memory.knots`.
    """
    if not reference.has_knots[0] or reference.margin[0] < LEAST_MARGIN:
        return False
    if not is_near(frame, structure, reference, FULL, reference.state, state, memory):
        return False
    find_tangent(frame, structure, state, memory.knot_tangent[KNOTS + 1], memory)
    for index in range(KNOTS):
        fraction = (index + 1) / (KNOTS + 1.0)
        if not follow_knot(frame, mask, structure, reference, index, fraction, memory):
            return False
        u, q = knot_state(frame, memory.knots, index)
        find_tangent(frame, structure, State(u, q), memory.knot_tangent[index + 1], memory)
    memory.softest_load[0] = reference.softest_load[0]
    if reference.margin[0] < CLEAR_MARGIN and not follow_knot(
        frame, mask, structure, reference, SOFTEST, reference.softest_load[0], memory
    ):
        return False
    rest = memory.previous
    set_to_rest(rest)
    if not stiffness_is_definite(frame, structure, 0.0, rest, memory):
        return False
    find_tangent(frame, structure, rest, memory.knot_tangent[0], memory)
    for index in range(KNOTS + 1):
        allowed = max(LARGEST_DEPARTURE, DEPARTURE_GROWTH * reference.departure[index])
        found = departure_at(frame, structure, index, state, memory)
        if allowed > UNCLEAR_DEPARTURE or found > allowed:
            return False
    return True


@kernel
def follow_knot(
    frame: Frame,
    mask: Bytes,
    structure: Structure,
    reference: Reference,
    knot: int,
    fraction: float,
    memory: Memory,
) -> bool:
    """Find the equilibrium next to a state of the reference; whether there is one.

    It is left in `memory.knots`, and its factor is the current one.
    """
    u, q = knot_state(frame, reference.knots, knot)
    v, r = knot_state(frame, memory.knots, knot)
    before, here = State(u, q), State(v, r)
    copy_state(before, here)
    place_new_nodes(frame, mask, structure, reference, here, memory)
    move_held_nodes(frame, fraction, here)
    clear_tension(memory)
    add_tension_at(frame, structure, before, 1.0, memory)
    for beam in range(len(memory.tension)):
        if not reference.present[beam]:
            memory.tension[beam] = 0.0
    status = newton(frame, structure, fraction, here, memory, KNOT_TOLERANCE, LONGEST_STEP)
    if status != CONVERGED:
        return False
    return is_near(frame, structure, reference, knot, before, here, memory)


@kernel
def is_near(
    frame: Frame,
    structure: Structure,
    reference: Reference,
    knot: int,
    before: State,
    here: State,
    memory: Memory,
) -> bool:
    """Whether a state is near one of the reference, and not much softer; the factor is its own."""
    difference(before, here, memory.difference)
    jump = largest_motion(structure, reference, memory.difference)
    set_to_rest(memory.previous)
    difference(memory.previous, here, memory.difference)
    if jump > max(JUMP, RELATIVE_JUMP * largest_motion(structure, reference, memory.difference)):
        return False
    copy(reference.mode[knot], memory.knot_mode[knot])
    lowest = lowest_stiffness(frame, structure, memory.knot_mode[knot], FEW_SWEEPS, memory)
    least = (
        LEAST_KEPT if knot != SOFTEST else max(LEAST_KEPT, CLEAR_DIP * DIP / reference.margin[0])
    )
    return lowest > least * reference.stiffness[knot]


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
