"""How a part is held and driven: by its hubs.

Clamps hold all of a hub. Everything else grips the mean displacement of a hub, which may turn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.part.part import Part


@dataclass(frozen=True, slots=True)
class Grip:
    """What acts on one component of the mean displacement of one hub.

    Parameters
    ----------
    node
        The lattice's.
    direction
        Unit vector of the component, of two or three numbers.
    motion
        That it is given at the full stroke, mm.
    spring
        Stiffness in N / mm of a spring to a ground that is moved so; inf if it is given exactly.
    """

    node: int
    direction: tuple[float, ...]
    motion: float = 0.0
    spring: float = math.inf


@dataclass(frozen=True, slots=True, eq=False)
class Grips:
    """All that holds and drives a part.

    Parameters
    ----------
    clamped : (c,) int64
        Nodes of the lattice whose hubs do not move at all.
    means
        Grips on mean displacements.
    pushed : (p,) int64
        Nodes of the lattice whose hubs are pushed.
    force : (p, 2)
        On them at the full load, N.
    """

    clamped: NDArray[np.int64]
    means: tuple[Grip, ...]
    pushed: NDArray[np.int64]
    force: NDArray[np.float64]


def grips_of(part: Part, hubs: NDArray[np.int64], dimension: int) -> Grips:
    """Hold and drive the hubs of a part as its problem says.

    In space driven hubs and those on rollers stay in the plane, in the mean.

    Parameters
    ----------
    hubs
        Nodes of the lattice that have one.
    dimension
        2 in the plane, 3 in space.
    """
    problem = part.design.problem
    supports, given, output = problem.supports, problem.input, problem.output
    axes = [tuple(row) for row in np.eye(dimension).tolist()]
    means: list[Grip] = []
    for nodes, held in ((supports.fixed_x, 0), (supports.fixed_y, 1)):
        for node in np.intersect1d(nodes, hubs).tolist():
            means += [Grip(node, axis) for axis in (axes[held], *axes[2:])]
    there = np.isin(given.nodes, hubs)
    pushed, force = np.empty(0, dtype=np.int64), np.empty((0, 2))
    if given.drive == "displacement":
        whole = given.amount * part.scale * given.direction[there]
        for node, motion in zip(given.nodes[there].tolist(), whole.tolist(), strict=True):
            means += [Grip(node, axis, move) for axis, move in zip(axes, motion, strict=False)]
            means += [Grip(node, axis) for axis in axes[2:]]
    else:
        unit = part.stiffness_unit * part.scale
        pushed, force = given.nodes[there], given.amount * unit * given.direction[there]
    if output.spring is not None:
        spring = output.spring * part.stiffness_unit
        there = np.isin(output.nodes, hubs)
        for node, along in zip(
            output.nodes[there].tolist(), output.direction[there].tolist(), strict=True
        ):
            isotropic = output.spring_kind == "isotropic"
            ways = axes[:2] if isotropic else [(*along, *axes[0][2:])]
            means += [Grip(node, way, spring=spring) for way in ways]
    return Grips(np.intersect1d(supports.fixed, hubs), tuple(means), pushed, force)
