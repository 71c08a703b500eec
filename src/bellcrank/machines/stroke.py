"""A machine of blocks along its stroke: Newton's method on the motions of the blocks.

In equilibrium the forces of all elements on a block that is not driven cancel. The way there is
followed from rest on one stable path, as in `bellcrank.mechanics.follow`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidFile
from bellcrank.machines.elements import IN, OUT
from bellcrank.mechanics import Status
from bellcrank.mechanics.conditions import SMALLEST
from bellcrank.mechanics.following import (
    LARGEST_DEPARTURE,
    LARGEST_SOFTENING,
    LONGEST_STEP,
    MOST_ITERATIONS,
    SETTLED,
    SMALLEST_INCREMENT,
    TOLERANCE,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.machines.blocks import Blocks, Member
    from bellcrank.machines.elements import Element, Felt


@dataclass(frozen=True, slots=True, eq=False)
class Stroke:
    """What a machine does from rest to its full stroke.

    Lattice units; forces are those from outside.

    Parameters
    ----------
    motion, input_force, output, energy : (p,)
        Motion of and force on the input, mean motion of the output, stored energy; the first is
        at rest.
    blocks : (p, b, 3)
        Motion of each block: x, y, rotation.
    ports, forces : (p, e, 6)
        Motion of and force on the input and the output of each element, in its own lattice.
    status
        SNAPPED where stability is lost on the way: the last point is the last state before.
    reached
        Part of the stroke that is stable, 0 to 1.
    """

    motion: NDArray[np.float64]
    input_force: NDArray[np.float64]
    output: NDArray[np.float64]
    energy: NDArray[np.float64]
    blocks: NDArray[np.float64]
    ports: NDArray[np.float64]
    forces: NDArray[np.float64]
    status: Status
    reached: float

    @property
    def efficiency(self) -> NDArray[np.float64]:
        """(p,) output motion over input motion; nan at rest."""
        efficiency = np.full_like(self.output, np.nan)
        efficiency[1:] = self.output[1:] / self.motion[1:]
        return efficiency


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """Where the machine is: its blocks (b, 3), and the memory of each element."""

    q: NDArray[np.float64]
    memories: tuple[Any, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """The machine to first order around a place: force (3 b,), stiffness (3 b, 3 b)."""

    force: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    felt: tuple[Felt, ...]

    @property
    def departure(self) -> float:
        return max(each.departure for each in self.felt)


class _Chain:
    """Blocks and elements, one for each of their members."""

    def __init__(self, blocks: Blocks, elements: Sequence[Element]) -> None:
        self.blocks, self.elements = blocks, tuple(elements)
        self.rest = _Place(
            np.zeros_like(blocks.stroke), tuple(element.begin() for element in elements)
        )
        found = self.around(self.rest)
        if found is None:
            raise InvalidFile(f"{blocks.source}: a part is not stable at rest")
        self.at_rest = found
        # Blocks that nothing at all resists, as of a port that its part has lost, stay at rest.
        self.free = np.repeat(~blocks.driven, 3) & found.stiffness.any(axis=1)
        self._check_held()

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

    def around(self, place: _Place) -> _Found | None:
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
        return _Found(force, stiffness, tuple(felt))

    def tangent(self, found: _Found, part: float) -> NDArray[np.float64]:
        """(b, 3) motion of the blocks when the drive goes on by a part of its stroke."""
        moved = np.where(self.blocks.driven[:, None], part * self.blocks.stroke, 0.0).ravel()
        moved[self.free] = self._solve(found, -found.stiffness[self.free] @ moved)
        return moved.reshape(-1, 3)

    def _solve(self, found: _Found, right: NDArray[np.float64]) -> NDArray[np.float64]:
        own = found.stiffness[np.ix_(self.free, self.free)]
        return np.asarray(np.linalg.solve(own, right)) if len(own) else right

    def lowest(self, found: _Found) -> tuple[float, float]:
        """Return the lowest and the largest stiffness of the free blocks."""
        own = found.stiffness[np.ix_(self.free, self.free)]
        if not len(own):
            return np.inf, 0.0
        values = np.linalg.eigvalsh(own)
        return float(values[0]), float(values[-1])

    def moved(self, place: _Place, found: _Found, step: NDArray[np.float64]) -> _Place:
        """Move the blocks by a step (b, 3), and the elements with them."""
        q = place.q + step
        memories = [
            felt.advance(self.ports(q, member) - self.ports(place.q, member))
            for member, felt in zip(self.blocks.members, found.felt, strict=True)
        ]
        return _Place(q, tuple(memories))

    def settle(self, place: _Place) -> tuple[_Place, _Found] | None:
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

    def advance(self, place: _Place, found: _Found, part: float) -> tuple[_Place, _Found] | None:
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


@dataclass(frozen=True, slots=True, eq=False)
class Straight:
    """What a machine of blocks would do if it were linear.

    Parameters
    ----------
    efficiency, input_stiffness
        For small strokes.
    ports, forces : (e, 6)
        Motion of and force on both ports of each element at the full stroke.
    """

    efficiency: float
    input_stiffness: float
    ports: NDArray[np.float64]
    forces: NDArray[np.float64]


def straight(blocks: Blocks, elements: Sequence[Element]) -> Straight:
    """Return the linear answer of a machine of blocks; parameters as for `follow_stroke`.

    Raises
    ------
    InvalidFile
        If something in the machine swings freely, or is not stable at rest.
    """
    chain = _Chain(blocks, elements)
    q = chain.tangent(chain.at_rest, 1.0)
    ports = np.array(
        [
            np.concatenate([arm.motions(np.zeros(3)) @ q[arm.block] for arm in member.arms])
            for member in blocks.members
        ]
    )
    felt = chain.at_rest.felt
    stroke = blocks.stroke.ravel()
    return Straight(
        efficiency=blocks.output_slope(q) / blocks.amount,
        input_stiffness=float(stroke @ chain.at_rest.stiffness @ q.ravel()) / blocks.amount**2,
        ports=ports,
        forces=np.array([each.stiffness @ way for each, way in zip(felt, ports, strict=True)]),
    )


def follow_stroke(blocks: Blocks, elements: Sequence[Element], points: int) -> Stroke:
    """Drive a machine from rest to its full stroke.

    Parameters
    ----------
    blocks
    elements
        One for each member of the blocks.
    points
        Number of equal increments.

    Raises
    ------
    InvalidFile
        If something in the machine swings freely, or is not stable at rest.
    """
    chain = _Chain(blocks, elements)
    places, founds = [chain.rest], [chain.at_rest]
    parts, increment = [0.0], 1.0 / points
    done = 0.0
    place, found = chain.rest, chain.at_rest
    for number in range(points):
        goal = (number + 1) / points
        while done < goal and increment >= SMALLEST_INCREMENT / points:
            end = min(goal, done + increment)
            arrived = chain.advance(place, found, end - done)
            if arrived is None:
                increment = 0.5 * (end - done)
                continue
            (place, found), done = arrived, end
            increment = 2.0 * increment
        if done > parts[-1]:
            places.append(place)
            founds.append(found)
            parts.append(done)
        if done < goal:
            break
    return _told(chain, places, founds, np.array(parts))


def _told(
    chain: _Chain, places: list[_Place], founds: list[_Found], parts: NDArray[np.float64]
) -> Stroke:
    blocks = chain.blocks
    along = blocks.stroke.ravel() / blocks.amount
    return Stroke(
        motion=parts * blocks.amount,
        input_force=np.array([along @ found.force for found in founds]),
        output=np.array([blocks.output(place.q) for place in places]),
        energy=np.array([sum(felt.energy for felt in found.felt) for found in founds]),
        blocks=np.array([place.q for place in places]),
        ports=np.array(
            [[chain.ports(place.q, member) for member in blocks.members] for place in places]
        ),
        forces=np.array([[felt.force for felt in found.felt] for found in founds]),
        status=Status.CONVERGED if parts[-1] == 1.0 else Status.SNAPPED,
        reached=float(parts[-1]),
    )
