"""A machine of blocks along its whole stroke, from rest, on one stable path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.machines.equilibria import Chain
from bellcrank.mechanics import Status
from bellcrank.mechanics.following import SMALLEST_INCREMENT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.machines.blocks import Blocks
    from bellcrank.machines.elements import Element
    from bellcrank.machines.equilibria import Found, Place


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
    chain = Chain(blocks, elements)
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
    chain = Chain(blocks, elements)
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
    chain: Chain, places: list[Place], founds: list[Found], parts: NDArray[np.float64]
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
