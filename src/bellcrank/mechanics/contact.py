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

    first, second = positions[beams[:, 0]], positions[beams[:, 1]]
    left, right = np.minimum(first, second), np.maximum(first, second)
    order = np.argsort(left[:, 0])
    count = len(beams)
    while True:
        pairs, distance = np.empty((count, 2), np.int64), np.empty(count)
        found = find_near_pairs(positions, beams, order, left, right, width, pairs, distance)
        if found <= count:
            return pairs[:found], distance[:found]
        count = found


class BentStruts:
    """Straight pieces of bent struts.

    In the plane every strut has a point in its middle, on the cubic that its end rotations define.
    In space struts are straight.

    Parameters
    ----------
    problem
        Problem of a frame.
    beams : (n,) int64
        The struts.

    Attributes
    ----------
    pieces : (2 n, 2) int64
        Indices of the ends of each piece into the points; in space (n, 2).
    """

    def __init__(self, problem: Problem, beams: NDArray[np.int64]) -> None:
        self._positions = positions = problem.lattice.positions
        self._first, self._second = first, second = problem.lattice.beams[beams].T
        self._rest = positions[second] - positions[first]
        if positions.shape[1] == 3:
            self.pieces = np.column_stack([first, second])
        else:
            middle = len(positions) + np.arange(len(beams))
            self.pieces = np.column_stack([np.append(first, middle), np.append(middle, second)])

    def points(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (N + n, d) the nodes and the points in the middle; in space (N, d).

        Parameters
        ----------
        u : (N, b)
            State of the nodes, with one element in each beam.
        """
        nodes, dimension = self._positions.shape
        moved = self._positions + u[:nodes, :dimension]
        if dimension == 3:
            return moved
        first, second = self._first, self._second
        rest, chord = self._rest.T, (moved[second] - moved[first]).T
        # The difference of the end rotations does not depend on the rotation of the chord, but each
        # must be within half a turn of it.
        turned = np.arctan2(rest[0] * chord[1] - rest[1] * chord[0], (rest * chord).sum(axis=0))
        from_chord = u[np.stack([first, second]), 2] - turned
        one, other = (from_chord + np.pi) % (2.0 * np.pi) - np.pi
        normal = np.column_stack([-chord[1], chord[0]])
        middle = 0.5 * (moved[first] + moved[second]) + normal * ((one - other) / 8.0)[:, None]
        return np.concatenate([moved, middle])
