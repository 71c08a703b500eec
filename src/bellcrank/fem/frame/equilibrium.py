"""Forces and stiffness of a whole frame in a state."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.fem.frame import elements
from bellcrank.fem.frame.system import dofs_of

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.sparse import csc_matrix

    from bellcrank.fem.frame.system import FrameSystem


def inner_forces(
    system: FrameSystem, displacement: NDArray[np.float64]
) -> tuple[NDArray[np.float64], csc_matrix, float]:
    """Return (n, 3) the forces that hold a state, their derivative, and their magnitude.

    The derivative is by the free degrees of freedom only; the magnitude is the largest force
    within any element, against which a residual is small or not.
    """
    mesh = system.mesh
    force, tangent = elements.forces_and_stiffness(mesh, displacement)
    total = gathered(system, force, displacement)
    entries = np.concatenate([tangent.ravel(), system.springs.ravel()])
    return total, system.assembly.matrix(entries), float(np.abs(force[:, [0, 1, 3, 4]]).max())


def linear_forces(
    system: FrameSystem, displacement: NDArray[np.float64]
) -> tuple[NDArray[np.float64], csc_matrix]:
    """Return the same for small motions."""
    mesh = system.mesh
    tangent = elements.linear_stiffness(mesh)
    ends = displacement[mesh.elements].reshape(-1, 6)
    force = np.einsum("eij,ej->ei", tangent, ends)
    entries = np.concatenate([tangent.ravel(), system.springs.ravel()])
    return gathered(system, force, displacement), system.assembly.matrix(entries)


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
