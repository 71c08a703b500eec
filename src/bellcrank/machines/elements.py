"""What joins two blocks, along the stroke: the part itself, or a table that stands for it.

Both answer the same question: around a motion of their two ports, how large are force and
stiffness? A part has its interior to follow, a table the force on its output, so that each keeps
a memory of where it is; one step of Newton's method for the whole machine brings it along.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from bellcrank.mechanics.conditions import SMALLEST

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.mechanics import Superelement

IN, OUT = slice(0, 3), slice(3, 6)
"""Of the coordinates of both ports: x, y, rotation of the input, then of the output."""


@dataclass(frozen=True, slots=True, eq=False)
class Felt:
    """What the two ports of an element feel, to first order around one motion of them.

    Parameters
    ----------
    force : (6,)
        From outside, as it will be when the interior has followed.
    stiffness : (6, 6)
    energy
        Stored, as it is now.
    departure
        By how much the interior is out of equilibrium: its step while the ports are held.
    advance
        From a further motion (6,) to the memory after it.
    """

    force: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    energy: float
    departure: float
    advance: Callable[[NDArray[np.float64]], Any]


class Element(Protocol):
    """A part or what stands for it. Memories belong to the caller."""

    def begin(self) -> Any:
        """Return the memory of rest."""
        ...

    def feel(self, q: NDArray[np.float64], memory: Any) -> Felt | None:
        """Return what the ports feel at a motion q (6,); None where nothing stable is."""
        ...


class Curved(Protocol):
    """A potential of six variables: the motion of the input, and the force on the output."""

    def expand(
        self, x: NDArray[np.float64]
    ) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """Return the potential, its slope (6,) and its second derivative (6, 6)."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Tabled:
    """An element that is a potential Phi(q_in, F_out); see `bellcrank.machines.potential`.

    Its memory is the force on the output (3,). With it as one more unknown, the energy of a machine
    is the sum of Phi + F_out . q_out over its elements, which is stationary in all unknowns: forces
    balance, and outputs are where the blocks are.

    Parameters
    ----------
    potential
        Of those six variables, in this order.
    """

    potential: Curved

    def begin(self) -> NDArray[np.float64]:
        """Return no force."""
        return np.zeros(3)

    def feel(self, q: NDArray[np.float64], memory: NDArray[np.float64]) -> Felt | None:
        """Return what is felt; None where the output would give way against the force on it."""
        value, slope, bend = self.potential.expand(np.concatenate([q[IN], memory]))
        softness, *_ = np.linalg.eigvalsh(-bend[OUT, OUT])
        if not softness > 0.0:
            return None
        resist = np.linalg.inv(-bend[OUT, OUT])
        missing = slope[OUT] + q[OUT]
        # The force that the output answers to a motion of the input, and of itself.
        along = np.concatenate([resist @ bend[OUT, IN], resist], axis=1)
        late = resist @ missing
        stiffness = np.zeros((6, 6))
        stiffness[IN, IN] = bend[IN, IN]
        stiffness[:, OUT] = along.T
        stiffness[OUT, IN] = along[:, IN]
        stiffness[IN, IN] += bend[IN, OUT] @ along[:, IN]
        return Felt(
            force=np.concatenate([slope[IN] + bend[IN, OUT] @ late, memory + late]),
            stiffness=stiffness,
            energy=value + float(memory @ q[OUT]),
            departure=float(np.abs(missing).max()),
            advance=lambda moved: memory + late + along @ moved,
        )


@dataclass(frozen=True, slots=True, eq=False)
class Follower:
    """Memory of a live element.

    Parameters
    ----------
    z : (6,)
        Where its ports are.
    displacement : (N, 2)
        Of all its nodes.
    """

    z: NDArray[np.float64]
    displacement: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Live:
    """An element that is the part itself, condensed to its ports wherever it is.

    Parameters
    ----------
    element
        Of six coordinates, from `bellcrank.machines.blocks.Member`.
    """

    element: Superelement

    def begin(self) -> Follower:
        """Return all at rest."""
        return Follower(np.zeros(6), np.zeros_like(self.element.cut.system.positions))

    def feel(self, q: NDArray[np.float64], memory: Follower) -> Felt | None:
        """Return what is felt; None if the interior is not stable while the ports are held."""
        displacement = memory.displacement.copy()
        self.element.place(q, displacement)
        found = self.element.condense(q, displacement)
        whole = found is not None
        found = found or self.element.condense(q, displacement, softened=False)
        if found is None:
            return None
        condensed = found

        def advance(moved: NDArray[np.float64]) -> Follower:
            step = condensed.settling + np.tensordot(moved, condensed.responses, axes=1)
            return Follower(q + moved, displacement + step)

        departure = float(np.abs(found.settling).max())
        reached = self.element.reached.astype(np.float64)
        return Felt(
            force=found.force * reached,
            stiffness=0.5 * (found.stiffness + found.stiffness.T) * np.outer(reached, reached),
            energy=self.element.cut.energy(displacement),
            # What is not stable cannot be where the machine comes to rest.
            departure=departure if whole else np.inf,
            advance=advance,
        )


def tangent(element: Superelement) -> NDArray[np.float64] | None:
    """Return (6, 6) the second derivative of the potential at rest; None if it has none.

    It has none where nothing holds the output while the input is held.
    """
    reached = element.reached.astype(np.float64)
    stiffness = element.rest().stiffness * np.outer(reached, reached)
    values = np.linalg.eigvalsh(stiffness[OUT, OUT])
    if not values[0] > SMALLEST * values[-1]:
        return None
    give = np.linalg.inv(stiffness[OUT, OUT])
    lever = give @ stiffness[OUT, IN]
    bend = np.zeros((6, 6))
    bend[IN, IN] = stiffness[IN, IN] - stiffness[IN, OUT] @ lever
    bend[OUT, IN], bend[IN, OUT] = lever, lever.T
    bend[OUT, OUT] = -give
    return bend
