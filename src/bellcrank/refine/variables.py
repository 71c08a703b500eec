"""Variables of a refinement: positions of nodes and widths of beams of one design."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bellcrank.mechanics.frames.joints import with_joints
from bellcrank.search.symmetry import node_images, operation

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from bellcrank.model import Design, Problem

Image = tuple[NDArray[np.int64], NDArray[np.float64]]
"""Image of each node by a symmetry, -1 where it has none, and the matrix of the symmetry."""
INDEPENDENT = 1e-9
"""Singular value of the conditions on a motion below which they do not restrict it."""


@dataclass(frozen=True, slots=True, eq=False)
class Variables:
    """Positions of the free nodes and widths of the present beams, as one vector.

    The vector is zero for the initial geometry. Images of a node or a beam by a symmetry share
    their variables.

    Parameters
    ----------
    problem
        Problem with the initial geometry.
    mask : (M,) bool
        The design.
    map : (P, n) sparse
        From the vector to the changes of all positions (N d), then of all widths (M).
    moves : (n,) bool
        Whether a variable is a coordinate of a node; else it is a width.
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
    images: list[Image] = [
        (node_images(problem, name), operation(problem, name)[0])
        for name in (() if wanted is None else wanted.symmetry)
    ]
    rows: list[int] = []
    columns: list[int] = []
    factors: list[float] = []
    count = 0
    moves: list[bool] = []
    now: list[float] = []
    done = np.zeros(nodes, dtype=bool)
    for start in np.flatnonzero(free).tolist():
        if done[start]:
            continue
        orbit, motions = _orbit(start, dimension, images)
        done[list(orbit)] = True
        if not free[list(orbit)].all():
            continue
        for node, matrix in orbit.items():
            for axis, by_motion in enumerate((matrix @ motions).tolist()):
                for variable, factor in enumerate(by_motion):
                    if factor:
                        rows.append(node * dimension + axis)
                        columns.append(count + variable)
                        factors.append(factor)
        moves += [True] * motions.shape[1]
        count += motions.shape[1]
    if widths[1] > widths[0]:
        for group in _beam_groups(problem, mask, images):
            rows += [nodes * dimension + each for each in group]
            columns += [count] * len(group)
            factors += [1.0] * len(group)
            now.append(float(problem.beam_widths[group[0]]))
            moves.append(False)
            count += 1
    shape = (nodes * dimension + lattice.beam_count, count)
    whole = csr_matrix((factors, (rows, columns)), shape=shape)
    moving = np.array(moves, dtype=bool)
    low, high = np.zeros(count), np.zeros(count)
    reach = largest_move * float(np.mean(lattice.rest_length[mask]))
    low[moving], high[moving] = -reach, reach
    low[~moving], high[~moving] = widths[0] - np.array(now), widths[1] - np.array(now)
    return Variables(problem, mask, whole, moving, np.minimum(low, 0.0), np.maximum(high, 0.0))


def _orbit(
    start: int, dimension: int, images: list[Image]
) -> tuple[dict[int, NDArray[np.float64]], NDArray[np.float64]]:
    """Return the images of a node, and the motions that it may have.

    Returns
    -------
    orbit : dict of (d, d)
        Matrix from the motion of the node to that of each image, itself included.
    motions : (d, f)
        Orthonormal motions that keep the symmetry: a node on a mirror plane stays there, and one on
        an axis of rotation too.
    """
    orbit, waiting = {start: np.eye(dimension)}, [start]
    conditions = [np.zeros((1, dimension))]
    while waiting:
        node = waiting.pop()
        for partner, matrix in images:
            other, by_start = int(partner[node]), matrix @ orbit[node]
            if other < 0:
                continue
            if other in orbit:
                conditions.append(by_start - orbit[other])
            else:
                orbit[other] = by_start
                waiting.append(other)
    restricted = np.concatenate(conditions)
    if not np.abs(restricted).max() > INDEPENDENT:
        return orbit, np.eye(dimension)
    _, sizes, directions = np.linalg.svd(restricted)
    rank = int((sizes > INDEPENDENT).sum())
    motions = directions[rank:].T
    return orbit, np.where(np.abs(motions) > INDEPENDENT, motions, 0.0)


def _beam_groups(
    problem: Problem,
    mask: NDArray[np.bool_],
    images: list[Image],
) -> list[list[int]]:
    """Return the beams of a design in groups of images."""
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
