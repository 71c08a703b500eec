"""Supports, input, output and designable beams of a machine."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile
from bellcrank.machines.plan import welded_ports
from bellcrank.machines.ports import check_one_motion
from bellcrank.model import Input, Output, Supports

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.machines.placement import Part
    from bellcrank.machines.plan import Directions, Plan, PortName
    from bellcrank.model import Lattice


def machine_supports(
    plan: Plan, parts: dict[str, Part], nodes: dict[str, NDArray[np.int64]]
) -> Supports:
    """Return the union of the supports of all supported parts.

    Raises
    ------
    InvalidFile
        If a part on rollers is rotated by other than a multiple of 180 degrees.
    """
    fixed: list[NDArray[np.int64]] = []
    rollers: dict[str, list[NDArray[np.int64]]] = {"x": [], "y": [], "z": []}
    for name, part in parts.items():
        if not part.supported:
            continue
        own = part.design.problem.supports
        fixed.append(nodes[name][own.fixed])
        for axis, given in (("x", own.fixed_x), ("y", own.fixed_y), ("z", own.fixed_z)):
            if len(given) and part.placement.rotate % 180 and axis != "z":
                raise InvalidFile(
                    f"{plan.source}: part {name} has roller supports and cannot be rotated by "
                    f"{part.placement.rotate} degrees; expected a multiple of 180"
                )
            rollers[axis].append(nodes[name][given])
    return Supports(
        fixed=_unique(fixed),
        **{f"fixed_{axis}": _unique(each) for axis, each in rollers.items()},
    )


def machine_input(plan: Plan, parts: dict[str, Part], nodes: dict[str, NDArray[np.int64]]) -> Input:
    """Return the input of the machine; drive and amount default to those of its first part.

    Raises
    ------
    InvalidFile
        If the plan chooses another drive than that of the part without giving the amount.
    """
    table = plan.table.input
    ids, directions = _region(plan.inputs, parts, nodes, table.direction)
    first = parts[plan.inputs[0].part]
    check_one_motion(first.design.problem)
    own = first.design.problem.input
    drive = table.drive or own.drive
    if table.amount is None and drive != own.drive:
        raise InvalidFile(
            f"{plan.source}: input.amount: required with drive {drive!r}, because part "
            f"{first.name} is driven by a {own.drive}"
        )
    amount = own.amount * first.placement.scale if table.amount is None else table.amount
    return Input(ids, directions, drive, amount)


def machine_output(
    plan: Plan, parts: dict[str, Part], nodes: dict[str, NDArray[np.int64]]
) -> Output:
    """Return the output of the machine."""
    ids, directions = _region(plan.outputs, parts, nodes, plan.table.output.direction)
    return Output(ids, directions)


def designable_beams(
    plan: Plan,
    parts: dict[str, Part],
    nodes: dict[str, NDArray[np.int64]],
    beams: NDArray[np.int64],
    regions: tuple[Supports, Input, Output],
) -> NDArray[np.int64]:
    """Return the beams that touch no region and lie within no linked port."""
    region_nodes = np.concatenate([region.nodes for region in regions])
    free = ~np.isin(beams, region_nodes).any(axis=1)
    for link in plan.links:
        for port in (link.first, link.second):
            own = nodes[port.part][parts[port.part].nodes(port.port)]
            free &= ~np.isin(beams, own).all(axis=1)
    return np.flatnonzero(free)


def check_inputs(plan: Plan) -> None:
    """Check that no input port of the machine is also driven by the output of a part.

    Raises
    ------
    InvalidFile
    """
    groups = {port: ports for ports in welded_ports(plan) for port in ports}
    for port in plan.inputs:
        linked = [other for other in groups[port] if other != port]
        for link in plan.links:
            linked += [
                there
                for here, there in ((link.first, link.second), (link.second, link.first))
                if link.kind == "bridge" and here in groups[port]
            ]
        if outputs := [other for other in linked if other.port == "output"]:
            raise InvalidFile(
                f"{plan.source}: port {port} is driven twice: by the input of the machine and by "
                f"{outputs[0]}"
            )


def check_supported(
    plan: Plan,
    nodes: dict[str, NDArray[np.int64]],
    lattice: Lattice,
    supports: Supports,
) -> None:
    """Check that every part is connected to a support.

    Raises
    ------
    InvalidFile
    """
    connected = lattice.reachable(supports.nodes)
    if loose := [name for name in nodes if not connected[nodes[name]].any()]:
        raise InvalidFile(
            f"{plan.source}: parts without support: {', '.join(loose)}; neither they nor the "
            f"parts they are linked to have one"
        )


def _unique(lists: Sequence[NDArray[np.int64]]) -> NDArray[np.int64]:
    return np.unique(np.concatenate([np.empty(0, np.int64), *lists]))


def _region(
    ports: Sequence[PortName],
    parts: dict[str, Part],
    nodes: dict[str, NDArray[np.int64]],
    direction: Directions | None,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the nodes of some ports, each once, with their unit directions."""
    given = (
        None if direction is None else np.broadcast_to(direction, (len(ports), len(direction[0])))
    )
    ids, directions = [], []
    for number, port in enumerate(ports):
        part = parts[port.part]
        own = nodes[port.part][part.nodes(port.port)]
        ids.append(own)
        if given is None:
            directions.append(part.direction(port.port))
        else:
            unit = given[number] / np.linalg.norm(given[number])
            directions.append(np.tile(unit, (len(own), 1)))
    every = np.concatenate(ids)
    _, first = np.unique(every, return_index=True)
    first.sort()
    return every[first], np.concatenate(directions)[first]
