"""A mesh with what holds and drives it: one sparse system of equations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.fem.frame.mesh import FrameMesh
    from bellcrank.part.part import Part


SOFTEST = 1e-12
"""Least pivot, with a diagonal of ones, of a stiffness that holds everything in place."""


class SparseFactor:
    """A symmetric factorisation that also tells how many eigenvalues are negative.

    Parameters
    ----------
    matrix
        Symmetric, in compressed columns.

    Raises
    ------
    RuntimeError
        If it is exactly singular.
    """

    def __init__(self, matrix: csc_matrix) -> None:
        # With a diagonal of ones, forces and moments compare, and so do small parts and large.
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
    def negative(self) -> int:
        """Number of negative eigenvalues."""
        return int((self.pivots < 0.0).sum())

    @property
    def firm(self) -> bool:
        """Whether everything is held in place."""
        return bool(self.pivots.min() >= SOFTEST)

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the solution for a right-hand side."""
        solution: NDArray[np.float64] = self._scale * self._factor.solve(self._scale * right)
        return solution


@dataclass(frozen=True, slots=True, eq=False)
class FrameSystem:
    """Equations of a frame.

    Parameters
    ----------
    mesh
        Its elements.
    free : (f,) int64
        Degrees of freedom that are not given, out of 3 for each node of the mesh.
    motion : (n, 3)
        Given displacements at the full stroke, 0 where none is.
    load : (n, 3)
        Forces at the full stroke, N.
    spring_nodes : (s,) int64
        Nodes with springs to the ground.
    springs : (s, 2, 2)
        Their stiffness, N / mm.
    assembly
        Of the stiffness for the free degrees of freedom, from elements and springs in order.
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
    """Where the entries of dense blocks go in a sparse matrix, found once.

    Parameters
    ----------
    kept : (k,) int64
        Those of the entries that are not about held degrees of freedom.
    slot : (k,) int64
        Which value of the matrix each is added to.
    rows, starts
        Of the values, in compressed columns.
    size
        Rows of the matrix.
    """

    kept: NDArray[np.int64]
    slot: NDArray[np.int64]
    rows: NDArray[np.int64]
    starts: NDArray[np.int64]
    size: int

    def matrix(self, entries: NDArray[np.float64]) -> csc_matrix:
        """Return the matrix of the free degrees of freedom from all entries in order."""
        data = np.bincount(self.slot, weights=entries[self.kept], minlength=len(self.rows))
        return csc_matrix((data, self.rows, self.starts), shape=(self.size, self.size))


def assembly_of(blocks: list[NDArray[np.int64]], free: NDArray[np.int64], count: int) -> Assembly:
    """Find the places of dense blocks, each given by its degrees of freedom (b, k)."""
    number = np.full(count, -1, dtype=np.int64)
    number[free] = np.arange(len(free))
    rows = np.concatenate([np.repeat(number[dof], dof.shape[1], axis=1).ravel() for dof in blocks])
    columns = np.concatenate([np.tile(number[dof], (1, dof.shape[1])).ravel() for dof in blocks])
    kept = np.flatnonzero((rows >= 0) & (columns >= 0))
    key, slot = np.unique(columns[kept] * len(free) + rows[kept], return_inverse=True)
    starts = np.searchsorted(key, np.arange(len(free) + 1) * len(free))
    return Assembly(kept, slot, key % len(free), starts, len(free))


def dofs_of(nodes: NDArray[np.int64], each: int = 3) -> NDArray[np.int64]:
    """Return (..., each) the first degrees of freedom of nodes."""
    return 3 * nodes[..., None] + np.arange(each)


def frame_system(part: Part, mesh: FrameMesh) -> FrameSystem:
    """Hold and drive a mesh as the problem of its part says.

    Supports that hold both coordinates clamp; others and driven nodes turn freely.
    """
    problem = part.design.problem
    supports, given, output = problem.supports, problem.input, problem.output
    held = np.zeros((mesh.node_count, 3), dtype=bool)
    held[present(mesh, supports.fixed)] = True
    held[present(mesh, supports.fixed_x), 0] = True
    held[present(mesh, supports.fixed_y), 1] = True
    motion = np.zeros((mesh.node_count, 3))
    load = np.zeros((mesh.node_count, 3))
    there = mesh.node[given.nodes] >= 0
    nodes = mesh.node[given.nodes[there]]
    if given.drive == "displacement":
        held[nodes, :2] = True
        motion[nodes, :2] = given.amount * part.scale * given.direction[there]
    else:
        unit = part.stiffness_unit * part.scale
        load[nodes, :2] = given.amount * unit * given.direction[there]
    spring_nodes, springs = np.empty(0, dtype=np.int64), np.empty((0, 2, 2))
    if output.spring is not None:
        there = mesh.node[output.nodes] >= 0
        spring_nodes = mesh.node[output.nodes[there]]
        direction = output.direction[there]
        shape = direction[:, :, None] * direction[:, None, :]
        if output.spring_kind == "isotropic":
            shape = np.broadcast_to(np.eye(2), shape.shape)
        springs = output.spring * part.stiffness_unit * shape
    free = np.flatnonzero(~held.ravel())
    ends = dofs_of(mesh.elements).reshape(-1, 6)
    assembly = assembly_of([ends, dofs_of(spring_nodes, 2)], free, held.size)
    return FrameSystem(mesh, free, motion, load, spring_nodes, springs, assembly)


def present(mesh: FrameMesh, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the mesh's nodes of those lattice nodes that have any."""
    found = mesh.node[nodes]
    return found[found >= 0]
