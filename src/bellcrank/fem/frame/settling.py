"""Where a frame comes to rest after it has lost its stability.

At a limit point or a bifurcation the part jumps. Quasi-statically it ends in some stable
equilibrium of lower energy; which one is a matter of inertia and friction. Here it slides down
the energy: where some direction is unstable, along it as long as the energy falls; elsewhere by
Newton's method, shortened until the energy falls.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import diags

from bellcrank.fem.frame.equilibrium import allowed, inner_forces, potential
from bellcrank.fem.frame.system import SparseFactor
from bellcrank.fem.path import State, softest_mode

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.sparse import csc_matrix

    from bellcrank.fem.frame.equilibrium import FrameEquations
    from bellcrank.fem.frame.system import FrameSystem

STEPS = 400
FIRST_SHIFT = 1e-3
LARGEST_SHIFT = 1e6
SHORTEST = 1e-6
DESCENT = 1e-4
"""Part of the predicted fall of the energy that a step must reach (Armijo)."""
NUDGE = 1e-3
"""First try along an unstable direction, as a part of the largest motion."""
DOUBLINGS = 30
BEYOND = 2e-3
"""Part of the input by which a frame is pushed over the edge of its stability."""


@dataclass(slots=True, eq=False)
class _Slide:
    """A frame on its way down."""

    system: FrameSystem
    load: float
    displacement: NDArray[np.float64]

    @property
    def energy(self) -> float:
        return potential(self.system, self.load, self.displacement)

    def moved(self, change: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
        """Return where a change of the free degrees of freedom leads, and its energy."""
        trial = self.displacement.copy()
        trial.ravel()[self.system.free] += change
        return trial, potential(self.system, self.load, trial)

    def fall(self, mode: NDArray[np.float64]) -> bool:
        """Follow a direction as long as the energy falls; False if it does not."""
        energy = self.energy
        size = NUDGE * max(float(np.abs(self.displacement[:, :2]).max()), 1.0)
        step = size * mode / np.abs(mode).max()
        best = None
        for _ in range(DOUBLINGS):
            trial, there = self.moved(step)
            if there >= energy:
                break
            best, energy, step = trial, there, 2.0 * step
        if best is None:
            return False
        self.displacement = best
        return True

    def descend(self, change: NDArray[np.float64], slope: float) -> None:
        """Take a step against the residual, shortened until the energy falls as it should."""
        energy, part = self.energy, 1.0
        while part > SHORTEST:
            trial, there = self.moved(-part * change)
            if there <= energy - DESCENT * part * slope + 1e-14 * abs(energy):
                break
            part /= 2.0
        self.displacement = trial


def settle(equations: FrameEquations, edge: State) -> State | None:
    """Return the stable equilibrium that a frame slides to; None if it finds none.

    Parameters
    ----------
    edge
        The last stable state before stability was lost.
    """
    system = equations.system
    load = min(1.0, edge.load + BEYOND)
    slide = _Slide(system, load, equations.displacement(edge.unknowns, load))
    for _ in range(STEPS):
        force, matrix, magnitude = inner_forces(system, slide.displacement)
        residual = (force - load * system.load).ravel()[system.free]
        small = allowed(system, slide.displacement, magnitude)
        factor = SparseFactor(matrix)
        if (np.abs(residual) <= small).all() and not factor.negative:
            return State(load, slide.displacement.ravel()[system.free])
        if factor.negative:
            mode = softest_mode(factor, equations.count)[1]
            if slide.fall(mode if residual @ mode <= 0.0 else -mode):
                continue
            factor = stiffened(matrix)
        change = factor.solve(residual)
        slide.descend(change, float(residual @ change))
    return None


def stiffened(matrix: csc_matrix) -> SparseFactor:
    """Return a positive factor: with so much of the diagonal added as is needed."""
    diagonal = diags(np.abs(matrix.diagonal()), format="csc")
    shift = FIRST_SHIFT
    while shift < LARGEST_SHIFT:
        factor = SparseFactor((matrix + shift * diagonal).tocsc())
        if not factor.negative:
            break
        shift *= 4.0
    return factor
