"""How nodes are gripped from outside: what may move them, and in which coordinates.

A grip turns a few generalised coordinates z into the displacement of its nodes. The force that
does work on z is the sum over the nodes of force times motion per z.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Grip(Protocol):
    """Some nodes, and the coordinates that move them."""

    @property
    def nodes(self) -> NDArray[np.int64]:
        """(n,) which."""
        ...

    @property
    def count(self) -> int:
        """Number m of coordinates."""
        ...

    def place(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, 2) the displacement of the nodes at the coordinates z (m,)."""
        ...

    def motions(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (m, n, 2) the derivative of `place`."""
        ...

    def bend(self, z: NDArray[np.float64], force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (m, m) the second derivative of `place`, times a force (n, 2) on the nodes."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Sliding:
    """All nodes move by the same amount, each along its direction, and not across it.

    As the displacement drive of a problem moves them.

    Parameters
    ----------
    nodes : (n,) int64
    direction : (n, 2) unit vectors

    Examples
    --------
    >>> Sliding(np.array([4, 7]), np.array([[0.0, -1.0], [0.0, -1.0]])).place(np.array([0.5]))
    array([[ 0. , -0.5],
           [ 0. , -0.5]])
    """

    nodes: NDArray[np.int64]
    direction: NDArray[np.float64]

    @property
    def count(self) -> int:
        """One coordinate."""
        return 1

    def place(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement, proportional to z."""
        moved: NDArray[np.float64] = z[0] * self.direction
        return moved

    def motions(self, z: NDArray[np.float64]) -> NDArray[np.float64]:  # noqa: ARG002
        """Return the directions, wherever the nodes are."""
        return self.direction[None]

    def bend(self, z: NDArray[np.float64], force: NDArray[np.float64]) -> NDArray[np.float64]:  # noqa: ARG002
        """Return zero: displacements are proportional to z."""
        return np.zeros((1, 1))


@dataclass(frozen=True, slots=True, eq=False)
class Rigid:
    """The nodes move as one rigid block, by x, y and a finite rotation about its centre.

    Parameters
    ----------
    nodes : (n,) int64
    positions : (n, 2)
        Of the nodes at rest.
    centre : (2,)
        Of the block at rest; the forces by the coordinates are the two components of the total
        force, and the moment about the centre.

    Examples
    --------
    >>> block = Rigid(np.array([0, 1]), np.array([[1.0, 0.0], [-1.0, 0.0]]), np.zeros(2))
    >>> block.place(np.array([0.0, 0.5, np.pi / 2])).round(3)
    array([[-1. ,  1.5],
           [ 1. , -0.5]])
    """

    nodes: NDArray[np.int64]
    positions: NDArray[np.float64]
    centre: NDArray[np.float64]

    @property
    def count(self) -> int:
        """Three coordinates."""
        return 3

    def _turned(self, angle: float) -> NDArray[np.float64]:
        cosine, sine = np.cos(angle), np.sin(angle)
        arm = self.positions - self.centre
        turned: NDArray[np.float64] = arm @ np.array([[cosine, sine], [-sine, cosine]])
        return turned

    def place(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement of a block that is shifted and turned."""
        moved: NDArray[np.float64] = z[:2] + self._turned(z[2]) + self.centre - self.positions
        return moved

    def motions(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return two shifts and the rate of turning about the centre as it is now."""
        arm = self._turned(z[2])
        shift = np.zeros((2, len(arm), 2))
        shift[0, :, 0] = shift[1, :, 1] = 1.0
        return np.concatenate([shift, np.stack([-arm[:, 1], arm[:, 0]], axis=1)[None]])

    def bend(self, z: NDArray[np.float64], force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what turning adds to the stiffness where forces act on the arms."""
        curved = np.zeros((3, 3))
        curved[2, 2] = -(force * self._turned(z[2])).sum()
        return curved


@dataclass(frozen=True, slots=True, eq=False)
class Loose:
    """Each node moves as it likes; the coordinates are x, y of the first, of the second, ...

    Parameters
    ----------
    nodes : (n,) int64

    Examples
    --------
    >>> Loose(np.array([3])).place(np.array([0.1, 0.2]))
    array([[0.1, 0.2]])
    """

    nodes: NDArray[np.int64]

    @property
    def count(self) -> int:
        """Two coordinates a node."""
        return 2 * len(self.nodes)

    def place(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the coordinates, two a node."""
        return z.reshape(-1, 2)

    def motions(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the unit motions."""
        return np.eye(len(z)).reshape(len(z), -1, 2)

    def bend(self, z: NDArray[np.float64], force: NDArray[np.float64]) -> NDArray[np.float64]:  # noqa: ARG002
        """Return zero: the coordinates are the displacements."""
        return np.zeros((len(z), len(z)))
