"""Generalised coordinates that move the boundary nodes of a design."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Coupling:
    """Boundary nodes, and the generalised coordinates that move them.

    The force by a coordinate is the sum over the nodes of force times motion.

    Parameters
    ----------
    nodes : (n,) int64
    motions : (m, n, k)
        Motion of the nodes per unit of each coordinate: displacements only, so that the nodes of
        a frame rotate freely, or also rotations: k = 3 in the plane and k = 6 in space, where
        successive rotations are composed.
    """

    nodes: NDArray[np.int64]
    motions: NDArray[np.float64]

    @property
    def count(self) -> int:
        """Number m of coordinates."""
        return len(self.motions)


def uniform_motion(nodes: NDArray[np.int64], direction: NDArray[np.float64]) -> Coupling:
    """Couple nodes to one coordinate: all move by the same amount, each along its direction.

    As the displacement drive of a problem moves them.

    Parameters
    ----------
    nodes : (n,) int64
    direction : (n, d) unit vectors
    """
    return Coupling(nodes, direction[None])


def free_nodes(nodes: NDArray[np.int64], unknowns: int = 2) -> Coupling:
    """Move nodes independently, by the coordinates x, y of the first, of the second, ...

    Parameters
    ----------
    nodes : (n,) int64
    unknowns
        Coordinates of each node. With 3 in the plane the last one is its rotation, with 6 in space
        the last three are its rotations about the axes.
    """
    count = len(nodes)
    return Coupling(nodes, np.eye(unknowns * count).reshape(-1, count, unknowns))
