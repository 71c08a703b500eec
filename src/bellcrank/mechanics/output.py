"""Motion of the output of a design: displacement, rotation and off-axis motion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from bellcrank.model import Problem

COLLINEAR = 1e-9
"""Ratio of singular values below which output nodes in space are on one line."""


@dataclass(frozen=True, slots=True, eq=False)
class OutputMotion:
    """Motion of the output nodes of a design.

    Parameters
    ----------
    displacement : (d,) float64
        Mean displacement of the output nodes, lattice units.
    rotation : () or (3,) float64
        Best-fit rigid rotation of the output nodes, degrees: counter-clockwise in the plane, the
        rotation vector in space. For a single node of a frame its rotation, of the spring model
        nan.
    along
        Mean over the output nodes of the displacement along the wanted direction of each.
    off_axis
        Size of the mean of the displacements normal to these directions over that of `along`;
        nan without motion along them.
    """

    displacement: NDArray[np.float64]
    rotation: NDArray[np.float64]
    along: float
    off_axis: float


def output_motion(
    problem: Problem,
    displacement: ArrayLike,
    orientation: NDArray[np.float64] | None = None,
) -> OutputMotion:
    """Return the motion of the output for the displacement of the nodes of a lattice.

    Parameters
    ----------
    problem
        The problem, in the plane or in space.
    displacement : (N, d)
        Displacement of the nodes, lattice units.
    orientation : (d, d), optional
        Rotation matrix of a single output node of a frame.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> x, y = crane.lattice.positions.T
    >>> moved = output_motion(crane, np.stack([-0.1 - 0.02 * y, 0.03 + 0.02 * x], axis=1))
    >>> round(float(moved.rotation), 2), moved.displacement.shape
    (1.15, (2,))
    >>> round(output_motion(crane, np.tile([-0.4, 0.1], (len(x), 1))).off_axis, 9)
    0.25
    """
    nodes = problem.output.nodes
    moved = np.asarray(displacement, dtype=np.float64)[nodes]
    means = np.einsum("kna,na->k", motion_weights(problem), moved)
    if len(nodes) == 1 and orientation is not None:
        rotation = rotation_of(orientation)
    else:
        rotation = best_fit_rotation(problem.lattice.positions[nodes], moved)
    return OutputMotion(
        displacement=moved.mean(axis=0),
        rotation=rotation,
        along=float(means[0]),
        off_axis=float(off_axis_of(means)),
    )


@lru_cache(maxsize=64)
def motion_weights(problem: Problem) -> NDArray[np.float64]:
    """Return (1 + d, n, d) the weights of the displacements of the output nodes in means.

    The first is the mean along the wanted direction of each node; the others are the components of
    the mean of the displacements normal to these directions.
    """
    wanted = problem.output.direction
    along = wanted[:, :, None] * wanted[:, None, :]
    normal = (np.eye(wanted.shape[1]) - along).transpose(1, 0, 2)
    weights: NDArray[np.float64] = np.concatenate([wanted[None], normal]) / len(wanted)
    weights.flags.writeable = False
    return weights


def off_axis_of(means: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (...) the off-axis motion for means (..., 1 + d) with `motion_weights`."""
    along, normal = np.abs(means[..., 0]), np.linalg.norm(means[..., 1:], axis=-1)
    nowhere = np.full(along.shape, np.nan)
    return np.asarray(np.divide(normal, along, out=nowhere, where=along > 0.0))


def best_fit_rotation(
    positions: NDArray[np.float64], displacement: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the rigid rotation that fits the displacement of nodes best, degrees.

    Parameters
    ----------
    positions, displacement : (n, d)

    Returns
    -------
    () or (3,) float64
        In the plane the angle, in space the rotation vector; the smallest one for nodes on a
        line. nan for a single node.

    References
    ----------
    W. Kabsch, Acta Cryst. A 32, 922 (1976).

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    >>> turned = square @ [[0.0, 1.0], [-1.0, 0.0]]
    >>> float(best_fit_rotation(square, turned - square))
    90.0
    """
    dimension = positions.shape[1]
    if len(positions) < 2:
        return np.full(() if dimension == 2 else (3,), np.nan)
    return rotation_of(turned_positions(positions, displacement))


def deformation_of(positions: NDArray[np.float64], displacement: NDArray[np.float64]) -> float:
    """Return the largest distance of displaced nodes from their best-fit rigid motion.

    Parameters
    ----------
    positions, displacement : (n, d)

    Returns
    -------
    float
        In the unit of the arguments; nan for a single node.

    Examples
    --------
    Two nodes, a length of 10 apart, come closer by 0.2:

    >>> ends = np.array([[0.0, 0.0], [10.0, 0.0]])
    >>> round(deformation_of(ends, np.array([[0.1, 5.0], [-0.1, 5.0]])), 9)
    0.1
    """
    from scipy.spatial.transform import Rotation

    if len(positions) < 2:
        return math.nan
    rotation = best_fit_rotation(positions, displacement)
    dimension = positions.shape[1]
    vector = rotation if dimension == 3 else [0.0, 0.0, float(rotation)]
    turn = Rotation.from_rotvec(vector, degrees=True).as_matrix()[:dimension, :dimension]
    before = positions - positions.mean(axis=0)
    after = before + displacement - displacement.mean(axis=0)
    return float(np.linalg.norm(after - before @ turn.T, axis=1).max())


def turned_positions(
    positions: NDArray[np.float64], displacement: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (d, d) the sum of products of positions after and before, from their mean before."""
    before = positions - positions.mean(axis=0)
    return np.asarray((before + displacement).T @ before)


def rotation_of(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation in matrices, degrees.

    Parameters
    ----------
    matrix : (..., d, d)
        Results of `turned_positions`, or rotation matrices.

    Returns
    -------
    (...) or (..., 3) float64
        As `best_fit_rotation`.
    """
    if matrix.shape[-1] == 2:
        sine = matrix[..., 1, 0] - matrix[..., 0, 1]
        cosine = matrix[..., 0, 0] + matrix[..., 1, 1]
        return np.asarray(np.degrees(np.arctan2(sine, cosine)))
    from scipy.spatial.transform import Rotation

    left, size, right = np.linalg.svd(matrix)
    mirrored = np.linalg.det(left) * np.linalg.det(right) < 0.0
    turn = left.copy()
    turn[..., 2] *= np.where(mirrored, -1.0, 1.0)[..., None]
    vector = Rotation.from_matrix((turn @ right).reshape(-1, 3, 3)).as_rotvec()
    # Points on one line: the smallest rotation from their direction before to that after.
    first, second = right[..., 0, :], left[..., :, 0]
    axis = np.cross(first, second)
    sine = np.linalg.norm(axis, axis=-1)
    angle = np.arctan2(sine, (first * second).sum(axis=-1))
    smallest = axis * np.divide(angle, sine, out=np.zeros_like(sine), where=sine > 0.0)[..., None]
    on_line = size[..., 1] <= COLLINEAR * size[..., 0]
    rotation = np.where(on_line[..., None], smallest, vector.reshape(axis.shape))
    return np.asarray(np.degrees(rotation))
