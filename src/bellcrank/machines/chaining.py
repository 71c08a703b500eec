"""What a machine does, foretold from what each of its parts does: a chain of superelements.

Every part is condensed to the nodes of its two ports, as `bellcrank.mechanics.Superelement`; the
machine is the sum of its parts over those nodes, less what they have in common: beams within a
welded port belong to both parts and count once. In the linear range that is exact where no gap
between neighbouring beams of a node lies between beams of two parts, as where the hexagons of
`bellcrank.machines.elementary` are linked side by side; elsewhere the angular springs in such gaps
are not foreseen.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile
from bellcrank.mechanics import Loose, Superelement
from bellcrank.model import Design, Input, Lattice, Output, Problem, Supports

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.machines.assembly import Machine
    from bellcrank.machines.placing import Part

LOOSE = 1e-12
"""Stiffness of the softest motion, beside the stiffest, of what counts as held."""


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """The linear answer of a machine, around rest.

    Parameters
    ----------
    efficiency
        Mean output motion over mean input motion.
    input_stiffness
        Force on all input nodes along their directions, over the input motion; lattice units.
    motion : dict of (2,)
        Of each node in a port, by its number in the machine, for an input of 1.
    """

    efficiency: float
    input_stiffness: float
    motion: dict[int, NDArray[np.float64]]


def predict(machine: Machine) -> Prediction:
    """Chain the parts of a machine that is driven by displacements.

    Raises
    ------
    InvalidFile
        If it is driven by forces, or something in it swings freely.
    """
    problem, source = machine.design.problem, machine.plan.source
    if problem.input.drive != "displacement":
        raise InvalidFile(f"{source}: only machines driven by a displacement are chained")
    ports = [machine.port_nodes(port) for port in machine.ports]
    nodes = np.unique(np.concatenate(ports))
    stiffness = np.zeros((2 * len(nodes), 2 * len(nodes)))

    def add(sign: float, design: Design, grips: list[NDArray[np.int64]], names: NDArray[np.int64]
            ) -> None:  # fmt: skip
        """Add an element by the nodes that it is gripped at, which `names` calls the machine's."""
        own = Superelement(design, [Loose(grip) for grip in grips]).rest().stiffness
        place = np.searchsorted(nodes, names[np.concatenate(grips)])
        rows = (2 * place[:, None] + np.arange(2)).ravel()
        np.add.at(stiffness, np.ix_(rows, rows), sign * own)

    for name, part in machine.parts.items():
        regions = [part.region(port).nodes for port in ("input", "output")]
        add(1.0, placed(part), regions, machine.nodes[name])
    for link in machine.plan.links:
        ends = [machine.port_nodes(port) for port in (link.first, link.second)]
        if link.kind == "bridge":
            design, names = _piece(machine, ends, bridged=True)
            add(1.0, design, [np.searchsorted(names, end) for end in ends], names)
            shared = ends
        else:
            shared = [np.intersect1d(ends[0], ends[1])]
        for each in shared:
            design, names = _piece(machine, [each])
            add(-1.0, design, [np.arange(len(names))], names)
    return _answer(machine, nodes, stiffness)


def _answer(
    machine: Machine, nodes: NDArray[np.int64], stiffness: NDArray[np.float64]
) -> Prediction:
    """Move the input by 1, and solve for all other nodes."""
    drive, wanted = machine.design.problem.input, machine.design.problem.output
    moved = np.repeat(np.isin(nodes, drive.nodes), 2)
    motion = np.zeros((len(nodes), 2))
    motion[np.searchsorted(nodes, drive.nodes)] = drive.direction
    flat = motion.reshape(-1)
    live = stiffness.any(axis=1) & ~moved
    own = stiffness[np.ix_(live, live)]
    if live.any():
        softest, *_, stiffest = np.linalg.eigvalsh(own)
        if softest <= LOOSE * stiffest:
            raise InvalidFile(f"{machine.plan.source}: something in the machine swings freely")
        flat[live] = np.linalg.solve(own, -stiffness[live] @ flat)
    given = np.where(moved, flat, 0.0)
    travel = motion[np.searchsorted(nodes, wanted.nodes)]
    return Prediction(
        float((travel * wanted.direction).sum(axis=1).mean()),
        float(given @ stiffness @ flat),
        dict(zip(nodes.tolist(), motion, strict=True)),
    )


def placed(part: Part) -> Design:
    """Return a part in its place as a design of its own."""
    problem = part.design.problem
    there = Problem(
        name=f"{problem.name} as {part.name}",
        lattice=Lattice(part.positions, problem.lattice.beams),
        supports=problem.supports if part.supported else Supports(),
        input=replace(problem.input, direction=part.direction("input"), drive="displacement"),
        output=Output(problem.output.nodes, part.direction("output")),
        stiffness=problem.stiffness,
        designable=problem.designable,
    )
    return Design(there, part.design.mask)


def _piece(
    machine: Machine, ends: list[NDArray[np.int64]], *, bridged: bool = False
) -> tuple[Design, NDArray[np.int64]]:
    """Return the beams within ports, with a bridge's, as a design; and its nodes' numbers."""
    problem = machine.design.problem
    beams, nodes = problem.lattice.beams, np.unique(np.concatenate(ends))
    own = np.any([np.isin(beams, end).all(axis=1) for end in ends], axis=0) & machine.design.mask
    if bridged:
        own[machine.bridges] = True
        nodes = np.union1d(nodes, beams[machine.bridges])
    along = np.array([1.0, 0.0])  # whatever: this piece is only condensed
    there = Problem(
        name="link",
        lattice=Lattice(problem.lattice.positions[nodes], np.searchsorted(nodes, beams[own])),
        supports=Supports(),
        input=Input(np.array([0]), along, "displacement", 1.0),
        output=Output(np.array([len(nodes) - 1]), along),
        stiffness=problem.stiffness,
        designable=np.array([0]),
    )
    return there.full_design(), nodes
