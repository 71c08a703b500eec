"""Variables of a refinement: positions of nodes and widths of beams of one design."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics.frames.joints import with_joints
from bellcrank.search.mirror import AXES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray
    from scipy.sparse import csr_matrix

    from bellcrank.model import Design, Problem

SAME_POSITION = 1e-4
"""Tolerance on the position of a mirror image, in mean beam lengths."""


@dataclass(frozen=True, slots=True, eq=False)
class Variables:
    """Positions of the free nodes and widths of the present beams, as one vector.

    The vector is zero for the initial geometry. Mirror images of a node or a beam share their
    variables.

    Parameters
    ----------
    problem
        Problem with the initial geometry.
    mask : (M,) bool
        The design.
    map : (P, n) sparse
        From the vector to the changes of all positions (N d), then of all widths (M).
    moves : (n,) bool
        Whether a variable is the position of a node; else it is a width.
    low, high : (n,) float64
        Bounds, lattice units.
    """

    problem: Problem
    mask: NDArray[np.bool_]
    map: csr_matrix
    moves: NDArray[np.bool_]
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    @property
    def count(self) -> int:
        """Number of variables n."""
        return int(self.map.shape[1])

    def geometry(
        self, vector: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return positions (N, d) and widths (M,)."""
        changes = np.asarray(self.map @ vector)
        positions = self.problem.lattice.positions
        return (
            positions + changes[: positions.size].reshape(positions.shape),
            self.problem.beam_widths + changes[positions.size :],
        )

    def problem_at(self, vector: NDArray[np.float64]) -> Problem:
        """Return the problem with the geometry of a vector, and with its joints."""
        positions, widths = self.geometry(vector)
        same = self.problem.widths is None and self.moves.all()
        problem = self.problem.with_geometry(positions, None if same else widths)
        return problem if self.problem.joints is None else with_joints(problem, self.mask)

    def gradient(
        self, positions: NDArray[np.float64], widths: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return (k, n) derivatives by the variables from those by positions and widths.

        Parameters
        ----------
        positions : (k, N, d)
        widths : (k, M)
        """
        whole = np.concatenate(
            [positions.reshape(len(positions), self.problem.lattice.positions.size), widths], axis=1
        )
        return np.asarray((self.map.T @ whole.T).T)


def variables_of(design: Design, largest_move: float, widths: tuple[float, float]) -> Variables:
    """Return the variables of a design.

    Nodes of supports, inputs, outputs and loads of all load cases keep their positions.

    Parameters
    ----------
    design
        The design to refine.
    largest_move
        Largest change of a coordinate, in mean beam lengths.
    widths
        Smallest and largest width, lattice units; equal if widths do not change.
    """
    from scipy.sparse import csr_matrix

    problem, mask = design.problem, design.mask
    lattice = problem.lattice
    nodes, dimension = lattice.positions.shape
    free = np.zeros(nodes, dtype=bool)
    free[lattice.beams[mask].ravel()] = True
    free[problem.special_nodes_of_all_cases] = False
    wanted = problem.specification
    axes = () if wanted is None else wanted.symmetry
    images = _images(problem, axes)
    rows, columns, signs = [], [], []
    count = 0
    moves: list[bool] = []
    anchors: list[int] = []
    done = np.zeros(nodes * dimension, dtype=bool)
    for start in (np.flatnonzero(free)[:, None] * dimension + np.arange(dimension)).ravel():
        if done[start]:
            continue
        orbit = _orbit(int(start), dimension, images)
        if orbit is None:  # on a mirror axis, which it may not leave
            done[start] = True
            continue
        for entry, sign in orbit.items():
            done[entry] = True
            rows.append(entry)
            columns.append(count)
            signs.append(sign)
        anchors.append(int(start))
        moves.append(True)
        count += 1
    if widths[1] > widths[0]:
        for group in _beam_groups(problem, mask, images):
            rows += [nodes * dimension + each for each in group]
            columns += [count] * len(group)
            signs += [1.0] * len(group)
            anchors.append(nodes * dimension + group[0])
            moves.append(False)
            count += 1
    shape = (nodes * dimension + lattice.beam_count, count)
    matrix = csr_matrix((signs, (rows, columns)), shape=shape)
    moving, start = np.array(moves, dtype=bool), np.array(anchors, dtype=np.int64)
    low, high = np.zeros(count), np.zeros(count)
    reach = largest_move * float(np.mean(lattice.rest_length[mask]))
    low[moving], high[moving] = -reach, reach
    now = problem.beam_widths[start[~moving] - nodes * dimension]
    low[~moving], high[~moving] = widths[0] - now, widths[1] - now
    return Variables(problem, mask, matrix, moving, np.minimum(low, 0.0), np.maximum(high, 0.0))


def _images(problem: Problem, axes: Sequence[str]) -> list[tuple[NDArray[np.int64], int]]:
    """Return the mirror image of each node, and the coordinate that is mirrored, for each axis."""
    from scipy.spatial import cKDTree

    positions, found = problem.lattice.positions, []
    for axis in axes:
        column = AXES[axis]
        ends = positions[problem.lattice.beams[problem.designable]].reshape(-1, 2)
        image = positions.copy()
        image[:, column] = ends[:, column].min() + ends[:, column].max() - image[:, column]
        distance, partner = cKDTree(positions).query(image)
        tolerance = SAME_POSITION * float(np.mean(problem.lattice.rest_length))
        found.append((np.where(distance < tolerance, partner, -1), column))
    return found


def _orbit(
    entry: int, dimension: int, images: list[tuple[NDArray[np.int64], int]]
) -> dict[int, float] | None:
    """Return the mirror images of a coordinate and their signs; None if one is its opposite."""
    orbit = {entry: 1.0}
    waiting = [entry]
    while waiting:
        node, axis = divmod(waiting.pop(), dimension)
        sign = orbit[node * dimension + axis]
        for partner, column in images:
            other = int(partner[node])
            if other < 0:
                continue
            key, mirrored = other * dimension + axis, -sign if axis == column else sign
            if key not in orbit:
                orbit[key] = mirrored
                waiting.append(key)
            elif orbit[key] != mirrored:
                return None
    return orbit


def _beam_groups(
    problem: Problem,
    mask: NDArray[np.bool_],
    images: list[tuple[NDArray[np.int64], int]],
) -> list[list[int]]:
    """Return the beams of a design in groups of mirror images."""
    beams = problem.lattice.beams
    numbers = {tuple(sorted(pair)): k for k, pair in enumerate(beams.tolist())}
    known = np.zeros(len(beams), dtype=bool)
    groups = []
    for beam in np.flatnonzero(mask).tolist():
        if known[beam]:
            continue
        orbit, waiting = {beam}, [beam]
        while waiting:
            ends = beams[waiting.pop()]
            for partner, _ in images:
                other = numbers.get(tuple(sorted(partner[ends].tolist())))
                if other is not None and other not in orbit:
                    orbit.add(other)
                    waiting.append(other)
        known[list(orbit)] = True
        groups.append(sorted(orbit))
    return groups
