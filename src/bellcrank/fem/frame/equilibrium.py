"""Forces and stiffness of a whole frame in a state, and the equations of its equilibrium."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.fem.frame import elements
from bellcrank.fem.frame.system import SparseFactor, dofs_of
from bellcrank.fem.path import Linearised, State

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.sparse import csc_matrix

    from bellcrank.fem.frame.system import FrameSystem

TOLERANCE = 1e-10
"""Residual, as a part of the largest force within an element."""
ROUNDING = 100.0 * float(np.finfo(float).eps)
DIFFERENCE = 1e-7
"""Part of the input by which it is moved to see what that does."""


@dataclass(frozen=True, slots=True, eq=False)
class FrameState:
    """An equilibrium of a frame.

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
class FrameEquations:
    """Equilibrium of a frame that moves far; the unknowns are its free degrees of freedom."""

    system: FrameSystem

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return len(self.system.free)

    def displacement(self, unknowns: NDArray[np.float64], load: float) -> NDArray[np.float64]:
        """Return (n, 3) the displacement of all nodes."""
        whole = load * self.system.motion
        whole.ravel()[self.system.free] = unknowns
        return whole

    def linearise(self, unknowns: NDArray[np.float64], load: float) -> Linearised:
        """Return the equations near a state."""
        system = self.system
        displacement = self.displacement(unknowns, load)
        force, matrix, magnitude = inner_forces(system, displacement)
        residual = (force - load * system.load).ravel()[system.free]
        return Linearised(residual, allowed(system, displacement, magnitude), SparseFactor(matrix))

    def pull(self, unknowns: NDArray[np.float64], load: float) -> NDArray[np.float64]:
        """Return (f,) the derivative of the residual by the load."""
        system = self.system
        here = self.displacement(unknowns, load)
        given = here + DIFFERENCE * system.motion
        change = (forces(system, given) - forces(system, here)) / DIFFERENCE - system.load
        return change.ravel()[system.free]

    def distance(self, change: NDArray[np.float64]) -> float:
        """Return the norm of a change without its rotations, mm."""
        return float(np.linalg.norm(change[self.system.free % 3 < 2]))

    def complete(self, state: State) -> FrameState:
        """Return an equilibrium with all displacements and reactions."""
        displacement = self.displacement(state.unknowns, state.load)
        reaction = (forces(self.system, displacement) - state.load * self.system.load).ravel()
        reaction[self.system.free] = 0.0
        return FrameState(state.load, displacement, reaction.reshape(-1, 3), state.negative)


def inner_forces(
    system: FrameSystem, displacement: NDArray[np.float64]
) -> tuple[NDArray[np.float64], csc_matrix, float]:
    """Return (n, 3) the forces that hold a state, their derivative, and their magnitude.

    The derivative is by the free degrees of freedom only; the magnitude is the largest force
    within any element, against which a residual is small or not.
    """
    force, tangent = elements.forces_and_stiffness(system.mesh, displacement)
    total = gathered(system, force, displacement)
    entries = np.concatenate([tangent.ravel(), system.springs.ravel()])
    return total, system.assembly.matrix(entries), float(np.abs(force[:, [0, 1, 3, 4]]).max())


def forces(system: FrameSystem, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, 3) the forces that hold a state."""
    return gathered(system, elements.forces(system.mesh, displacement), displacement)


def potential(system: FrameSystem, load: float, displacement: NDArray[np.float64]) -> float:
    """Return elastic energy less the work of the loads, N mm."""
    moved = displacement[system.spring_nodes, :2]
    springs = 0.5 * np.einsum("si,sij,sj->", moved, system.springs, moved)
    work = load * float((system.load * displacement).sum())
    return float(elements.energy(system.mesh, displacement).sum() + springs - work)


def solve_linear(system: FrameSystem) -> FrameState:
    """Return the response to the full input of a frame that moves little.

    Raises
    ------
    RuntimeError
        If the stiffness is singular.
    """
    given = system.motion
    tangent = elements.linear_stiffness(system.mesh)

    def held(displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        ends = displacement[system.mesh.elements].reshape(-1, 6)
        return gathered(system, np.einsum("eij,ej->ei", tangent, ends), displacement)

    entries = np.concatenate([tangent.ravel(), system.springs.ravel()])
    factor = SparseFactor(system.assembly.matrix(entries))
    if not factor.firm:
        raise RuntimeError("singular")
    displacement = given.copy()
    right = (system.load - held(given)).ravel()[system.free]
    displacement.ravel()[system.free] = factor.solve(right)
    reaction = (held(displacement) - system.load).ravel()
    reaction[system.free] = 0.0
    return FrameState(1.0, displacement, reaction.reshape(-1, 3), factor.negative)


def allowed(
    system: FrameSystem, displacement: NDArray[np.float64], magnitude: float
) -> NDArray[np.float64]:
    """Return (f,) the residual that may be left: forces in N, moments in N mm.

    A small part of the forces at work, and what rounding makes of nothing: displacements are
    exact to a part of themselves, angles of chords to that part over their length and to a part
    of one. In slender struts the former is no small part of what bends them, in short elements
    and at short strokes the latter.
    """
    mesh = system.mesh
    moved = float(np.abs(displacement[:, :2]).max())
    stretching = moved * float(mesh.stiffness[:, 0, 0].max())
    bending = mesh.stiffness[:, 1, 1] / mesh.length * (1.0 + moved / mesh.length)
    force = TOLERANCE * magnitude + ROUNDING * (stretching + float(bending.max()))
    arm = np.where(system.free % 3 == 2, float(mesh.length.max()), 1.0)
    return force * arm


def gathered(
    system: FrameSystem, force: NDArray[np.float64], displacement: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Add up (n, 3) what elements and springs exert."""
    count = 3 * system.mesh.node_count
    ends = dofs_of(system.mesh.elements).ravel()
    total: NDArray[np.float64] = np.zeros((system.mesh.node_count, 3))
    total += np.bincount(ends, weights=force.ravel(), minlength=count).reshape(-1, 3)
    moved = displacement[system.spring_nodes, :2]
    np.add.at(total[:, :2], system.spring_nodes, np.einsum("sij,sj->si", system.springs, moved))
    return total
