"""One equilibrium of a machine of blocks after the other: Newton's method.

In equilibrium the forces of all elements on a block that is not driven cancel. A step counts as in
`bellcrank.mechanics.follow`: if it ends in a stable equilibrium, the tangents at both of its ends
account for the way between them, and the lowest stiffness changes little.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidFile
from bellcrank.machines.elements import IN, OUT
from bellcrank.mechanics.conditions import SMALLEST
from bellcrank.mechanics.following import (
    LARGEST_DEPARTURE,
    LARGEST_SOFTENING,
    LONGEST_STEP,
    MOST_ITERATIONS,
    SETTLED,
    TOLERANCE,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.machines.blocks import Blocks
    from bellcrank.machines.elements import Element, Felt
    from bellcrank.machines.members import Member


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """Where the machine is: its blocks (b, 3), and the memory of each element."""

    q: NDArray[np.float64]
    memories: tuple[Any, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The machine to first order around a place.

    Parameters
    ----------
    force : (3 b,)
        From outside on the blocks, when the interiors have followed.
    stiffness : (3 b, 3 b)
    felt
        What each element feels.
    """

    force: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    felt: tuple[Felt, ...]

    @property
    def departure(self) -> float:
        """By how much interiors are out of equilibrium."""
        return max(each.departure for each in self.felt)


class Chain:
    """Blocks and elements, one for each of their members."""

    def __init__(self, blocks: Blocks, elements: Sequence[Element]) -> None:
        self.blocks, self.elements = blocks, tuple(elements)
        self.rest = Place(
            np.zeros_like(blocks.stroke), tuple(element.begin() for element in elements)
        )
        found = self.around(self.rest)
        if found is None:
            raise InvalidFile(f"{blocks.source}: {self._unstable()} is not stable at rest")
        self.at_rest = found
        # What nothing at all resists stays at rest, as a port that its part has lost.
        self.free = np.repeat(blocks.reached & ~blocks.driven, 3) & found.stiffness.any(axis=1)
        self._check_held()

    def _unstable(self) -> str:
        """Name what is not stable at rest."""
        members = zip(self.blocks.members, self.elements, self.rest.memories, strict=True)
        return ", ".join(
            member.name
            for member, element, memory in members
            if element.feel(np.zeros(6), memory) is None
        )

    def _check_held(self) -> None:
        free = np.flatnonzero(self.free)
        if not len(free):
            return
        values, vectors = np.linalg.eigh(self.at_rest.stiffness[np.ix_(free, free)])
        if values[0] <= SMALLEST * values[-1]:
            block = self.blocks.names[free[np.abs(vectors[:, 0]).argmax()] // 3]
            raise InvalidFile(
                f"{self.blocks.source}: {', '.join(map(str, block))} swings freely: nothing "
                "resists some motion of it"
            )

    def ports(self, q: NDArray[np.float64], member: Member) -> NDArray[np.float64]:
        """(6,) where the ports of a member are, in its own lattice."""
        return np.concatenate([arm.place(q[arm.block]) for arm in member.arms])

    def around(self, place: Place) -> Found | None:
        """Sum up what all elements feel; None where one of them is not stable."""
        count = place.q.size
        force, stiffness, felt = np.zeros(count), np.zeros((count, count)), []
        members = zip(self.blocks.members, self.elements, place.memories, strict=True)
        for member, element, memory in members:
            found = element.feel(self.ports(place.q, member), memory)
            if found is None:
                return None
            felt.append(found)
            rows = np.concatenate([3 * arm.block + np.arange(3) for arm in member.arms])
            turn = np.zeros((6, 6))
            for arm, part in zip(member.arms, (IN, OUT), strict=True):
                own = place.q[arm.block]
                turn[part, part] = arm.motions(own)
                at = slice(3 * arm.block, 3 * arm.block + 3)
                stiffness[at, at] += arm.bend(own, found.force[part])
            np.add.at(force, rows, turn.T @ found.force)
            np.add.at(stiffness, np.ix_(rows, rows), turn.T @ found.stiffness @ turn)
        return Found(force, stiffness, tuple(felt))

    def tangent(self, found: Found, part: float) -> NDArray[np.float64]:
        """(b, 3) motion of the blocks when the drive goes on by a part of its stroke."""
        moved = np.where(self.blocks.driven[:, None], part * self.blocks.stroke, 0.0).ravel()
        moved[self.free] = self._solve(found, -found.stiffness[self.free] @ moved)
        return moved.reshape(-1, 3)

    def _solve(self, found: Found, right: NDArray[np.float64]) -> NDArray[np.float64]:
        own = found.stiffness[np.ix_(self.free, self.free)]
        return np.asarray(np.linalg.solve(own, right)) if len(own) else right

    def lowest(self, found: Found) -> tuple[float, float]:
        """Return the lowest and the largest stiffness of the free blocks."""
        own = found.stiffness[np.ix_(self.free, self.free)]
        if not len(own):
            return np.inf, 0.0
        values = np.linalg.eigvalsh(own)
        return float(values[0]), float(values[-1])

    def moved(self, place: Place, found: Found, step: NDArray[np.float64]) -> Place:
        """Move the blocks by a step (b, 3), and the elements with them."""
        q = place.q + step
        memories = [
            felt.advance(self.ports(q, member) - self.ports(place.q, member))
            for member, felt in zip(self.blocks.members, found.felt, strict=True)
        ]
        return Place(q, tuple(memories))

    def settle(self, place: Place) -> tuple[Place, Found] | None:
        """Find the stable equilibrium next to a place, the drive being held."""
        for _ in range(MOST_ITERATIONS):
            found = self.around(place)
            if found is None:
                return None
            step = np.zeros(place.q.size)
            try:
                step[self.free] = self._solve(found, -found.force[self.free])
            except np.linalg.LinAlgError:
                return None
            size = float(np.abs(step).max())
            if size <= TOLERANCE and found.departure <= TOLERANCE:
                low, high = self.lowest(found)
                return (place, found) if low > SMALLEST * high else None
            if not size < LONGEST_STEP:
                return None
            place = self.moved(place, found, step.reshape(-1, 3))
        return None

    def advance(self, place: Place, found: Found, part: float) -> tuple[Place, Found] | None:
        """Drive on by a part of the stroke; None if that may leave the stable path."""
        before = self.tangent(found, part)
        settled = self.settle(self.moved(place, found, before))
        if settled is None:
            return None
        way = settled[0].q - place.q
        mean = 0.5 * (before + self.tangent(settled[1], part))
        departure = float(np.abs(way - mean).max())
        first, last = self.lowest(found)[0], self.lowest(settled[1])[0]
        alike = first == last or min(first, last) > LARGEST_SOFTENING * max(first, last)
        near = departure <= LARGEST_DEPARTURE * max(float(np.abs(way).max()), SETTLED)
        return settled if near and alike else None
