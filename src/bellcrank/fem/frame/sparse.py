"""Sparse symmetric matrices: assembly from dense blocks and factorisation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.sparse import csc_matrix

SMALLEST_PIVOT = 1e-12
"""Smallest pivot of a nonsingular stiffness that is scaled to a diagonal of ones."""


class Assembly:
    """Assembly of dense blocks to a matrix of the free unknowns.

    Parameters
    ----------
    blocks
        Unknowns (b, k) of blocks (b, k, k).
    free : (f,) int64
        Free unknowns, the rows of the matrix.
    """

    def __init__(self, blocks: list[NDArray[np.int64]], free: NDArray[np.int64]) -> None:
        self.size = len(free)
        number = np.full(max(int(unknowns.max(initial=-1)) for unknowns in blocks) + 1, -1)
        number[free] = np.arange(self.size)
        rows = np.concatenate([np.repeat(number[b], b.shape[1], axis=1).ravel() for b in blocks])
        columns = np.concatenate([np.tile(number[b], (1, b.shape[1])).ravel() for b in blocks])
        self._selected = np.flatnonzero((rows >= 0) & (columns >= 0))
        keys = columns[self._selected] * self.size + rows[self._selected]
        key, self._slot = np.unique(keys, return_inverse=True)
        self._rows = key % max(self.size, 1)
        self._starts = np.searchsorted(key, np.arange(self.size + 1) * self.size)

    def matrix(self, *blocks: NDArray[np.float64]) -> csc_matrix:
        """Return the sum of blocks (b, k, k) at their unknowns."""
        from scipy.sparse import csc_matrix

        entries = np.concatenate([block.ravel() for block in blocks])[self._selected]
        data = np.bincount(self._slot, weights=entries, minlength=len(self._rows))
        return csc_matrix((data, self._rows, self._starts), shape=(self.size, self.size))


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
