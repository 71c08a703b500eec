"""Equilibrium equations of frames."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.fem.frame import elements
from bellcrank.fem.frame.system import SparseFactor, dofs_of
from bellcrank.fem.path import Linearisation, PathState

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.sparse import csc_matrix

    from bellcrank.fem.frame.system import FrameSystem

TOLERANCE = 1e-10
"""Admissible residual as a fraction of the largest force within an element."""
ROUNDING = 100.0 * float(np.finfo(float).eps)
DIFFERENCE = 1e-7
"""Step of the finite difference with respect to the load."""


@dataclass(frozen=True, slots=True, eq=False)
class FrameState:
    """An equilibrium of a frame.

    Parameters
    ----------
    load
        Fraction of the full input, 0 to 1.
    displacement : (n, 3) float64
        Displacements of the mesh nodes in x and y, mm, and their rotations, rad.
    reaction : (n, 3) float64
        Forces, N, and moments, N mm, on the held degrees of freedom; 0 on the free ones.
    """

    load: float
    displacement: NDArray[np.float64]
    reaction: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class FrameEquations:
    """Equilibrium of a frame with large displacements; unknowns are the free displacements."""

    system: FrameSystem

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return len(self.system.free)

    def displacement(self, unknowns: NDArray[np.float64], load: float) -> NDArray[np.float64]:
        """Return (n, 3) the displacements of all nodes."""
        whole = load * self.system.motion
        whole.ravel()[self.system.free] = unknowns
        return whole

    def linearise(self, unknowns: NDArray[np.float64], load: float) -> Linearisation:
        """Linearise the equations; raises RuntimeError if the stiffness is singular."""
        system = self.system
        displacement = self.displacement(unknowns, load)
        force, matrix, magnitude = forces_and_stiffness(system, displacement)
        residual = (force - load * system.load).ravel()[system.free]
        tolerance = residual_tolerance(system, displacement, magnitude)
        return Linearisation(residual, tolerance, SparseFactor(matrix))

    def load_derivative(self, unknowns: NDArray[np.float64], load: float) -> NDArray[np.float64]:
        """Return (f,) the derivative of the residual with respect to the load."""
        system = self.system
        here = self.displacement(unknowns, load)
        given = here + DIFFERENCE * system.motion
        change = (forces(system, given) - forces(system, here)) / DIFFERENCE - system.load
        return change.ravel()[system.free]

    def distance(self, change: NDArray[np.float64]) -> float:
        """Return the norm of a change of the displacements, without rotations, mm."""
        return float(np.linalg.norm(change[self.system.free % 3 < 2]))

    def complete(self, state: PathState) -> FrameState:
        """Return an equilibrium with the displacements and reactions of all nodes."""
        displacement = self.displacement(state.unknowns, state.load)
        reaction = (forces(self.system, displacement) - state.load * self.system.load).ravel()
        reaction[self.system.free] = 0.0
        return FrameState(state.load, displacement, reaction.reshape(-1, 3))


def forces_and_stiffness(
    system: FrameSystem, displacement: NDArray[np.float64]
) -> tuple[NDArray[np.float64], csc_matrix, float]:
    """Return (n, 3) the internal forces, the tangent stiffness and the largest element force.

    The stiffness is that of the free degrees of freedom. The residual is small or large compared
    with the largest force within any element.
    """
    force, tangent = elements.forces_and_stiffness(system.mesh, displacement)
    total = assembled(system, force, displacement)
    entries = np.concatenate([tangent.ravel(), system.springs.ravel()])
    return total, system.assembly.matrix(entries), float(np.abs(force[:, [0, 1, 3, 4]]).max())


def forces(system: FrameSystem, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, 3) the internal forces of elements and springs."""
    return assembled(system, elements.forces(system.mesh, displacement), displacement)


def solve_linear(system: FrameSystem) -> FrameState:
    """Return the response to the full input for small displacements.

    Raises
    ------
    RuntimeError
        If the stiffness is singular.
    """
    given = system.motion
    tangent = elements.linear_stiffness(system.mesh)

    def internal(displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        ends = displacement[system.mesh.elements].reshape(-1, 6)
        return assembled(system, np.einsum("eij,ej->ei", tangent, ends), displacement)

    entries = np.concatenate([tangent.ravel(), system.springs.ravel()])
    factor = SparseFactor(system.assembly.matrix(entries))
    if not factor.nonsingular:
        raise RuntimeError("singular")
    displacement = given.copy()
    right = (system.load - internal(given)).ravel()[system.free]
    displacement.ravel()[system.free] = factor.solve(right)
    reaction = (internal(displacement) - system.load).ravel()
    reaction[system.free] = 0.0
    return FrameState(1.0, displacement, reaction.reshape(-1, 3))


def residual_tolerance(
    system: FrameSystem, displacement: NDArray[np.float64], magnitude: float
) -> NDArray[np.float64]:
    """Return (f,) the admissible residual: forces in N, moments in N mm.

    It is a small fraction of the largest element force plus the error by rounding. Displacements
    have a relative rounding error, and angles of chords that error divided by the length and a
    constant one. The first matters in slender struts, the second in short elements and at short
    strokes.
    """
    mesh = system.mesh
    moved = float(np.abs(displacement[:, :2]).max())
    stretching = moved * float(mesh.stiffness[:, 0, 0].max())
    bending = mesh.stiffness[:, 1, 1] / mesh.length * (1.0 + moved / mesh.length)
    force = TOLERANCE * magnitude + ROUNDING * (stretching + float(bending.max()))
    arm = np.where(system.free % 3 == 2, float(mesh.length.max()), 1.0)
    return force * arm


def assembled(
    system: FrameSystem, force: NDArray[np.float64], displacement: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (n, 3) the sum of the forces of elements and springs at the nodes."""
    count = 3 * system.mesh.node_count
    ends = dofs_of(system.mesh.elements).ravel()
    total: NDArray[np.float64] = np.zeros((system.mesh.node_count, 3))
    total += np.bincount(ends, weights=force.ravel(), minlength=count).reshape(-1, 3)
    moved = displacement[system.spring_nodes, :2]
    np.add.at(total[:, :2], system.spring_nodes, np.einsum("sij,sj->si", system.springs, moved))
    return total
