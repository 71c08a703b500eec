"""A machine as rigid blocks that are joined by its parts.

Ports that are welded are one block, of three coordinates: x, y and a finite rotation about the
middle of the first of them. Every part, and every bridge, holds two blocks together. What is left
out is the give of the ports themselves, and, as in `bellcrank.machines.chaining`, the angular
springs in gaps that beams of two parts share around a node.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import shapely

from bellcrank.errors import InvalidFile
from bellcrank.machines.members import ALONG, Arm, Body, Member
from bellcrank.machines.plan import PORTS, PortName, welded
from bellcrank.model import Design, Input, Lattice, Output, Problem, Supports

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.machines.assembly import Machine
    from bellcrank.machines.placing import Part
    from bellcrank.machines.plan import Link

SAME = 1e-9
"""Difference of directions within which a drive moves a port as a block."""


@dataclass(frozen=True, slots=True, eq=False)
class Blocks:
    """Blocks, what joins them, what drives some of them, and what they move.

    Parameters
    ----------
    source
        What to call the machine in an error.
    names
        Of the ports on each block.
    members
        Parts and bridges.
    stroke : (b, 3)
        Motion of each block that is driven, at the full stroke.
    driven : (b,) bool
        Which are.
    reached : (b,) bool
        Which hang together with a support or the drive; others stay at rest, as in a response.
    amount
        Of the input's motion at the full stroke.
    moved : (n,) int64
        Block that each output node sits on.
    offset, direction : (n, 2)
        Of each output node from the middle of its block, and its unit direction.
    """

    source: str
    names: tuple[tuple[PortName, ...], ...]
    members: tuple[Member, ...]
    stroke: NDArray[np.float64]
    driven: NDArray[np.bool_]
    reached: NDArray[np.bool_]
    amount: float
    moved: NDArray[np.int64]
    offset: NDArray[np.float64]
    direction: NDArray[np.float64]

    def output_slope(self, q: NDArray[np.float64]) -> float:
        """Return the mean motion of the output for small motions q (b, 3) of the blocks."""
        motion, (x, y) = q[self.moved], self.offset.T
        travel = motion[:, :2] + motion[:, 2:] * np.column_stack([-y, x])
        return float((travel * self.direction).sum(axis=1).mean())

    def output(self, q: NDArray[np.float64]) -> float:
        """Return the mean motion of the output along its directions, blocks being moved by q."""
        motion = q[self.moved]
        cosine, sine = np.cos(motion[:, 2]), np.sin(motion[:, 2])
        x, y = self.offset.T
        turned = np.column_stack([cosine * x - sine * y, sine * x + cosine * y])
        travel = motion[:, :2] + turned - self.offset
        return float((travel * self.direction).sum(axis=1).mean())


def blocks_of(machine: Machine) -> Blocks:
    """Return a machine as blocks.

    Raises
    ------
    InvalidFile
        If it is driven by forces, or a drive would bend a port; if a port is a single node, which
        cannot turn.
    """
    problem, source = machine.design.problem, machine.plan.source
    if problem.input.drive != "displacement":
        raise InvalidFile(f"{source}: only machines driven by a displacement are chained")
    for port in machine.ports:
        if len(machine.port_nodes(port)) < 2:
            raise InvalidFile(f"{source}: port {port} is a single node, and no block that can turn")
    names = welded(machine.plan)
    block = {port: number for number, ports in enumerate(names) for port in ports}
    middles = np.array([_centre(machine, ports[0]) for ports in names])

    def arm(port: PortName, frame: NDArray[np.float64]) -> Arm:
        number = block[port]
        return Arm(number, _centre(machine, port) - middles[number], frame)

    members = []
    bodies: dict[tuple[str, float, bool], Body] = {}
    for name, part in machine.parts.items():
        frame = _frame(part)
        arms = tuple(arm(PortName(name, port), frame) for port in PORTS)
        kind = (machine.plan.table.parts[name].entry, part.placement.scale, part.supported)
        body = bodies.setdefault(kind, _body(part))
        members.append(Member(name, body, (arms[0], arms[1])))
    for link in machine.plan.links:
        if link.kind == "bridge":
            body = _bridge(machine, link)
            arms = (arm(link.first, np.eye(3)), arm(link.second, np.eye(3)))
            name = f"the bridge to {link.second}"
            members.append(Member(name, body, arms))
    stroke, driven = _drive(machine, names)
    lattice = Lattice(problem.lattice.positions, problem.lattice.beams[machine.design.mask])
    held = lattice.reachable(np.concatenate([problem.supports.nodes, problem.input.nodes]))
    reached = np.array([held[machine.port_nodes(ports[0])].any() for ports in names])
    moved, offset, direction = _moved(machine, block, middles)
    return Blocks(
        source, names, tuple(members), stroke, driven, reached, problem.input.amount, moved, offset,
        direction,
    )  # fmt: skip


def _centre(machine: Machine, port: PortName) -> NDArray[np.float64]:
    return machine.parts[port.part].centre(port.port)


def _frame(part: Part) -> NDArray[np.float64]:
    frame = np.zeros((3, 3))
    frame[:2, :2] = part.placement.turn.T
    frame[2, 2] = -1.0 if part.placement.mirror else 1.0
    return frame


def _body(part: Part) -> Body:
    """Return a part in its own lattice, in its size and with the supports it keeps.

    The same for all parts that differ by their place only: what is known of one is known of all.
    """
    problem, scale = part.design.problem, part.placement.scale
    own = Problem(
        name=problem.name,
        lattice=Lattice(problem.lattice.positions * scale, problem.lattice.beams),
        supports=problem.supports if part.supported else Supports(),
        input=replace(problem.input, amount=problem.input.amount * scale),
        output=Output(problem.output.nodes, problem.output.direction),
        stiffness=problem.stiffness,
        designable=problem.designable,
    )
    return Body(Design(own, part.design.mask), (own.input.nodes, own.output.nodes))


def _bridge(machine: Machine, link: Link) -> Body:
    """Return a bridge, with the insides of its ports."""
    problem = machine.design.problem
    ends = [machine.port_nodes(port) for port in (link.first, link.second)]
    beams = problem.lattice.beams
    chosen = np.zeros(len(beams), np.bool_)
    chosen[bridge_beams(machine, link)] = True
    for end in ends:
        chosen |= machine.design.mask & np.isin(beams, end).all(axis=1)
    kept = np.union1d(beams[chosen], np.concatenate(ends))
    first, second = (np.searchsorted(kept, end) for end in ends)
    design = Problem(
        name=f"{problem.name}: bridge from {link.first} to {link.second}",
        lattice=Lattice(problem.lattice.positions[kept], np.searchsorted(kept, beams[chosen])),
        supports=Supports(),
        input=Input(first, ALONG, "displacement", 1.0),
        output=Output(second, ALONG),
        stiffness=problem.stiffness,
        designable=np.array([0]),
    ).full_design()
    return Body(design, (first, second), alone=False)


def bridge_beams(machine: Machine, link: Link) -> NDArray[np.int64]:
    """Return the numbers of the beams of one bridge: those that lie between its ports."""
    lattice = machine.design.problem.lattice
    ends = [machine.port_nodes(port) for port in (link.first, link.second)]
    hull = shapely.MultiPoint(lattice.positions[np.concatenate(ends)]).convex_hull
    middle = lattice.positions[lattice.beams[machine.bridges]].mean(axis=1)
    near = shapely.distance(shapely.points(middle), hull) < SAME * max(hull.length, 1.0)
    found: NDArray[np.int64] = machine.bridges[near]
    return found


def _drive(
    machine: Machine, names: Sequence[tuple[PortName, ...]]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return how far each block is driven, and which are at all."""
    drive, source = machine.design.problem.input, machine.plan.source
    stroke, driven = np.zeros((len(names), 3)), np.zeros(len(names), np.bool_)
    for number, ports in enumerate(names):
        own = [machine.port_nodes(port) for port in ports if port in machine.plan.inputs]
        if own:
            directions = drive.direction[np.isin(drive.nodes, np.concatenate(own))]
            if np.abs(directions - directions[0]).max() > SAME:
                raise InvalidFile(f"{source}: the drive moves the nodes of {ports[0]} apart")
            stroke[number, :2] = drive.amount * directions[0]
            driven[number] = True
    return stroke, driven


def _moved(
    machine: Machine, block: dict[PortName, int], middles: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the block of each output node, its place on it, and its direction."""
    wanted, positions = machine.design.problem.output, machine.design.problem.lattice.positions
    sits = np.zeros(len(wanted.nodes), np.int64)
    for port in machine.plan.outputs:
        sits[np.isin(wanted.nodes, machine.port_nodes(port))] = block[port]
    return sits, positions[wanted.nodes] - middles[sits], wanted.direction
