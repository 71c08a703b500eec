"""Meshes of beam elements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.part.section import SHEAR_COEFFICIENT
from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.part.part import Part


@dataclass(frozen=True, slots=True, eq=False)
class FrameMesh:
    """Straight beam elements between nodes in the plane.

    Parameters
    ----------
    positions : (n, 2) float64
        Positions of the nodes at rest, mm: first the lattice nodes with struts, in order, then
        the nodes within struts.
    node : (N,) int64
        Mesh node of each lattice node, -1 for lattice nodes without struts.
    elements : (e, 2) int64
        End nodes of the elements, strut by strut.
    strut : (e,) int64
        Lattice beam of each element.
    chord : (e, 2) float64
        Vector from the first to the second end at rest, mm.
    length : (e,) float64
        Lengths of the elements at rest, mm.
    stiffness : (e, 3, 3) float64
        Matrices from elongation and end rotations to axial force, N, and end moments, N mm.
    """

    positions: NDArray[np.float64]
    node: NDArray[np.int64]
    elements: NDArray[np.int64]
    strut: NDArray[np.int64]
    chord: NDArray[np.float64]
    length: NDArray[np.float64]
    stiffness: NDArray[np.float64]

    @property
    def node_count(self) -> int:
        """Number of nodes."""
        return len(self.positions)

    def at_lattice(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (N, 2) the displacements of the lattice nodes, mm; 0 for nodes without struts."""
        moved = np.zeros((len(self.node), 2))
        present = self.node >= 0
        moved[present] = displacement[self.node[present], :2]
        return moved

    def lines(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return (s,) the lattice beams with struts, and (s, k) the mesh nodes along each."""
        struts, first = np.unique(self.strut, return_index=True)
        each = len(self.elements) // len(struts)
        chains = self.elements.reshape(len(struts), each, 2)
        along = np.concatenate([chains[:, :, 0], chains[:, -1:, 1]], axis=1)
        return self.strut[first], along


theories: Registry[Callable[[Part, NDArray[np.float64]], NDArray[np.float64]]] = Registry("theory")
"""Beam theories: functions of a part and the lengths (e,) of its elements that return the ratio of
shear to bending flexibility, 12 E I / (kappa G A L^2)."""


@theories.register("euler-bernoulli")
def euler_bernoulli(_part: Part, length: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return 0: cross-sections stay normal to the axis."""
    return np.zeros_like(length)


@theories.register("timoshenko")
def timoshenko(part: Part, length: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the ratio for cross-sections that stay plane but not normal to the axis."""
    bending = 12.0 * part.material.young * part.section.inertia
    ratio: NDArray[np.float64] = bending / (
        SHEAR_COEFFICIENT * part.material.shear * part.section.area * length**2
    )
    return ratio


def frame_mesh(part: Part, elements: int = 8, theory: str = "euler-bernoulli") -> FrameMesh:
    """Divide each strut of a part into elements of equal length.

    Parameters
    ----------
    part
        Part to be meshed.
    elements
        Number of elements of each strut.
    theory
        Name in the registry of theories.

    Raises
    ------
    InvalidSettings
        If the number of elements is not positive.
    UnknownName
        If there is no such theory.
    """
    if elements < 1:
        raise InvalidSettings(f"elements: expected at least 1 in each strut, got {elements}")
    shear = theories[theory]
    lattice = part.design.problem.lattice
    struts = np.flatnonzero(part.design.mask)
    ends = lattice.beams[struts]
    used = np.unique(ends)
    node = np.full(lattice.node_count, -1, dtype=np.int64)
    node[used] = np.arange(len(used))
    corners = lattice.positions[used] * part.scale
    first, second = corners[node[ends[:, 0]]], corners[node[ends[:, 1]]]
    part_of = np.arange(1, elements) / elements
    within = first[:, None] + part_of[None, :, None] * (second - first)[:, None]
    inner = len(used) + np.arange(len(struts) * (elements - 1)).reshape(len(struts), -1)
    along = np.column_stack([node[ends[:, 0]], inner, node[ends[:, 1]]])
    pairs = np.stack([along[:, :-1], along[:, 1:]], axis=-1).reshape(-1, 2)
    positions = np.concatenate([corners, within.reshape(-1, 2)])
    chord = positions[pairs[:, 1]] - positions[pairs[:, 0]]
    length = np.hypot(chord[:, 0], chord[:, 1])
    return FrameMesh(
        positions=positions,
        node=node,
        elements=pairs,
        strut=np.repeat(struts, elements),
        chord=chord,
        length=length,
        stiffness=natural_stiffness(part, length, shear(part, length)),
    )


def natural_stiffness(
    part: Part, length: NDArray[np.float64], shear: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (e, 3, 3) the stiffness against elongation and end rotations."""
    young, section = part.material.young, part.section
    bending = young * section.inertia / (length * (1.0 + shear))
    stiffness = np.zeros((len(length), 3, 3))
    stiffness[:, 0, 0] = young * section.area / length
    stiffness[:, 1, 1] = stiffness[:, 2, 2] = bending * (4.0 + shear)
    stiffness[:, 1, 2] = stiffness[:, 2, 1] = bending * (2.0 - shear)
    return stiffness
