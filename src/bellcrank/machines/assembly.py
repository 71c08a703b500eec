"""One lattice of many parts: an ordinary problem and design.

A beam that two parts share is there once, and present if it is in either.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile, InvalidProblem
from bellcrank.machines.boundary import check_drive, check_held, designable, drive, moved, supports
from bellcrank.machines.bridges import bridge
from bellcrank.machines.crossings import first_crossing
from bellcrank.machines.placing import place_parts
from bellcrank.machines.plan import PORTS, PortName
from bellcrank.machines.union import numbered, unite
from bellcrank.model import Design, Lattice, Problem

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.machines.placing import Part
    from bellcrank.machines.plan import Plan


@dataclass(frozen=True, slots=True, eq=False)
class Machine:
    """Parts in their places, and the one lattice that they make.

    Parameters
    ----------
    plan, parts
        What it was built from.
    design
        All of it, an ordinary design.
    nodes
        For each part, the number in the machine of each of its nodes.
    beams
        For each part, the number in the machine of each of its beams.
    bridges : (b,) int64
        Numbers of the beams that belong to no part.
    """

    plan: Plan
    parts: dict[str, Part]
    design: Design
    nodes: dict[str, NDArray[np.int64]]
    beams: dict[str, NDArray[np.int64]]
    bridges: NDArray[np.int64]

    @property
    def ports(self) -> list[PortName]:
        """All ports of all parts."""
        return [PortName(name, port) for name in self.parts for port in PORTS]

    def port_nodes(self, port: PortName) -> NDArray[np.int64]:
        """Return the nodes of a port, by their numbers in the machine."""
        return self.nodes[port.part][self.parts[port.part].region(port.port).nodes]


def assemble(plan: Plan, find: Callable[[str], Design]) -> Machine:
    """Build what a plan describes.

    Parameters
    ----------
    plan
        What to build.
    find
        Returns the design that an entry's name or a file stands for.

    Raises
    ------
    InvalidFile
        With the parts' names: if ports that are welded do not meet, parts overlap, a port is
        driven by hand and by another part or lies on supports, or parts hang together with no
        support. Also if there is no such entry.
    """
    check_drive(plan)
    parts = place_parts(plan, find)
    nodes, positions = unite(plan, parts)
    beams, numbers, present = _beams(plan, parts, nodes, positions)
    count = len(beams)
    positions, beams = _bridged(plan, parts, nodes, positions, beams)
    present = np.concatenate([present, np.ones(len(beams) - count, np.bool_)])
    held = supports(plan, parts, nodes)
    driven, wanted = drive(plan, parts, nodes), moved(plan, parts, nodes)
    try:
        lattice = Lattice(positions, beams)
        check_held(plan, nodes, lattice, held)
        problem = Problem(
            name=plan.table.name,
            lattice=lattice,
            supports=held,
            input=driven,
            output=wanted,
            stiffness=next(iter(parts.values())).design.problem.stiffness,
            initial=present,
            designable=designable(plan, parts, nodes, beams, (held, driven, wanted)),
        )
    except InvalidProblem as error:
        raise InvalidFile(f"{plan.source}: {error}") from None
    origin = {"plan": plan.table.model_dump(by_alias=True, exclude_defaults=True)}
    return Machine(
        plan, parts, Design(problem, present, provenance=origin), nodes, numbers,
        np.arange(count, len(beams)),
    )  # fmt: skip


def _beams(
    plan: Plan,
    parts: dict[str, Part],
    nodes: dict[str, NDArray[np.int64]],
    positions: NDArray[np.float64],
) -> tuple[NDArray[np.int64], dict[str, NDArray[np.int64]], NDArray[np.bool_]]:
    """Return the beams of all parts, the numbers of each part's, and which are present."""
    given = [nodes[name][part.design.problem.lattice.beams] for name, part in parts.items()]
    every = np.concatenate(given)
    first, number = numbered(np.sort(every, axis=1))
    beams = every[first]
    ends = np.cumsum([0, *map(len, given)])
    names = list(parts)
    numbers = {name: number[ends[k] : ends[k + 1]] for k, name in enumerate(names)}
    owner, present = np.empty(len(beams), np.int64), np.zeros(len(beams), np.bool_)
    for place, (name, part) in enumerate(parts.items()):
        owner[numbers[name]] = place
        present[numbers[name][part.design.mask]] = True
    crossing = first_crossing(positions, beams, owner)
    if crossing is not None:
        one, other = (names[owner[beam]] for beam in crossing)
        x, y = positions[beams[crossing[0]]].mean(axis=0)
        raise InvalidFile(
            f"{plan.source}: parts {one} and {other} overlap: beams of theirs cross near "
            f"({x:.4g}, {y:.4g})"
        )
    return beams, numbers, present


def _bridged(
    plan: Plan,
    parts: dict[str, Part],
    nodes: dict[str, NDArray[np.int64]],
    positions: NDArray[np.float64],
    beams: NDArray[np.int64],
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return positions and beams with those of all bridges after them."""
    for link in plan.links:
        if link.kind == "bridge":
            ports = [
                nodes[port.part][parts[port.part].region(port.port).nodes]
                for port in (link.first, link.second)
            ]
            positions, made = bridge(
                positions, beams, ports, parts[link.first.part].spacing,
                f"{plan.source}: bridge from {link.first} to {link.second}",
            )  # fmt: skip
            beams = np.concatenate([beams, made])
    return positions, beams
