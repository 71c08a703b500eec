"""Assembly of a machine: the parts of a plan in one lattice, an ordinary problem and design.

A beam that two parts share occurs once, and is present if it is present in either part.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile, InvalidProblem
from bellcrank.machines.boundary import (
    check_inputs,
    check_supported,
    designable_beams,
    machine_input,
    machine_output,
    machine_supports,
)
from bellcrank.machines.bridges import bridge
from bellcrank.machines.curves import Load, PortCurve, trace
from bellcrank.machines.node_merging import merge_nodes, unique_rows
from bellcrank.machines.placement import place_parts
from bellcrank.machines.ports import mean_ports
from bellcrank.mechanics.contact import near_pairs
from bellcrank.mechanics.frames.joints import with_joints
from bellcrank.model import Design, Lattice, Problem

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.machines.placement import Part
    from bellcrank.machines.plan import Plan, PortName
    from bellcrank.model import Section

END_INSET = 1e-6
"""Fraction of its length by which each beam is shortened at both ends before crossings are
searched, so that beams that share a node do not cross."""


@dataclass(frozen=True, slots=True, eq=False)
class Machine:
    """An assembled machine: its parts, and the one lattice that they form.

    Parameters
    ----------
    plan, parts
        The plan, and its parts at their positions.
    design
        The whole machine as an ordinary design.
    nodes
        For each part, the machine's node number of each of its nodes.
    beams
        For each part, the machine's beam number of each of its beams.
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
        return self.plan.ports

    def port_nodes(self, port: PortName) -> NDArray[np.int64]:
        """Return the machine's node numbers of a port."""
        return self.nodes[port.part][self.parts[port.part].nodes(port.port)]


def assemble(plan: Plan, find: Callable[[str], Design]) -> Machine:
    """Assemble the machine that a plan describes.

    Parameters
    ----------
    plan
        The plan.
    find
        Function from the entry of a part (a name or a file) to its design.

    Raises
    ------
    InvalidFile
        If an entry does not exist, welded ports do not meet, parts overlap, a port is driven both
        by the machine's input and by a part, a port lies on supports, a group of parts has no
        support, or parts have different models, sections or materials. The message names the parts.
    """
    check_inputs(plan)
    parts = place_parts(plan, find)
    nodes, positions = merge_nodes(plan, parts)
    beams, numbers, present = _merge_beams(plan, parts, nodes, positions)
    widths = _merge_widths(parts, numbers, len(beams))
    count = len(beams)
    positions, beams = _add_bridges(plan, parts, nodes, positions, beams)
    present = np.concatenate([present, np.ones(len(beams) - count, np.bool_)])
    supports = machine_supports(plan, parts, nodes)
    given, wanted = machine_input(plan, parts, nodes), machine_output(plan, parts, nodes)
    model = next(iter(parts.values())).design.problem
    try:
        lattice = Lattice(positions, beams)
        check_supported(plan, nodes, lattice, supports)
        problem = Problem(
            name=plan.table.name,
            lattice=lattice,
            supports=supports,
            input=given,
            output=wanted,
            stiffness=model.stiffness,
            section=model.section,
            material=model.material,
            widths=_with_bridges(widths, model.section, len(beams)),
            initial=present,
            designable=designable_beams(plan, parts, nodes, beams, (supports, given, wanted)),
        )
    except InvalidProblem as error:
        raise InvalidFile(f"{plan.source}: {error}") from None
    if any(part.design.problem.joints is not None for part in parts.values()):
        problem = with_joints(problem, present)
    origin = {"plan": plan.table.model_dump(by_alias=True, exclude_defaults=True)}
    return Machine(
        plan, parts, Design(problem, present, provenance=origin), nodes, numbers,
        np.arange(count, len(beams)),
    )  # fmt: skip


def simulate(machine: Machine, points: int = 20) -> PortCurve:
    """Simulate the whole lattice of a machine along its stroke, with a free output.

    Parameters
    ----------
    points
        Number of equal increments of the stroke.
    """
    return trace(mean_ports(machine.design), Load("free"), points)


def first_crossing(
    positions: NDArray[np.float64], beams: NDArray[np.int64], owner: NDArray[np.int64]
) -> tuple[int, int] | None:
    """Return two crossing beams of different owners; None if no two cross.

    Parameters
    ----------
    positions : (N, 2) float64
    beams : (M, 2) int64
    owner : (M,) int64

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> first_crossing(square, np.array([[0, 2], [1, 3]]), np.array([0, 1]))
    (0, 1)
    >>> first_crossing(square, np.array([[0, 2], [2, 3]]), np.array([0, 1])) is None
    True
    """
    import shapely

    start, end = positions[beams[:, 0]], positions[beams[:, 1]]
    inset = END_INSET * (end - start)
    lines = shapely.linestrings(np.stack([start + inset, end - inset], axis=1))
    first, second = shapely.STRtree(lines).query(lines, predicate="intersects")
    bad = np.flatnonzero((first < second) & (owner[first] != owner[second]))
    return (int(first[bad[0]]), int(second[bad[0]])) if len(bad) else None


def first_touching(
    positions: NDArray[np.float64],
    beams: NDArray[np.int64],
    owner: NDArray[np.int64],
    width: float,
) -> tuple[int, int] | None:
    """Return two beams in space of different owners that touch; None if no two do.

    Parameters
    ----------
    positions : (N, 3) float64
    beams : (M, 2) int64
    owner : (M,) int64
    width
        Distance of the beams below which they touch.
    """
    pairs, _ = near_pairs(positions, beams, width)
    found = pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]]]
    return (int(found[0, 0]), int(found[0, 1])) if len(found) else None


def _merge_beams(
    plan: Plan,
    parts: dict[str, Part],
    nodes: dict[str, NDArray[np.int64]],
    positions: NDArray[np.float64],
) -> tuple[NDArray[np.int64], dict[str, NDArray[np.int64]], NDArray[np.bool_]]:
    """Return the beams of all parts, the beam numbers of each part, and the present beams."""
    ends = [nodes[name][part.design.problem.lattice.beams] for name, part in parts.items()]
    every = np.concatenate(ends)
    first, number = unique_rows(np.sort(every, axis=1))
    beams = every[first]
    names = list(parts)
    splits = np.cumsum([len(each) for each in ends])[:-1]
    numbers = dict(zip(names, np.split(number, splits), strict=True))
    owner, present = np.empty(len(beams), np.int64), np.zeros(len(beams), np.bool_)
    for index, (name, part) in enumerate(parts.items()):
        owner[numbers[name]] = index
        present[numbers[name][part.design.mask]] = True
    section = parts[names[0]].design.problem.section
    if positions.shape[1] == 3:
        assert section is not None
        crossing = first_touching(positions, beams, owner, section.width)
    else:
        crossing = first_crossing(positions, beams, owner)
    if crossing is not None:
        one, other = (names[owner[beam]] for beam in crossing)
        point = ", ".join(f"{each:.4g}" for each in positions[beams[crossing[0]]].mean(axis=0))
        raise InvalidFile(
            f"{plan.source}: parts {one} and {other} overlap: their beams cross near ({point})"
        )
    return beams, numbers, present


def _merge_widths(
    parts: dict[str, Part], numbers: dict[str, NDArray[np.int64]], count: int
) -> NDArray[np.float64] | None:
    """Return (count,) the widths of the beams; None if all have that of the section.

    A beam that is present in two parts has the larger of its widths.
    """
    problems = {name: part.design.problem for name, part in parts.items()}
    if all(problem.widths is None for problem in problems.values()):
        return None
    section = next(iter(problems.values())).section
    assert section is not None
    widths = np.zeros(count)
    for name, part in parts.items():
        mask = part.design.mask
        own = numbers[name][mask]
        widths[own] = np.maximum(widths[own], problems[name].beam_widths[mask])
    return np.where(widths > 0.0, widths, section.width)


def _with_bridges(
    widths: NDArray[np.float64] | None, section: Section | None, count: int
) -> NDArray[np.float64] | None:
    """Return widths (count,) with those of bridges, which have that of the section, appended."""
    if widths is None:
        return None
    assert section is not None
    return np.concatenate([widths, np.full(count - len(widths), section.width)])


def _add_bridges(
    plan: Plan,
    parts: dict[str, Part],
    nodes: dict[str, NDArray[np.int64]],
    positions: NDArray[np.float64],
    beams: NDArray[np.int64],
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return positions and beams with those of all bridges appended."""
    for link in plan.links:
        if link.kind == "bridge":
            if positions.shape[1] == 3:
                raise InvalidFile(
                    f"{plan.source}: bridge from {link.first} to {link.second}: expected parts in "
                    "the plane; in space weld ports"
                )
            ports = [
                nodes[port.part][parts[port.part].nodes(port.port)]
                for port in (link.first, link.second)
            ]
            positions, made = bridge(
                positions, beams, ports, parts[link.first.part].spacing,
                f"{plan.source}: bridge from {link.first} to {link.second}",
            )  # fmt: skip
            beams = np.concatenate([beams, made])
    return positions, beams
