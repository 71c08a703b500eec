"""Co-rotational beam elements in the plane.

The local deformations of an element are its elongation and the rotations of its two ends relative
to its chord. Beams are linear in these three quantities, without shear (Euler-Bernoulli) or with it
(Timoshenko); the only nonlinearity is their dependence on the displacements of the ends. All
functions work on all elements at once.

References
----------
M. A. Crisfield, Non-linear finite element analysis of solids and structures, vol. 1, 1991, ch. 7.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.fem.frame.mesh import FrameMesh


def wrapped(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return angles between -pi and pi.

    Examples
    --------
    >>> wrapped(np.array([0.5, 2 * np.pi + 0.5])).round(12)
    array([0.5, 0.5])
    """
    turned: NDArray[np.float64] = np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi
    return turned


def natural(
    mesh: FrameMesh, displacement: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the local deformations of the elements, with their chords.

    Parameters
    ----------
    mesh
        Elements.
    displacement : (n, 3) float64
        Displacements of the nodes in x and y, mm, and their rotations, rad.

    Returns
    -------
    strain : (e, 3) float64
        Elongation, mm, and rotations of the first and the second end, rad.
    direction : (e, 2) float64
        Unit vectors along the chords.
    length : (e,) float64
        Lengths of the chords, mm.
    """
    first, second = mesh.elements.T
    apart = displacement[second, :2] - displacement[first, :2]
    chord = mesh.chord + apart
    length = np.hypot(chord[:, 0], chord[:, 1])
    direction = chord / length[:, None]
    turned = np.arctan2(
        mesh.chord[:, 0] * chord[:, 1] - mesh.chord[:, 1] * chord[:, 0],
        (mesh.chord * chord).sum(axis=1),
    )
    strain = np.empty((len(length), 3))
    # From the difference of squares, because that of the lengths loses digits to rounding.
    strain[:, 0] = ((mesh.chord + chord) * apart).sum(axis=1) / (length + mesh.length)
    strain[:, 1] = wrapped(displacement[first, 2] - turned)
    strain[:, 2] = wrapped(displacement[second, 2] - turned)
    return strain, direction, length


def strain_of(
    mesh: FrameMesh, displacement: NDArray[np.float64], *, linear: bool
) -> NDArray[np.float64]:
    """Return (e, 3) the local deformations, to first order in the displacements if `linear`."""
    if not linear:
        return natural(mesh, displacement)[0]
    direction = mesh.chord / mesh.length[:, None]
    gradient, _, _ = gradient_of_natural(direction, mesh.length)
    ends = displacement[mesh.elements].reshape(-1, 6)
    strain: NDArray[np.float64] = np.einsum("eij,ej->ei", gradient, ends)
    return strain


def gradient_of_natural(
    direction: NDArray[np.float64], length: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return (e, 3, 6) derivatives of the local deformations by the end displacements.

    The second and third results, both (e, 6), are Crisfield's r, the derivative of the elongation,
    and z, that of the rotation of the chord multiplied by its length.
    """
    count = len(length)
    along = np.zeros((count, 6))
    along[:, 3:5] = direction
    along[:, 0:2] = -direction
    across = np.zeros((count, 6))
    across[:, 0], across[:, 1] = direction[:, 1], -direction[:, 0]
    across[:, 3], across[:, 4] = -direction[:, 1], direction[:, 0]
    gradient = np.empty((count, 3, 6))
    gradient[:, 0] = along
    gradient[:, 1] = gradient[:, 2] = -across / length[:, None]
    gradient[:, 1, 2] += 1.0
    gradient[:, 2, 5] += 1.0
    return gradient, along, across


def forces(mesh: FrameMesh, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (e, 6) the internal forces at the ends of the elements."""
    strain, direction, length = natural(mesh, displacement)
    gradient, _, _ = gradient_of_natural(direction, length)
    force: NDArray[np.float64] = np.einsum("eji,ejk,ek->ei", gradient, mesh.stiffness, strain)
    return force


def forces_and_stiffness(
    mesh: FrameMesh, displacement: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (e, 6) the internal forces and (e, 6, 6) the tangent stiffness of the elements."""
    strain, direction, length = natural(mesh, displacement)
    gradient, along, across = gradient_of_natural(direction, length)
    stress = np.einsum("eij,ej->ei", mesh.stiffness, strain)
    force = np.einsum("eji,ej->ei", gradient, stress)
    tangent = np.matmul(gradient.transpose(0, 2, 1), np.matmul(mesh.stiffness, gradient))
    normal, bending = stress[:, 0], stress[:, 1] + stress[:, 2]
    tangent += (normal / length)[:, None, None] * (across[:, :, None] * across[:, None, :])
    mixed = along[:, :, None] * across[:, None, :]
    tangent += (bending / length**2)[:, None, None] * (mixed + mixed.transpose(0, 2, 1))
    return force, tangent


def linear_stiffness(mesh: FrameMesh) -> NDArray[np.float64]:
    """Return (e, 6, 6) the stiffness of the elements at rest."""
    direction = mesh.chord / mesh.length[:, None]
    gradient, _, _ = gradient_of_natural(direction, mesh.length)
    stiffness: NDArray[np.float64] = np.matmul(
        gradient.transpose(0, 2, 1), np.matmul(mesh.stiffness, gradient)
    )
    return stiffness


def energy(
    mesh: FrameMesh, displacement: NDArray[np.float64], *, linear: bool = False
) -> NDArray[np.float64]:
    """Return (e,) the elastic energy of the elements, N mm."""
    strain = strain_of(mesh, displacement, linear=linear)
    stored: NDArray[np.float64] = 0.5 * np.einsum("ei,eij,ej->e", strain, mesh.stiffness, strain)
    return stored
