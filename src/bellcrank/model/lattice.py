"""The lattice: nodes at rest and all beams that may exist between them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.model.arrays import check_ids, index_array, locked, real_array, rebuild

if TYPE_CHECKING:
    from numpy.typing import NDArray

MAX_NODES = 250_000
"""Largest number of nodes of a lattice (500 x 500)."""


def check_node_count(name: str, count: int) -> None:
    """Check that a lattice of `count` nodes is not too large, before it is generated.

    Parameters
    ----------
    name
        Name of the argument that determines the size, for the error.
    count
        Number of nodes.

    Raises
    ------
    InvalidProblem
        If there are more than `MAX_NODES`.
    """
    if count > MAX_NODES:
        side = math.isqrt(MAX_NODES)
        raise InvalidProblem(
            f"{name}: a lattice of {count:,} nodes is too large; expected at most {MAX_NODES:,} "
            f"nodes (for example {side} x {side})"
        )


@dataclass(frozen=True, slots=True, eq=False)
class Lattice:
    """Nodes at rest and all beams that may exist between them.

    Parameters
    ----------
    positions : (N, 2) float64, lattice units
        Nodes at rest. Lattices read from files may have shape (N, 3).
    beams : (M, 2) int64
        The two nodes of each beam. Order and orientation are kept, since masks refer to them.

    Raises
    ------
    InvalidProblem
        If a shape is wrong, a number is not finite, there are too many nodes, or a beam names
        a node that does not exist, has no length, or is repeated.

    Examples
    --------
    >>> triangle = Lattice([[0, 0], [1, 0], [0.5, 0.75]], [[0, 1], [1, 2], [2, 0]])
    >>> triangle.node_count, triangle.beam_count
    (3, 3)
    >>> triangle.rest_length.round(3)
    array([1.   , 0.901, 0.901])
    >>> Lattice([[0, 0], [1, 0]], [[0, 1], [1, 0]])
    Traceback (most recent call last):
        ...
    bellcrank.errors.InvalidProblem: beams[1]: [1, 0] is the same beam as beams[0]
    """

    positions: NDArray[np.float64]
    beams: NDArray[np.int64]

    def __post_init__(self) -> None:
        positions = real_array("positions", self.positions)
        if positions.ndim != 2 or positions.shape[1] not in {2, 3} or len(positions) == 0:
            raise InvalidProblem(
                "positions: expected shape (N, 2), or (N, 3) in space, with N >= 1, "
                f"got shape {positions.shape}"
            )
        beams = index_array("beams", self.beams)
        if beams.ndim != 2 or beams.shape[1] != 2 or len(beams) == 0:
            raise InvalidProblem(
                f"beams: expected shape (M, 2) with M >= 1, got shape {beams.shape}"
            )
        check_node_count("positions", len(positions))
        _check_beams(positions, beams)
        object.__setattr__(self, "positions", locked(positions))
        object.__setattr__(self, "beams", locked(beams))

    __reduce__ = rebuild

    @property
    def node_count(self) -> int:
        """Number of nodes N."""
        return len(self.positions)

    @property
    def beam_count(self) -> int:
        """Number of beams M."""
        return len(self.beams)

    @property
    def dimension(self) -> int:
        """Spatial dimension, 2 or 3."""
        return int(self.positions.shape[1])

    @property
    def rest_length(self) -> NDArray[np.float64]:
        """Length of each beam at rest, (M,), lattice units."""
        return _beam_lengths(self.positions, self.beams)

    def beams_touching(self, nodes: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return the mask (M,) of the beams that start or end at one of `nodes`.

        Examples
        --------
        >>> chain = Lattice([[0, 0], [1, 0], [2, 0]], [[0, 1], [1, 2]])
        >>> chain.beams_touching(np.array([0]))
        array([ True, False])
        """
        marked = np.zeros(self.node_count, dtype=np.bool_)
        marked[nodes] = True
        return marked[self.beams[:, 0]] | marked[self.beams[:, 1]]

    def reachable(self, sources: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return the mask (N,) of the nodes connected to one of `sources` by beams.

        Examples
        --------
        >>> pieces = Lattice([[0, 0], [1, 0], [2, 0], [3, 0]], [[0, 1], [2, 3]])
        >>> pieces.reachable(np.array([1]))
        array([ True,  True, False, False])
        """
        neighbours: list[list[int]] = [[] for _ in range(self.node_count)]
        for a, b in self.beams.tolist():
            neighbours[a].append(b)
            neighbours[b].append(a)
        reached = np.zeros(self.node_count, dtype=np.bool_)
        reached[sources] = True
        frontier = sources.tolist()
        while frontier:
            for node in neighbours[frontier.pop()]:
                if not reached[node]:
                    reached[node] = True
                    frontier.append(node)
        return reached


def _beam_lengths(positions: NDArray[np.float64], beams: NDArray[np.int64]) -> NDArray[np.float64]:
    lengths: NDArray[np.float64] = np.linalg.norm(
        positions[beams[:, 1]] - positions[beams[:, 0]], axis=1
    )
    return lengths


def _check_beams(positions: NDArray[np.float64], beams: NDArray[np.int64]) -> None:
    for column in (0, 1):
        bad = np.flatnonzero((beams[:, column] < 0) | (beams[:, column] >= len(positions)))
        if len(bad):
            check_ids(f"beams[{bad[0]}]", beams[bad[0]], len(positions), "node")
    loops = np.flatnonzero(beams[:, 0] == beams[:, 1])
    if len(loops):
        raise InvalidProblem(f"beams[{loops[0]}]: joins node {beams[loops[0], 0]} to itself")
    ordered = np.sort(beams, axis=1)
    _, first, inverse = np.unique(ordered, axis=0, return_index=True, return_inverse=True)
    repeated = np.flatnonzero(first[inverse.ravel()] != np.arange(len(beams)))
    if len(repeated):
        second = repeated[0]
        raise InvalidProblem(
            f"beams[{second}]: {beams[second].tolist()} is the same beam as "
            f"beams[{first[inverse.ravel()[second]]}]"
        )
    lengths = _beam_lengths(positions, beams)
    # Shorter beams have no defined direction.
    extent = float(np.ptp(positions, axis=0).max())
    points = np.flatnonzero(lengths <= 1e-12 * extent)
    if len(points):
        a, b = beams[points[0]]
        raise InvalidProblem(f"beams[{points[0]}]: has no length, nodes {a} and {b} coincide")
