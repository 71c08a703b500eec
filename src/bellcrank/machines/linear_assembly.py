"""Linear response of a machine from the condensed stiffness of its parts.

Each part is condensed to the nodes of its two ports, as `bellcrank.mechanics.Superelement`. The
machine is the sum of its parts over those nodes; beams within welded ports belong to several parts
and are counted once. For small strokes the result is exact if no pair of neighbouring beams at a
node belongs to two parts, for example where hexagonal ports of parts side by side are welded.
Otherwise the angular springs between beams of different parts are missing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile, InvalidProblem, InvalidSettings
from bellcrank.machines.bridges import between_ports
from bellcrank.machines.plan import PORTS
from bellcrank.mechanics import Superelement, free_nodes
from bellcrank.model import Input, Lattice, Output, Problem, Supports

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from bellcrank.machines.assembly import Machine

SINGULAR = 1e-12
"""Ratio of the smallest to the largest eigenvalue at which a stiffness counts as singular."""


@dataclass(frozen=True, slots=True)
class LinearResponse:
    """Linear response of a machine around rest.

    Parameters
    ----------
    efficiency
        Mean output motion over mean input motion.
    input_stiffness
        Total force on the input nodes along their directions over the input motion; lattice
        units.
    """

    efficiency: float
    input_stiffness: float


def linear_assembly(machine: Machine) -> LinearResponse:
    """Assemble the condensed parts of a machine that is driven by displacements, and solve.

    Raises
    ------
    InvalidFile
        If the machine is driven by forces, or its stiffness is singular.
    """
    problem, source = machine.design.problem, machine.plan.source
    if problem.input.drive != "displacement":
        raise InvalidFile(
            f"{source}: input.drive: linear assembly expects a displacement, got "
            f"{problem.input.drive!r}"
        )
    beams = problem.lattice.beams
    nodes = np.unique(np.concatenate([machine.port_nodes(port) for port in machine.ports]))
    stiffness = np.zeros((2 * len(nodes), 2 * len(nodes)))
    counted = np.zeros(len(beams), np.bool_)
    for name, selected, gripped in _pieces(machine):
        twice = selected & counted
        try:
            for sign, part, grip in (
                (1.0, selected, gripped),
                (-1.0, twice, np.intersect1d(beams[twice], gripped)),
            ):
                rows = 2 * np.searchsorted(nodes, grip)[:, None] + np.arange(2)
                rows = rows.ravel()
                stiffness[np.ix_(rows, rows)] += sign * _condensed(problem, part, grip)
        except (InvalidProblem, InvalidSettings) as error:
            raise InvalidFile(f"{source}: {name} cannot be condensed: {error}") from None
        counted[selected] = True
    return _solve(machine, nodes, stiffness)


def _pieces(machine: Machine) -> Iterator[tuple[str, NDArray[np.bool_], NDArray[np.int64]]]:
    """Yield parts and bridges: name, beams (M,) bool, and nodes of both ports."""
    lattice, present = machine.design.problem.lattice, machine.design.mask
    for name, part in machine.parts.items():
        own = np.zeros(len(present), np.bool_)
        own[machine.beams[name][part.design.mask]] = True
        ends = [machine.nodes[name][part.region(port).nodes] for port in PORTS]
        yield f"part {name}", own, np.concatenate(ends)
    for link in machine.plan.links:
        if link.kind == "bridge":
            ends = [machine.port_nodes(port) for port in (link.first, link.second)]
            own = np.zeros(len(present), np.bool_)
            for end in ends:
                own |= present & np.isin(lattice.beams, end).all(axis=1)
            made = machine.bridges
            own[made[between_ports(lattice.positions, lattice.beams[made], ends)]] = True
            yield f"the bridge to {link.second}", own, np.concatenate(ends)


def _condensed(
    problem: Problem, selected: NDArray[np.bool_], gripped: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(2 n, 2 n) stiffness of some beams, condensed to the displacements of n nodes."""
    if not selected.any():
        return np.zeros((2 * len(gripped), 2 * len(gripped)))
    lattice, supports = problem.lattice, problem.supports
    subset = np.union1d(lattice.beams[selected], gripped)
    grip = np.searchsorted(subset, gripped)
    held = {
        name: np.searchsorted(subset, np.intersect1d(getattr(supports, name), subset))
        for name in ("fixed", "fixed_x", "fixed_y")
    }
    # A superelement contains what its input reaches: all gripped nodes but one are the input.
    along = np.array([1.0, 0.0])
    piece = Problem(
        name=problem.name,
        lattice=Lattice(
            lattice.positions[subset], np.searchsorted(subset, lattice.beams[selected])
        ),
        supports=Supports(**held),
        input=Input(grip[:-1], along, "displacement", 1.0),
        output=Output(grip[-1:], along),
        stiffness=problem.stiffness,
        designable=np.array([0]),
    )
    element = Superelement(piece.full_design(), [free_nodes(grip)])
    reached = element.reached.astype(np.float64)
    condensed: NDArray[np.float64] = element.rest().stiffness * np.outer(reached, reached)
    return condensed


def _solve(
    machine: Machine, nodes: NDArray[np.int64], stiffness: NDArray[np.float64]
) -> LinearResponse:
    """Displace the input by 1, and solve for all other nodes that are connected."""
    problem, lattice = machine.design.problem, machine.design.problem.lattice
    drive, wanted = problem.input, problem.output
    present = Lattice(lattice.positions, lattice.beams[machine.design.mask])
    reached = present.reachable(np.concatenate([problem.supports.nodes, drive.nodes]))[nodes]
    prescribed = np.repeat(np.isin(nodes, drive.nodes), 2)
    motion = np.zeros((len(nodes), 2))
    motion[np.searchsorted(nodes, drive.nodes)] = drive.direction
    flat = motion.reshape(-1)
    free = stiffness.any(axis=1) & np.repeat(reached, 2) & ~prescribed
    own = stiffness[np.ix_(free, free)]
    if free.any():
        smallest, *_, largest = np.linalg.eigvalsh(own)
        if smallest <= SINGULAR * largest:
            raise InvalidFile(
                f"{machine.plan.source}: the stiffness of the machine is singular: a part of it "
                "moves without resistance"
            )
        flat[free] = np.linalg.solve(own, -stiffness[free] @ flat)
    given = np.where(prescribed, flat, 0.0)
    travel = motion[np.searchsorted(nodes, wanted.nodes)]
    return LinearResponse(
        efficiency=float((travel * wanted.direction).sum(axis=1).mean()),
        input_stiffness=float(given @ stiffness @ flat),
    )
