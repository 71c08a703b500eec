"""First-order minimisers: the paper's non-linear conjugate gradient, and FIRE.

Both use the gradient alone and nothing of the stiffness, so that they check
Newton independently. They stop at a largest force, not at a step.
"""

from __future__ import annotations

import math

from bellcrank.mechanics.kernels._compile import kernel
from bellcrank.mechanics.kernels.arrays import (
    CONVERGED,
    UNCONVERGED,
    Floats,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.energy import find_gradient, measure_held_beams
from bellcrank.mechanics.kernels.fields import clear, copy, dot, largest_component, move

MOST_EVALUATIONS = 2_000_000


@kernel
def conjugate_gradient(
    system: System,
    structure: Structure,
    fraction: float,
    u: Floats,
    scratch: Scratch,
    force_tolerance: float,
) -> int:
    """Polak-Ribiere conjugate gradient with a secant line search.

    The step along each direction comes from the change of slope between two
    gradients, as for a quadratic energy, and is repeated until the slope has
    fallen to a tenth. Directions restart when the slope does not descend.
    """
    measure_held_beams(system, structure, u, scratch)
    gradient, direction, previous = scratch.gradient, scratch.vectors[0], scratch.vectors[1]
    clear(direction, len(u))
    clear(previous, len(u))
    previous_square = 0.0
    probe = 1e-2
    find_gradient(system, structure, fraction, u, scratch)
    evaluations = 1
    while evaluations < MOST_EVALUATIONS:
        if largest_component(scratch.gradient) <= force_tolerance:
            return CONVERGED
        square = dot(gradient, gradient)
        beta = 0.0
        if previous_square > 0.0:
            beta = max(0.0, (square - dot(gradient, previous)) / previous_square)
        for node in range(len(u)):
            for axis in range(2):
                direction[node, axis] = beta * direction[node, axis] - gradient[node, axis]
        slope = dot(gradient, direction)
        if slope >= 0.0:
            for node in range(len(u)):
                for axis in range(2):
                    direction[node, axis] = -gradient[node, axis]
            slope = -square
        copy(gradient, previous)
        previous_square = square
        longest = 0.2 / math.sqrt(dot(direction, direction))
        length = min(probe, longest)
        start_slope = slope
        for _ in range(8):
            move(u, length, direction)
            find_gradient(system, structure, fraction, u, scratch)
            evaluations += 1
            new_slope = dot(gradient, direction)
            if abs(new_slope) <= 0.1 * abs(start_slope):
                break
            curvature = (new_slope - slope) / length
            slope = new_slope
            if curvature > 0.0:
                probe = abs(start_slope) / curvature
                length = max(-longest, min(-new_slope / curvature, longest))
            else:
                length = longest if new_slope < 0.0 else -0.5 * length
    return UNCONVERGED


@kernel
def fire(
    system: System,
    structure: Structure,
    fraction: float,
    u: Floats,
    scratch: Scratch,
    force_tolerance: float,
) -> int:
    """Fast inertial relaxation engine.

    References
    ----------
    Bitzek, Koskinen, Gaehler, Moseler, Gumbsch, "Structural relaxation made
    simple", Phys. Rev. Lett. 97, 170201 (2006); their parameters, unit mass.
    """
    measure_held_beams(system, structure, u, scratch)
    gradient, velocity = scratch.gradient, scratch.vectors[0]
    clear(velocity, len(u))
    mixing, uphill_free = 0.1, 0
    time_step = 0.1 / math.sqrt(system.bond)
    longest_time_step = 4.0 * time_step
    for _ in range(MOST_EVALUATIONS):
        find_gradient(system, structure, fraction, u, scratch)
        if largest_component(scratch.gradient) <= force_tolerance:
            return CONVERGED
        power = -dot(gradient, velocity)
        if power > 0.0:
            speed = math.sqrt(dot(velocity, velocity) / dot(gradient, gradient))
            for node in range(len(u)):
                for axis in range(2):
                    velocity[node, axis] = (1.0 - mixing) * velocity[
                        node, axis
                    ] - mixing * speed * gradient[node, axis]
            uphill_free += 1
            if uphill_free > 5:
                time_step = min(1.1 * time_step, longest_time_step)
                mixing *= 0.99
        else:
            clear(velocity, len(u))
            uphill_free = 0
            time_step *= 0.5
            mixing = 0.1
        move(velocity, -time_step, gradient)
        move(u, time_step, velocity)
    return UNCONVERGED
