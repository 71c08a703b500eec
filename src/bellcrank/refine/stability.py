"""The softest states of a path, near which it may lose its stability."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics.frames.quantities.forces import LOWEST_STIFFNESS

if TYPE_CHECKING:
    from bellcrank.mechanics.frames.equilibria import Equilibrium
    from bellcrank.mechanics.frames.evaluator import FrameEvaluator
    from bellcrank.mechanics.frames.quantities import Measures

STABLE_STATES = 32
"""States along the stroke at which the lowest stiffness is computed first."""
HALVINGS = 2
"""Number of times the distance of states about the softest one is halved."""


def softest_states(
    frame: FrameEvaluator,
) -> dict[float, tuple[Equilibrium, Measures]] | None:
    """Return states along the stroke with their lowest stiffness; None if one is not found.

    At equal fractions, and closer to each other about the softest one, since the lowest stiffness
    falls and rises steeply near a bifurcation.
    """
    found: dict[float, tuple[Equilibrium, Measures]] = {}

    def at(fraction: float) -> float:
        if fraction not in found:
            state = frame.end if fraction == 1.0 else frame.equilibrium(fraction)
            if state is None:
                return np.nan
            found[fraction] = (state, LOWEST_STIFFNESS.measure(state))
        return float(found[fraction][1].value[0])

    values = {k / STABLE_STATES: at(k / STABLE_STATES) for k in range(1, STABLE_STATES + 1)}
    if not all(value > 0.0 for value in values.values()):
        return None
    step = 1.0 / STABLE_STATES
    for _ in range(HALVINGS):
        step *= 0.5
        lowest = min(values, key=values.__getitem__)
        nearby = [each for each in (lowest - step, lowest + step) if 0.0 < each <= 1.0]
        neighbours = {each: at(each) for each in nearby}
        if not all(value > 0.0 for value in neighbours.values()):
            return None
        values |= neighbours
    return found
