"""What joins the blocks of a machine: bodies of parts and bridges, and how they sit on blocks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.machines.elements import tangent
from bellcrank.machines.ports import block_ports
from bellcrank.machines.sampling import usual_reach
from bellcrank.mechanics import Rigid, Superelement
from bellcrank.model import Design, Input, Output

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.machines.sampling import Reach

ALONG = np.array([1.0, 0.0])
"""Some direction, where a problem must have one and nobody looks at it."""


@dataclass(frozen=True, slots=True, eq=False)
class Arm:
    """How a port sits on a block.

    Parameters
    ----------
    block
        Number of the block.
    offset : (2,)
        From the middle of the block to that of the port, at rest.
    frame : (3, 3)
        Turns motions in the machine into those in the part's own lattice; orthogonal.

    Examples
    --------
    A quarter turn of the block takes a port beside it along:

    >>> arm = Arm(0, np.array([1.0, 0.0]), np.eye(3))
    >>> arm.place(np.array([0.0, 0.0, np.pi / 2])).round(3)
    array([-1.   ,  1.   ,  1.571])
    """

    block: int
    offset: NDArray[np.float64]
    frame: NDArray[np.float64]

    def _turned(self, angle: float) -> NDArray[np.float64]:
        cosine, sine = np.cos(angle), np.sin(angle)
        x, y = self.offset
        return np.array([cosine * x - sine * y, sine * x + cosine * y])

    def place(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (3,) how the port moves, in its part's own lattice, when the block moves by q."""
        moved = q.copy()
        moved[:2] += self._turned(q[2]) - self.offset
        placed: NDArray[np.float64] = self.frame @ moved
        return placed

    def motions(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (3, 3) the derivative of `place`."""
        arm, slope = self._turned(q[2]), np.eye(3)
        slope[:2, 2] = -arm[1], arm[0]
        turned: NDArray[np.float64] = self.frame @ slope
        return turned

    def bend(self, q: NDArray[np.float64], force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (3, 3) the second derivative of `place`, times a force (3,) on the port."""
        curved = np.zeros((3, 3))
        curved[2, 2] = -(self.frame.T @ force)[:2] @ self._turned(q[2])
        return curved


@dataclass(frozen=True, eq=False)
class Body:
    """A part or a bridge in its own lattice; parts that differ by their place only share one.

    Parameters
    ----------
    design
        Not placed yet, and without what it loses in the machine.
    ports
        Nodes (n,) of its input and its output.
    alone
        Whether it has work of its own, as parts have and bridges have not.
    """

    design: Design
    ports: tuple[NDArray[np.int64], NDArray[np.int64]]
    alone: bool = True

    @cached_property
    def element(self) -> Superelement:
        """As felt through its two blocks: x, y, rotation of the input, then of the output."""
        positions = self.design.problem.lattice.positions
        grips = [
            Rigid(nodes, positions[nodes], positions[nodes].mean(axis=0)) for nodes in self.ports
        ]
        # What counts is all that hangs together with a port: all gripped nodes but one drive.
        gripped = np.concatenate(self.ports)
        whole = replace(
            self.design.problem,
            input=Input(gripped[:-1], ALONG, "displacement", 1.0),
            output=Output(gripped[-1:], ALONG),
            designable=np.array([0]),
        )
        return Superelement(Design(whole, self.design.mask), grips)

    @cached_property
    def bend(self) -> NDArray[np.float64] | None:
        """(6, 6) second derivative of its potential at rest; None if it has none."""
        return tangent(self.element)

    @cached_property
    def usual(self) -> tuple[Superelement, Reach] | None:
        """Its two ports as its problem has them, and the range of its usual work, if any."""
        if not self.alone:
            return None
        try:
            element = block_ports(self.design)
            return element, usual_reach(element)
        except InvalidSettings:
            return None


@dataclass(frozen=True, slots=True, eq=False)
class Member:
    """A part or a bridge between two blocks.

    Parameters
    ----------
    name
        As the plan calls it.
    body
    arms
        Of its input and its output.
    """

    name: str
    body: Body
    arms: tuple[Arm, Arm]
