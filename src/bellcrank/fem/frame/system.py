"""Frames with their supports and loads: sparse systems of equations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.sparse import csc_matrix

    from bellcrank.fem.frame.mesh import FrameMesh
    from bellcrank.part.part import Part


SMALLEST_PIVOT = 1e-12
"""Smallest pivot of a nonsingular stiffness that is scaled to a diagonal of ones."""


class SparseFactor:
    """Factorisation of a symmetric sparse matrix with its number of negative eigenvalues.

    Parameters
    ----------
    matrix
        Symmetric matrix in compressed columns.

    Raises
    ------
    RuntimeError
        If the matrix is exactly singular.
    """

    def __init__(self, matrix: csc_matrix) -> None:
        from scipy.sparse import csc_matrix
        from scipy.sparse.linalg import splu

        # Scaled to a diagonal of ones, so that pivots do not depend on units.
        diagonal = np.abs(matrix.diagonal())
        self._scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
        columns = np.repeat(np.arange(len(diagonal)), np.diff(matrix.indptr))
        scaled = matrix.data * self._scale[matrix.indices] * self._scale[columns]
        self._factor: Any = splu(
            csc_matrix((scaled, matrix.indices, matrix.indptr), shape=matrix.shape),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        # Pivots stay on the diagonal, so L U is L D L', whose signs are those of the matrix
        # (Sylvester's law of inertia).
        self.pivots: NDArray[np.float64] = self._factor.U.diagonal()

    @property
    def negative_eigenvalues(self) -> int:
        """Number of negative eigenvalues."""
        return int((self.pivots < 0.0).sum())

    @property
    def nonsingular(self) -> bool:
        """Whether no rigid-body motion is left."""
        return bool(self.pivots.min() >= SMALLEST_PIVOT)

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the solution for a right-hand side."""
        solution: NDArray[np.float64] = self._scale * self._factor.solve(self._scale * right)
        return solution


@dataclass(frozen=True, slots=True, eq=False)
class FrameSystem:
    """A frame with its supports, loads and springs.

    Parameters
    ----------
    mesh
        Elements.
    free : (f,) int64
        Free degrees of freedom, out of 3 for each node of the mesh.
    motion : (n, 3) float64
        Prescribed displacements at the full stroke, 0 for free degrees of freedom.
    load : (n, 3) float64
        Forces at the full stroke, N.
    spring_nodes : (s,) int64
        Nodes with springs to the ground.
    springs : (s, 2, 2) float64
        Stiffness of the springs, N / mm.
    assembly
        Assembly of the stiffness of the free degrees of freedom, from elements, then springs.
    """

    mesh: FrameMesh
    free: NDArray[np.int64]
    motion: NDArray[np.float64]
    load: NDArray[np.float64]
    spring_nodes: NDArray[np.int64]
    springs: NDArray[np.float64]
    assembly: Assembly


@dataclass(frozen=True, slots=True, eq=False)
class Assembly:
    """Positions of the entries of dense blocks in a sparse matrix.

    Parameters
    ----------
    selected : (k,) int64
        Entries of free degrees of freedom only.
    slot : (k,) int64
        Value of the matrix to which each of them is added.
    rows, starts
        Rows and column starts of the values, in compressed columns.
    size
        Number of rows of the matrix.
    """

    selected: NDArray[np.int64]
    slot: NDArray[np.int64]
    rows: NDArray[np.int64]
    starts: NDArray[np.int64]
    size: int

    def matrix(self, entries: NDArray[np.float64]) -> csc_matrix:
        """Return the matrix of the free degrees of freedom from the entries of all blocks."""
        from scipy.sparse import csc_matrix

        data = np.bincount(self.slot, weights=entries[self.selected], minlength=len(self.rows))
        return csc_matrix((data, self.rows, self.starts), shape=(self.size, self.size))


def assembly_of(blocks: list[NDArray[np.int64]], free: NDArray[np.int64], count: int) -> Assembly:
    """Return the assembly of dense blocks, given by their degrees of freedom (b, k)."""
    number = np.full(count, -1, dtype=np.int64)
    number[free] = np.arange(len(free))
    rows = np.concatenate([np.repeat(number[dof], dof.shape[1], axis=1).ravel() for dof in blocks])
    columns = np.concatenate([np.tile(number[dof], (1, dof.shape[1])).ravel() for dof in blocks])
    selected = np.flatnonzero((rows >= 0) & (columns >= 0))
    key, slot = np.unique(columns[selected] * len(free) + rows[selected], return_inverse=True)
    starts = np.searchsorted(key, np.arange(len(free) + 1) * len(free))
    return Assembly(selected, slot, key % len(free), starts, len(free))


def dofs_of(nodes: NDArray[np.int64], each: int = 3) -> NDArray[np.int64]:
    """Return (..., each) the first degrees of freedom of nodes."""
    return 3 * nodes[..., None] + np.arange(each)


def frame_system(part: Part, mesh: FrameMesh) -> FrameSystem:
    """Return a mesh with the supports, input and output springs of its problem.

    Supports that hold both coordinates also hold the rotation. Rollers and driven nodes rotate
    freely.
    """
    problem = part.design.problem
    supports, given, output = problem.supports, problem.input, problem.output
    held = np.zeros((mesh.node_count, 3), dtype=bool)
    held[present_nodes(mesh, supports.fixed)] = True
    held[present_nodes(mesh, supports.fixed_x), 0] = True
    held[present_nodes(mesh, supports.fixed_y), 1] = True
    motion = np.zeros((mesh.node_count, 3))
    load = np.zeros((mesh.node_count, 3))
    present = mesh.node[given.nodes] >= 0
    nodes = mesh.node[given.nodes[present]]
    if given.drive == "displacement":
        held[nodes, :2] = True
        motion[nodes, :2] = given.amount * part.scale * given.direction[present]
    else:
        unit = part.stiffness_unit * part.scale
        load[nodes, :2] = given.amount * unit * given.direction[present]
    spring_nodes, springs = np.empty(0, dtype=np.int64), np.empty((0, 2, 2))
    if output.spring is not None:
        present = mesh.node[output.nodes] >= 0
        spring_nodes = mesh.node[output.nodes[present]]
        direction = output.direction[present]
        shape = direction[:, :, None] * direction[:, None, :]
        if output.spring_kind == "isotropic":
            shape = np.broadcast_to(np.eye(2), shape.shape)
        springs = output.spring * part.stiffness_unit * shape
    free = np.flatnonzero(~held.ravel())
    ends = dofs_of(mesh.elements).reshape(-1, 6)
    assembly = assembly_of([ends, dofs_of(spring_nodes, 2)], free, held.size)
    return FrameSystem(mesh, free, motion, load, spring_nodes, springs, assembly)


def present_nodes(mesh: FrameMesh, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the mesh nodes of those lattice nodes that have struts."""
    found = mesh.node[nodes]
    return found[found >= 0]
