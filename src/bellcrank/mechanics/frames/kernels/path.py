"""The path of equilibria from rest to full load, which defines the response of a design.

A path is followed in increments of the load that end at stable equilibria connected to the one
before: the tangents at both ends account for the movement between them, and the lowest stiffness
changes so little that no loss of stability in between is missed.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.mechanics.frames.kernels.arrays import POINTS, State
from bellcrank.mechanics.frames.kernels.assembly import (
    set_right_side,
    solve_step,
    spread_step,
    stiffness_is_definite,
)
from bellcrank.mechanics.frames.kernels.load_rate import find_load_rate
from bellcrank.mechanics.frames.kernels.newton import newton
from bellcrank.mechanics.frames.kernels.state import (
    copy_state,
    difference,
    drive_rate,
    is_kink,
    move,
    move_held_nodes,
    point_state,
    set_to_rest,
)
from bellcrank.mechanics.frames.kernels.tension import (
    begin_tension,
    extrapolate_tension,
    keep_tension,
)
from bellcrank.mechanics.kernels._compile import inlined, kernel
from bellcrank.mechanics.kernels.arrays import CONVERGED, SNAPPED, UNCONVERGED
from bellcrank.mechanics.kernels.fields import copy, copy_row

if TYPE_CHECKING:
    from bellcrank.mechanics.frames.kernels.arrays import Frame, Memory, Structure
    from bellcrank.mechanics.kernels.arrays import Floats

QUARTERS = 4
"""Increments end at the multiples of this part of the load, among others."""
LARGEST_INCREMENT = 0.5
"""Largest increment of the load between two points that count as connected."""
FINE_INCREMENT = 1.0 / 128.0
SMALLEST_INCREMENT = 1.0 / 256.0
"""Increment at which a path counts as lost; smaller in proportion in a fine verification."""
FINE_VERIFICATION = 1.0 / 32.0
REMAINDER = 1e-9
"""Part of an increment that is not left as an increment of its own."""
LARGEST_DEPARTURE = 0.2
"""Departure of an increment from the mean of the tangents at its ends, as a part of the movement,
above which the path bends too much to be followed, or jumps."""
SMALL_MOVEMENT = 1e-4
"""Movement in an increment, in lattice units, below which a departure may be an error of the
equilibria."""
LARGEST_SOFTENING = 0.5
"""Ratio of the lowest stiffness at the ends of an increment, in either direction, below which
smaller increments are needed, down to `FINE_INCREMENT`."""
SOFT = 0.6
SOFTENING_WHERE_SOFT = 0.7
"""The same where the lowest stiffness is below the part `SOFT` of that at rest, so that the depth
of a minimum is resolved."""
DOUBTFUL = 0.05
"""Departure above which a tangent is computed with the stiffness at its own state."""
FEW_SWEEPS = 1
"""Number of steps of inverse iteration from a mode that is nearly known."""
DIP = 0.2
"""Lowest stiffness on the path, as a part of its values at rest and at full load, below which a
design counts as snapping."""
PATH_TOLERANCE = 1e-6
"""Displacement error of equilibria between rest and full load."""
LONGEST_STEP = 0.5
SWEEPS = 2
"""Number of steps of inverse iteration in each estimate of the lowest stiffness."""


@kernel
def find_tangent(
    frame: Frame,
    structure: Structure,
    state: State,
    within: float,
    tangent: Floats,
    memory: Memory,
) -> None:
    """Compute the motion of an equilibrium per unit of load; the factor must be that of it.

    `within` is a load on the side of the tangent, up to the next kink.
    """
    find_load_rate(frame, structure, state, within, tangent, memory)
    set_right_side(frame, structure, tangent, -1.0, memory)
    solve_step(structure, frame, memory)
    spread_step(frame, tangent, memory)
    for node in range(len(tangent)):
        speed = drive_rate(frame, node, within)
        for axis in range(len(frame.unit)):
            if frame.held[node, axis]:
                tangent[node, axis] = speed * frame.drive[node, axis]


@kernel
def product(a: Floats, b: Floats) -> float:
    """Return the inner product of two fields."""
    total = 0.0
    for node in range(len(a)):
        for axis in range(a.shape[1]):
            total += a[node, axis] * b[node, axis]
    return total


@kernel
def lowest_stiffness(
    frame: Frame, structure: Structure, mode: Floats, sweeps: int, memory: Memory
) -> float:
    """Estimate the lowest eigenvalue of the factorised stiffness by inverse iteration.

    `mode` holds the current approximation of the eigenvector and is improved. Without free
    unknowns the result is 1.
    """
    lowest = math.inf
    for _ in range(sweeps):
        size = math.sqrt(product(mode, mode))
        if size == 0.0:
            return 1.0
        set_right_side(frame, structure, mode, 1.0 / size, memory)
        solve_step(structure, frame, memory)
        spread_step(frame, mode, memory)
        lowest = 1.0 / math.sqrt(product(mode, mode))
    return lowest


@kernel
def departure_of(
    frame: Frame,
    structure: Structure,
    motion: Floats,
    first: Floats,
    last: Floats,
    increment: float,
) -> float:
    """Return the departure of a motion from the mean of the tangents at its two ends.

    As a part of the movement, which is at least `SMALL_MOVEMENT` where inputs rest for a part of
    the load. On a smooth path it is of third order in the increment; a jump to another branch is in
    neither tangent.
    """
    departure = movement = 0.0
    for index in range(structure.sizes[0]):
        node = structure.order[index]
        for axis in range(motion.shape[1]):
            mean = 0.5 * increment * (first[node, axis] + last[node, axis])
            departure = max(departure, abs(motion[node, axis] - mean))
            movement = max(movement, abs(motion[node, axis]))
    return departure / max(movement, SMALL_MOVEMENT if frame.has_ramps else 1e-300)


@kernel
def is_fine(increment: float) -> bool:
    """Whether an increment is fine enough, one with a remainder included."""
    return increment <= (1.0 + 2.0 * REMAINDER) * FINE_INCREMENT


@kernel
def is_joined(
    departure: float, before: float, after: float, softening: float, increment: float
) -> bool:
    """Whether two equilibria an increment of load apart are on one path.

    Parameters
    ----------
    before, after
        Lowest stiffness at both.
    softening
        Least ratio of the two.
    """
    followed = after > softening * before and before > softening * after
    return departure <= LARGEST_DEPARTURE and (followed or is_fine(increment))


@inlined
def next_increment(
    increment: float, departure: float, before: float, after: float, softening: float
) -> float:
    """Return the increment that brings departure and softening well within their limits."""
    by_departure = (0.5 * LARGEST_DEPARTURE / max(departure, 1e-9)) ** (1.0 / 3.0)
    change = abs(math.log(max(after, 1e-9 * before) / before))
    by_softening = -0.8 * math.log(softening) / max(change, 1e-9)
    followed = max(FINE_INCREMENT, increment * max(0.25, by_softening))
    return min(increment * min(2.0, max(0.25, by_departure)), followed)


@inlined
def extrapolate(state: State, increment: float, last_increment: float, memory: Memory) -> None:
    """Advance a state along the path to second order.

    The curvature of the path is the difference of the tangents here and one increment ago.
    """
    tangent, before, motion = memory.tangent, memory.last_tangent, memory.difference
    bend = 0.5 * increment * increment / last_increment
    for node in range(len(motion)):
        for axis in range(motion.shape[1]):
            curve = tangent[node, axis] - before[node, axis]
            motion[node, axis] = increment * tangent[node, axis] + bend * curve
    move(state, 1.0, motion)


@kernel
def departure_to(
    frame: Frame, structure: Structure, increment: float, end: float, state: State, memory: Memory
) -> float:
    """Compute the tangent at the end of an increment; return the departure of the increment."""
    find_tangent(frame, structure, state, end - 0.5 * increment, memory.next_tangent, memory)
    difference(memory.previous, state, memory.difference)
    return departure_of(
        frame, structure, memory.difference, memory.tangent, memory.next_tangent, increment
    )


@kernel
def next_end(frame: Frame, fraction: float, quarter: int) -> float:
    """Return where increments from a load on end: at the next quarter of the load or kink."""
    target = quarter / QUARTERS
    for kink in frame.kinks:
        if fraction < kink < target:
            return float(kink)
    return target


@kernel
def begin_anew(
    frame: Frame, structure: Structure, load: float, end: float, state: State, memory: Memory
) -> float:
    """Begin the path at a kink, without the states before it.

    The tangent and the change of the axial forces become those up to `end`. Returns the next
    increment; 0 if the state is unstable.
    """
    if not stiffness_is_definite(frame, structure, load, state, memory):
        return 0.0
    find_tangent(frame, structure, state, 0.5 * (load + end), memory.tangent, memory)
    copy(memory.tangent, memory.last_tangent)
    begin_tension(frame, structure, memory)
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        memory.path_tension[0, beam] = memory.tension[beam]
    return LARGEST_INCREMENT


@inlined
def correct(
    frame: Frame,
    structure: Structure,
    increment: float,
    end: float,
    soft: float,
    state: State,
    memory: Memory,
) -> tuple[float, float]:
    """Bring an extrapolated state to the equilibrium at the end of an increment.

    Returns the lowest stiffness there, and the departure of the increment from the tangents at
    both ends; 0 and infinity if there is no stable equilibrium. Below the lowest stiffness `soft`,
    stability is judged with the stiffness of the equilibrium.
    """
    move_held_nodes(frame, end, state)
    extrapolate_tension(structure, increment, memory)
    tolerance = frame.tolerance if end == 1.0 else PATH_TOLERANCE
    now, departure = 0.0, math.inf
    if newton(frame, structure, end, state, memory, tolerance, LONGEST_STEP) == CONVERGED:
        now = lowest_stiffness(frame, structure, memory.mode, SWEEPS, memory)
        departure = departure_to(frame, structure, increment, end, state, memory)
        # The factor is that of a state some steps before. Slender beams may turn by too much from
        # there for an accurate tangent, and near a loss of stability the tensions decide.
        if departure > DOUBTFUL or now < soft:
            if not stiffness_is_definite(frame, structure, end, state, memory):
                return 0.0, math.inf
            now = lowest_stiffness(frame, structure, memory.mode, FEW_SWEEPS, memory)
            departure = departure_to(frame, structure, increment, end, state, memory)
    return now, departure


@kernel
def keep_point(frame: Frame, load: float, stiffness: float, state: State, memory: Memory) -> None:
    """Store a state of the path, its lowest stiffness, and the softest motion.

    Every second state gives way when there are too many.
    """
    if memory.count[0] == POINTS:
        for index in range(POINTS // 2):
            memory.load[index] = memory.load[2 * index + 1]
            copy_row(memory.point_tension[2 * index + 1], memory.point_tension[index])
            u, q = point_state(frame, memory.points, 2 * index + 1)
            v, r = point_state(frame, memory.points, index)
            copy_state(State(u, q), State(v, r))
        memory.count[0] = POINTS // 2
        memory.count[1] = 1
    index = memory.count[0]
    memory.load[index] = load
    u, q = point_state(frame, memory.points, index)
    copy_state(state, State(u, q))
    copy_row(memory.tension, memory.point_tension[index])
    memory.count[0] += 1
    keep_mode(memory.count[0], stiffness, memory)


@kernel
def keep_mode(index: int, stiffness: float, memory: Memory) -> None:
    """Store the lowest stiffness and the softest motion of a state."""
    memory.point_stiffness[index] = stiffness
    copy(memory.mode, memory.point_mode[index])


@kernel
def follow_path(
    frame: Frame, structure: Structure, state: State, memory: Memory, largest: float
) -> int:
    """Load from rest in increments that stay on one stable path.

    An increment is accepted only if it ends at a stable equilibrium that is connected to the one
    before; otherwise it is shortened. Where an input starts or stops, the path has a kink, at which
    an increment ends. SNAPPED means that even the smallest increment fails: the
    state is then the last stable one; or that the stiffness falls so low that a small imperfection
    is enough to snap.

    Parameters
    ----------
    largest
        Upper bound on the increment (1 for none); small for a fine verification.
    """
    previous, mode = memory.previous, memory.mode
    set_to_rest(state)
    for node in range(len(mode)):
        for axis in range(mode.shape[1]):
            mode[node, axis] = math.cos(1.0 + 3.0 * node + axis)
    if not stiffness_is_definite(frame, structure, 0.0, state, memory):
        return UNCONVERGED
    at_rest = softest = stiffness = lowest_stiffness(frame, structure, mode, 4 * SWEEPS, memory)
    find_tangent(frame, structure, state, 0.5 * next_end(frame, 0.0, 1), memory.tangent, memory)
    copy(memory.tangent, memory.last_tangent)
    begin_tension(frame, structure, memory)
    memory.count[0] = memory.count[1] = 0
    keep_mode(0, stiffness, memory)
    fraction, quarter = 0.0, 1
    increment = last_increment = min(LARGEST_INCREMENT, largest)
    smallest = SMALLEST_INCREMENT * (0.25 if largest <= FINE_VERIFICATION else 1.0)
    while fraction < 1.0 and increment >= smallest:
        # Equal increments lead to the next quarter of the load, or kink.
        target = next_end(frame, fraction, quarter)
        parts = math.ceil((target - fraction) / increment - REMAINDER)
        end = target if parts <= 1 else fraction + (target - fraction) / parts
        wanted, increment = increment, end - fraction
        copy_state(state, previous)
        extrapolate(state, increment, last_increment, memory)
        soft = SOFT * at_rest
        now, departure = correct(frame, structure, increment, end, soft, state, memory)
        softening = SOFTENING_WHERE_SOFT if min(stiffness, now) < soft else LARGEST_SOFTENING
        following = next_increment(increment, departure, stiffness, now, softening)
        if is_joined(departure, stiffness, now, softening, increment):
            fraction, stiffness, last_increment = end, now, increment
            copy(memory.tangent, memory.last_tangent)
            copy(memory.next_tangent, memory.tangent)
            keep_tension(structure, increment, memory)
            softest = min(softest, now)
            if end == quarter / QUARTERS:
                quarter += 1
            if end < 1.0:
                keep_point(frame, end, now, state, memory)
            else:
                copy_row(memory.tension, memory.point_tension[POINTS])
                keep_mode(memory.count[0] + 1, now, memory)
            if frame.has_ramps and end == target:
                # A short remainder does not shorten the increment after it.
                following = max(following, wanted)
                if is_kink(frame, end):
                    target = next_end(frame, end, quarter)
                    following = begin_anew(frame, structure, end, target, state, memory)
            increment = min(following, LARGEST_INCREMENT, largest)
        else:
            copy_state(previous, state)
            increment = following
    memory.reached_load[0] = fraction
    memory.reached_load[1] = softest / min(at_rest, stiffness)
    if fraction == 1.0 and memory.reached_load[1] > DIP:
        return CONVERGED
    return SNAPPED
