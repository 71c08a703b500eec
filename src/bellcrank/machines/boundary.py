"""What holds a machine, what drives it, what it moves, and what a search may change."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile
from bellcrank.machines.plan import welded
from bellcrank.model import Input, Output, Supports

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.machines.placing import Part
    from bellcrank.machines.plan import Directions, Plan, PortName
    from bellcrank.model import Lattice


def supports(plan: Plan, parts: dict[str, Part], nodes: dict[str, NDArray[np.int64]]) -> Supports:
    """Return the supports of all parts that hold.

    Raises
    ------
    InvalidFile
        If a part on rollers is turned out of its axes.
    """
    fixed: list[NDArray[np.int64]] = []
    rollers: dict[str, list[NDArray[np.int64]]] = {"x": [], "y": []}
    for name, part in parts.items():
        if not part.supported:
            continue
        own = part.design.problem.supports
        fixed.append(nodes[name][own.fixed])
        for axis, given in (("x", own.fixed_x), ("y", own.fixed_y)):
            if len(given) and part.placement.rotate % 180:
                raise InvalidFile(
                    f"{plan.source}: part {name} stands on rollers along an axis and cannot be "
                    f"turned by {part.placement.rotate} degrees"
                )
            rollers[axis].append(nodes[name][given])
    return Supports(
        fixed=_together(fixed), fixed_x=_together(rollers["x"]), fixed_y=_together(rollers["y"])
    )


def drive(plan: Plan, parts: dict[str, Part], nodes: dict[str, NDArray[np.int64]]) -> Input:
    """Return the machine's input; what the plan leaves open is as in its first part.

    Raises
    ------
    InvalidFile
        If it is driven in another way than that part, and the plan does not say how far.
    """
    table = plan.table.input
    ids, directions = _region(plan.inputs, parts, nodes, table.direction)
    first = parts[plan.inputs[0].part]
    own = first.design.problem.input
    chosen = table.drive or own.drive
    if table.amount is None and chosen != own.drive:
        raise InvalidFile(
            f"{plan.source}: input.amount: must be given, for {first.name} is driven by a "
            f"{own.drive}, and how much that is says nothing about a {chosen}"
        )
    amount = own.amount * first.placement.scale if table.amount is None else table.amount
    return Input(ids, directions, chosen, amount)


def moved(plan: Plan, parts: dict[str, Part], nodes: dict[str, NDArray[np.int64]]) -> Output:
    """Return the machine's output."""
    ids, directions = _region(plan.outputs, parts, nodes, plan.table.output.direction)
    return Output(ids, directions)


def designable(
    plan: Plan,
    parts: dict[str, Part],
    nodes: dict[str, NDArray[np.int64]],
    beams: NDArray[np.int64],
    regions: tuple[Supports, Input, Output],
) -> NDArray[np.int64]:
    """Return what a search may change: all but what touches a region or lies within a port."""
    taken = np.concatenate([region.nodes for region in regions])
    free = ~np.isin(beams, taken).any(axis=1)
    for link in plan.links:
        for port in (link.first, link.second):
            own = nodes[port.part][parts[port.part].region(port.port).nodes]
            free &= ~np.isin(beams, own).all(axis=1)
    return np.flatnonzero(free)


def check_drive(plan: Plan) -> None:
    """Refuse to drive by hand what another part drives.

    Raises
    ------
    InvalidFile
    """
    together = {port: ports for ports in welded(plan) for port in ports}
    for port in plan.inputs:
        others = [other for other in together[port] if other != port]
        for link in plan.links:
            others += [
                there
                for here, there in ((link.first, link.second), (link.second, link.first))
                if link.kind == "bridge" and here in together[port]
            ]
        if driving := [other for other in others if other.port == "output"]:
            raise InvalidFile(
                f"{plan.source}: port {port} is driven by hand and by {driving[0]} at once"
            )


def check_held(
    plan: Plan,
    nodes: dict[str, NDArray[np.int64]],
    lattice: Lattice,
    held: Supports,
) -> None:
    """Refuse parts that hang together with nothing that holds them.

    Raises
    ------
    InvalidFile
    """
    firm = lattice.reachable(held.nodes)
    if loose := [name for name in nodes if not firm[nodes[name]].any()]:
        raise InvalidFile(
            f"{plan.source}: nothing holds {', '.join(loose)}: no part that hangs together with "
            f"it has a support"
        )


def _together(lists: Sequence[NDArray[np.int64]]) -> NDArray[np.int64]:
    return np.unique(np.concatenate([np.empty(0, np.int64), *lists]))


def _region(
    ports: Sequence[PortName],
    parts: dict[str, Part],
    nodes: dict[str, NDArray[np.int64]],
    direction: Directions | None,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the nodes of ports, each once, with their directions."""
    wanted = None if direction is None else np.broadcast_to(direction, (len(ports), 2))
    ids, directions = [], []
    for number, port in enumerate(ports):
        part = parts[port.part]
        own = nodes[port.part][part.region(port.port).nodes]
        ids.append(own)
        if wanted is None:
            directions.append(part.direction(port.port))
        else:
            unit = wanted[number] / np.linalg.norm(wanted[number])
            directions.append(np.tile(unit, (len(own), 1)))
    every = np.concatenate(ids)
    _, first = np.unique(every, return_index=True)
    first.sort()
    return every[first], np.concatenate(directions)[first]
