"""Along the stroke: equilibria of a frame from rest to the full input.

A step begins with a tangent predictor and ends with Newton's method. It is made smaller where
the corrector is far from the predictor, so that the path is not left for another one, and where
stability is lost, so that the load at which it is lost is known.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.fem.frame.equilibrium import inner_forces, linear_forces
from bellcrank.fem.frame.system import Factor

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.fem.frame.system import FrameSystem

TOLERANCE = 1e-10
"""Residual, as a part of the largest force within an element."""
ITERATIONS = 12
FIRST_STEP = 1.0 / 16.0
LARGEST_STEP = 1.0 / 8.0
SMALLEST_STEP = 1e-4
LARGEST_DEPARTURE = 0.5
"""Of the corrector from the predictor, as a part of the predicted motion."""
DIFFERENCE = 1e-7
"""Part of the input by which it is moved to see what that does."""
SOFTEST = 1e-12
"""Least pivot, as a part of the largest, of a stiffness that holds everything in place."""
EASY = 4
"""Iterations up to which the next step is larger."""


class PathStatus(StrEnum):
    """How far a path goes."""

    CONVERGED = "converged"
    SNAPPED = "snapped"
    UNCONVERGED = "unconverged"
    MECHANISM = "mechanism"


@dataclass(frozen=True, slots=True, eq=False)
class FrameState:
    """An equilibrium.

    Parameters
    ----------
    load
        Part of the full input, 0 to 1.
    displacement : (n, 3)
        Of the mesh's nodes: x, y in mm, rotation in radians.
    reaction : (n, 3)
        Forces (N) and moments (N mm) on the held degrees of freedom, 0 on the others.
    negative
        Eigenvalues below 0 of its stiffness; stable if there are none.
    """

    load: float
    displacement: NDArray[np.float64]
    reaction: NDArray[np.float64]
    negative: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class FramePath:
    """Equilibria from rest on.

    Parameters
    ----------
    states
        In order of the load, all stable.
    status
        Whether the last one bears the full input, and if not, why.
    factorisations
        What it cost.
    """

    states: list[FrameState]
    status: PathStatus
    factorisations: int


@dataclass(slots=True, eq=False)
class Follower:
    """Follows the path of a system."""

    system: FrameSystem
    factorisations: int = 0

    def at_rest(self) -> FrameState:
        """Return the state without load."""
        still = np.zeros((self.system.mesh.node_count, 3))
        return FrameState(0.0, still, still)

    def tangent(self, state: FrameState) -> tuple[Factor, NDArray[np.float64]]:
        """Return the factor at a state, and (n, 3) its motion for all of the load at once."""
        system = self.system
        given = state.displacement + DIFFERENCE * system.motion
        force, matrix, _ = inner_forces(system, state.displacement)
        factor = self._factor(matrix)
        # What the given motion does to the free forces, without a matrix for it.
        moved, _, _ = inner_forces(system, given)
        right = system.load - (moved - force) / DIFFERENCE
        rate = system.motion.copy()
        rate.ravel()[system.free] = factor.solve(right.ravel()[system.free])
        return factor, rate

    def correct(self, load: float, guess: NDArray[np.float64]) -> tuple[FrameState, int] | None:
        """Return the equilibrium by Newton's method and the iterations; None if it finds none."""
        system, free = self.system, self.system.free
        displacement = guess.copy()
        for iteration in range(ITERATIONS):
            force, matrix, magnitude = inner_forces(system, displacement)
            residual = (force - load * system.load).ravel()
            worst = float(np.abs(residual[free]).max(initial=0.0))
            if not np.isfinite(worst):
                return None
            factor = self._factor(matrix)
            change = factor.solve(residual[free])
            displacement.ravel()[free] -= change
            if worst <= TOLERANCE * magnitude + rounding(system, displacement):
                reaction = residual.copy()
                reaction[free] = 0.0
                return FrameState(
                    load, displacement, reaction.reshape(-1, 3), factor.negative
                ), iteration
        return None

    def _factor(self, matrix: object) -> Factor:
        self.factorisations += 1
        return Factor(matrix)  # type: ignore[arg-type]


def rounding(system: FrameSystem, displacement: NDArray[np.float64]) -> float:
    """Return the force that rounding the displacements makes in the stiffest element.

    In slender struts it is no small part of what bends them.
    """
    stiffest = float(system.mesh.stiffness[:, 0, 0].max())
    largest = float(np.abs(displacement[:, :2]).max())
    return 100.0 * float(np.finfo(float).eps) * stiffest * largest


def follow(system: FrameSystem, largest_step: float = LARGEST_STEP) -> FramePath:
    """Follow the path of a frame from rest to its full input, as far as it is stable.

    Parameters
    ----------
    largest_step
        Part of the input that a step may take.
    """
    follower = Follower(system)
    states = [follower.at_rest()]
    try:
        factor, rate = follower.tangent(states[0])
    except RuntimeError:
        return FramePath(states, PathStatus.MECHANISM, follower.factorisations)
    if factor.pivots.min() < SOFTEST * factor.pivots.max():
        return FramePath(states, PathStatus.MECHANISM, follower.factorisations)
    step = min(FIRST_STEP, largest_step)
    unstable = False
    while states[-1].load < 1.0:
        here = states[-1]
        load = min(1.0, here.load + step)
        step = load - here.load
        ahead = step * rate
        found = follower.correct(load, here.displacement + ahead)
        # An unstable equilibrium ahead tells that the path ends where stability is lost, even if
        # Newton's method finds nothing at all closer to it.
        unstable |= found is not None and found[0].negative > 0
        if found is None or found[0].negative or strays(found[0], here, ahead):
            step /= 2.0
            if step < SMALLEST_STEP:
                status = PathStatus.SNAPPED if unstable else PathStatus.UNCONVERGED
                return FramePath(states, status, follower.factorisations)
            continue
        states.append(found[0])
        step = min(largest_step, step * 2.0) if found[1] <= EASY else step
        if found[0].load < 1.0:
            _, rate = follower.tangent(found[0])
    return FramePath(states, PathStatus.CONVERGED, follower.factorisations)


def strays(state: FrameState, here: FrameState, ahead: NDArray[np.float64]) -> bool:
    """Whether an equilibrium is so far from where it was expected that it may be another path's."""
    departure = np.linalg.norm((state.displacement - here.displacement - ahead)[:, :2])
    return bool(departure > LARGEST_DEPARTURE * np.linalg.norm(ahead[:, :2]))


def solve_linear(system: FrameSystem) -> FrameState:
    """Return the response to the full input of a frame that moves little."""
    given = system.motion
    force, matrix = linear_forces(system, given)
    factor = Factor(matrix)
    displacement = given.copy()
    right = (system.load - force).ravel()[system.free]
    displacement.ravel()[system.free] = factor.solve(right)
    force, _ = linear_forces(system, displacement)
    reaction = (force - system.load).ravel()
    reaction[system.free] = 0.0
    return FrameState(1.0, displacement, reaction.reshape(-1, 3), factor.negative)
