"""Struts that cross or come nearer to each other than a width, straight and bent."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem


def near_pairs(
    positions: NDArray[np.float64], beams: NDArray[np.int64], width: float
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Find the pairs of struts without a common node that cross or are nearer than a width.

    Parameters
    ----------
    positions : (N, d)
    beams : (n, 2)
    width
        0 for crossings only.

    Returns
    -------
    pairs : (p, 2) int64
        Indices into `beams`.
    distance : (p,)
    """
    from bellcrank.mechanics.kernels.contact import find_near_pairs

    ends = positions[beams]
    left, right = ends.min(axis=1), ends.max(axis=1)
    order = np.argsort(left[:, 0])
    count = len(beams)
    while True:
        pairs, distance = np.empty((count, 2), np.int64), np.empty(count)
        found = find_near_pairs(positions, beams, order, left, right, width, pairs, distance)
        if found <= count:
            return pairs[:found], distance[:found]
        count = found


def bent_pieces(
    problem: Problem, beams: NDArray[np.int64], u: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return points of bent struts and the straight pieces between them.

    In the plane every strut has a point in its middle, on the cubic that its end rotations define.

    Parameters
    ----------
    problem
        Problem of a frame.
    beams : (n,) int64
        The struts.
    u : (N, 3)
        State of the nodes, with one element in each beam.

    Returns
    -------
    points : (N + n, d)
    pieces : (2 n, 2) int64
        In space (N, d) and (n, 2): struts are straight.
    """
    lattice = problem.lattice
    nodes, dimension = lattice.positions.shape
    moved = lattice.positions + u[:nodes, :dimension]
    ends = lattice.beams[beams]
    if dimension == 3:
        return moved, ends
    rest = lattice.positions[ends[:, 1]] - lattice.positions[ends[:, 0]]
    chord = moved[ends[:, 1]] - moved[ends[:, 0]]
    # The difference of the end rotations does not depend on the rotation of the chord, but each
    # must be within half a turn of it.
    turned = np.arctan2(rest[:, 0] * chord[:, 1] - rest[:, 1] * chord[:, 0], (rest * chord).sum(1))
    first, second = ((u[ends[:, k], 2] - turned + np.pi) % (2.0 * np.pi) - np.pi for k in (0, 1))
    normal = np.column_stack([-chord[:, 1], chord[:, 0]])
    middle = moved[ends].mean(axis=1) + normal * ((first - second) / 8.0)[:, None]
    number = nodes + np.arange(len(beams))
    pieces = np.concatenate(
        [np.column_stack([ends[:, 0], number]), np.column_stack([number, ends[:, 1]])]
    )
    return np.concatenate([moved, middle]), pieces
