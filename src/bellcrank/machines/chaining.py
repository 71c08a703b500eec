"""What a machine does, foretold from what each of its parts does: a chain of superelements.

Every part is condensed to the nodes of its two ports, as `bellcrank.mechanics.Superelement`; the
machine is the sum of its parts over those nodes, less what they have in common: beams within
welded ports belong to several parts and count once. In the linear range that is exact where no gap
between neighbouring beams of a node lies between beams of two parts, as where the hexagons of
`bellcrank.machines.elementary` are linked side by side; elsewhere the angular springs in such gaps
are not foreseen.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile, InvalidProblem, InvalidSettings
from bellcrank.machines.blocks import bridge_beams
from bellcrank.mechanics import Loose, Superelement
from bellcrank.model import Input, Lattice, Output, Problem, Supports

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.machines.assembly import Machine

LOOSE = 1e-12
"""Stiffness of the softest motion, beside the stiffest, of what counts as held."""


@dataclass(frozen=True, slots=True)
class Prediction:
    """The linear answer of a machine, around rest.

    Parameters
    ----------
    efficiency
        Mean output motion over mean input motion.
    input_stiffness
        Force on all input nodes along their directions, over the input motion; lattice units.
    """

    efficiency: float
    input_stiffness: float


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
    present, beams = machine.design.mask, problem.lattice.beams
    nodes = np.unique(np.concatenate([machine.port_nodes(port) for port in machine.ports]))
    stiffness = np.zeros((2 * len(nodes), 2 * len(nodes)))

    counted = np.zeros(len(present), np.bool_)

    def put(sign: float, chosen: NDArray[np.bool_], gripped: NDArray[np.int64]) -> None:
        rows = np.searchsorted(nodes, gripped)
        rows = (2 * rows[:, None] + np.arange(2)).ravel()
        stiffness[np.ix_(rows, rows)] += sign * _condensed(problem, chosen, gripped)

    def add(chosen: NDArray[np.bool_], gripped: NDArray[np.int64], what: object) -> None:
        """Add some beams, condensed to some nodes, each beam once; errors say what they are."""
        twice = chosen & counted
        try:
            put(1.0, chosen, gripped)
            put(-1.0, twice, np.intersect1d(beams[twice], gripped))
        except (InvalidProblem, InvalidSettings) as error:
            raise InvalidFile(f"{source}: {what} cannot be chained: {error}") from None
        counted[chosen] = True

    def within(gripped: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return the present beams that begin and end in a port."""
        return present & np.isin(beams, gripped).all(axis=1)

    for name, part in machine.parts.items():
        own = np.zeros(len(present), np.bool_)
        own[machine.beams[name][part.design.mask]] = True
        ends = [machine.nodes[name][part.region(port).nodes] for port in ("input", "output")]
        add(own, np.concatenate(ends), name)
    for link in machine.plan.links:
        if link.kind == "bridge":
            ends = [machine.port_nodes(port) for port in (link.first, link.second)]
            own = within(ends[0]) | within(ends[1])
            own[bridge_beams(machine, link)] = True
            add(own, np.concatenate(ends), f"the bridge to {link.second}")
    return _answer(machine, nodes, stiffness)


def _condensed(
    problem: Problem, chosen: NDArray[np.bool_], gripped: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(2 n, 2 n) stiffness of some beams by the motions of n gripped nodes; the rest follows."""
    if not chosen.any():
        return np.zeros((2 * len(gripped), 2 * len(gripped)))
    lattice, supports = problem.lattice, problem.supports
    kept = np.union1d(lattice.beams[chosen], gripped)
    grip = np.searchsorted(kept, gripped)
    held = {
        name: np.searchsorted(kept, np.intersect1d(getattr(supports, name), kept))
        for name in ("fixed", "fixed_x", "fixed_y")
    }
    # A superelement is what the input reaches: all gripped nodes but one, which is the output.
    along = np.array([1.0, 0.0])
    piece = Problem(
        name=problem.name,
        lattice=Lattice(lattice.positions[kept], np.searchsorted(kept, lattice.beams[chosen])),
        supports=Supports(**held),
        input=Input(grip[:-1], along, "displacement", 1.0),
        output=Output(grip[-1:], along),
        stiffness=problem.stiffness,
        designable=np.array([0]),
    )
    element = Superelement(piece.full_design(), [Loose(grip)])
    reached = element.reached.astype(np.float64)
    found: NDArray[np.float64] = element.rest().stiffness * np.outer(reached, reached)
    return found


def _answer(
    machine: Machine, nodes: NDArray[np.int64], stiffness: NDArray[np.float64]
) -> Prediction:
    """Move the input by 1, and solve for all other nodes that hang together with something held."""
    problem, lattice = machine.design.problem, machine.design.problem.lattice
    drive, wanted = problem.input, problem.output
    joined = Lattice(lattice.positions, lattice.beams[machine.design.mask])
    reached = joined.reachable(np.concatenate([problem.supports.nodes, drive.nodes]))[nodes]
    moved = np.repeat(np.isin(nodes, drive.nodes), 2)
    motion = np.zeros((len(nodes), 2))
    motion[np.searchsorted(nodes, drive.nodes)] = drive.direction
    flat = motion.reshape(-1)
    live = stiffness.any(axis=1) & np.repeat(reached, 2) & ~moved
    own = stiffness[np.ix_(live, live)]
    if live.any():
        softest, *_, stiffest = np.linalg.eigvalsh(own)
        if softest <= LOOSE * stiffest:
            raise InvalidFile(f"{machine.plan.source}: something in the machine swings freely")
        flat[live] = np.linalg.solve(own, -stiffness[live] @ flat)
    given = np.where(moved, flat, 0.0)
    travel = motion[np.searchsorted(nodes, wanted.nodes)]
    return Prediction(
        efficiency=float((travel * wanted.direction).sum(axis=1).mean()),
        input_stiffness=float(given @ stiffness @ flat),
    )
