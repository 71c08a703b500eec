"""Prediction of a machine from its condensed parts, along the whole stroke.

Each part is condensed to all displacements, and in frames rotations, of the nodes of its two ports
(`bellcrank.mechanics.Superelement`). The machine is the sum of its parts over these unknowns, which
Newton's method solves; beams within welded ports belong to several parts and are counted once. For
frames the result is that of the whole lattice. In the spring model it is that if no pair of
neighbouring beams at a node belongs to two parts, for example where hexagonal ports of parts side
by side are welded; otherwise the angular springs between beams of different parts are missing.

Two-ports of one coordinate a port do not suffice: ports that are welded also rotate and deform.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import BellcrankError, InvalidFile
from bellcrank.machines.bridges import between_ports
from bellcrank.machines.curves import Load, trace
from bellcrank.machines.ports import INPUT, OUTPUT
from bellcrank.mechanics import Condensed, LinearEquations, Superelement, free_nodes, state_of
from bellcrank.model import Input, Lattice, Output, Problem, Supports

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from bellcrank.machines.assembly import Machine
    from bellcrank.machines.curves import PortCurve
    from bellcrank.mechanics import Conditions, State
    from bellcrank.model import Design


def predict(machine: Machine, points: int = 20) -> PortCurve:
    """Predict a machine along its stroke from its condensed parts, with a free output.

    Parameters
    ----------
    points
        Number of equal increments of the stroke.

    Raises
    ------
    InvalidFile
        If a part cannot be condensed.
    InvalidSettings
        If a part of the machine moves without resistance.
    """
    return trace(assembled_ports(machine), Load("free"), points)


def assembled_ports(machine: Machine) -> Assembly:
    """Return the condensed parts of a machine with the coordinates u_in and u_out.

    As `bellcrank.machines.mean_ports` of the whole lattice.

    Raises
    ------
    InvalidFile
        If a part cannot be condensed.
    """
    lattice = machine.design.problem.lattice
    nodes = np.unique(np.concatenate([machine.port_nodes(port) for port in machine.ports]))
    counted = np.zeros(len(lattice.beams), np.bool_)
    pieces: list[Piece] = []
    for name, selected, gripped in _pieces(machine):
        twice = selected & counted
        pairs = ((1.0, selected, gripped), (-1.0, twice, gripped))
        for sign, part, ports in pairs:
            grip = np.intersect1d(ports, lattice.beams[part])
            if len(grip):
                try:
                    element = _condensed(machine.design.problem, part, grip)
                except BellcrankError as error:
                    source = machine.plan.source
                    raise InvalidFile(f"{source}: {name} cannot be condensed: {error}") from None
                pieces.append(Piece(sign, element, np.searchsorted(nodes, grip)))
        counted[selected] = True
    return Assembly(machine.design, nodes, pieces)


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A condensed part of a machine.

    Parameters
    ----------
    sign
        -1 for beams that other parts share and that would count twice.
    element
        The part, condensed to all unknowns of its port nodes.
    ports : (g,) int64
        Number of these nodes among the port nodes of the machine.
    """

    sign: float
    element: Superelement
    ports: NDArray[np.int64]


class Assembly:
    """The sum of condensed parts; `bellcrank.mechanics.follow` moves it.

    Coordinates z are the motion of the input and all unknowns of the port nodes. Parts that the
    input does not reach stay at rest. A displacement is that of all parts, one after the other.

    Parameters
    ----------
    design
        The whole machine.
    nodes : (p,) int64
        Port nodes of all parts.
    pieces
        The parts.
    """

    def __init__(self, design: Design, nodes: NDArray[np.int64], pieces: list[Piece]) -> None:
        self.design = design
        problem = design.problem
        size = _unknowns(problem)
        present = Lattice(problem.lattice.positions, problem.lattice.beams[design.mask])
        reached = present.reachable(problem.input.nodes)[nodes]
        self.pieces = [each for each in pieces if reached[each.ports].any()]
        self._unknowns = [
            (size * each.ports[:, None] + np.arange(size)).ravel() for each in self.pieces
        ]
        moving = np.zeros(size * len(nodes), np.bool_)
        for each, unknowns in zip(self.pieces, self._unknowns, strict=True):
            moving[unknowns[each.element.reached]] = True
        self._basis = _basis(problem, nodes, moving.reshape(-1, size) & reached[:, None])
        self._fixed: NDArray[np.bool_] = ~np.asarray(self._basis.any(axis=0))
        self.measures = _means(problem, nodes, size) @ self._basis
        if problem.input.drive == "displacement" and not self._fixed[0]:
            self.measures[INPUT] = np.eye(len(self._fixed))[0]
        counts = [len(each.element.active) for each in self.pieces]
        self._splits = np.cumsum(counts)[:-1]

    @property
    def reached(self) -> NDArray[np.bool_]:
        """(2,) whether input and output are connected to a part that resists the input."""
        return np.asarray(self.measures.any(axis=1))

    def _split(self, field: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        """Return the rows of a field that belong to each part."""
        return np.split(field, self._splits)

    def condense(
        self,
        displacement: NDArray[np.float64],
        *,
        softened: bool = True,
        predicted: bool = False,
    ) -> Condensed | None:
        """Condense the tangent stiffness to the coordinates; see `Superelement.condense`."""
        found = []
        for piece, own in zip(self.pieces, self._split(displacement), strict=True):
            each = piece.element.condense(own, softened=softened, predicted=predicted)
            if each is None:
                return None
            found.append(each)
        count = len(self._basis)
        stiffness, force = np.zeros((count, count)), np.zeros(count)
        for piece, each, rows in zip(self.pieces, found, self._unknowns, strict=True):
            live = np.outer(piece.element.reached, piece.element.reached)
            stiffness[np.ix_(rows, rows)] += piece.sign * each.stiffness * live
            force[rows] += piece.sign * each.force
        stiffness = self._basis.T @ stiffness @ self._basis
        stiffness[self._fixed, self._fixed] = 1.0

        def response(change: NDArray[np.float64]) -> NDArray[np.float64]:
            moved = self._basis @ change
            parts = zip(found, self._unknowns, strict=True)
            return np.concatenate([each.response(moved[rows]) for each, rows in parts])

        return Condensed(
            stiffness=stiffness,
            force=self._basis.T @ force,
            response=response,
            interior_step=np.concatenate([each.interior_step for each in found]),
            lowest=tuple(lowest for each in found for lowest in each.lowest),
        )

    def predict_tension(self, motion: NDArray[np.float64]) -> None:
        """Compute the tensions to first order after a motion from the last condensation."""
        for piece, own in zip(self.pieces, self._split(motion), strict=True):
            piece.element.predict_tension(own)

    def moved(
        self, displacement: NDArray[np.float64], motion: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the displacement after a motion."""
        fields = zip(self.pieces, self._split(displacement), self._split(motion), strict=True)
        return np.concatenate([piece.element.moved(own, by) for piece, own, by in fields])

    def motion(self, start: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the motion from one displacement to another."""
        fields = zip(self.pieces, self._split(start), self._split(end), strict=True)
        return np.concatenate([piece.element.motion(one, two) for piece, one, two in fields])

    def state(
        self, z: NDArray[np.float64], displacement: NDArray[np.float64], found: Condensed
    ) -> State:
        """Return the state of an equilibrium that was condensed to `found`."""
        energies = [
            piece.sign * piece.element.energy(own)
            for piece, own in zip(self.pieces, self._split(displacement), strict=True)
        ]
        return state_of(z, displacement, found, self.measures, sum(energies))

    def rest(self) -> State:
        """Return the state at rest, without any force."""
        displacement = np.concatenate([each.element.model.rest() for each in self.pieces])
        found = self.condense(displacement)
        if found is None:  # the parts were checked one by one
            raise InvalidFile(f"{self.design.problem.name}: a part is unstable at rest")
        return self.state(np.zeros(self._basis.shape[1]), displacement, found)

    def linear(self, state: State, conditions: Conditions) -> LinearEquations:
        """Return the linear equations around a state."""
        return LinearEquations(state.stiffness, self.measures, conditions)


def _basis(
    problem: Problem, nodes: NDArray[np.int64], moving: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return (n, m) the unknowns of the port nodes per unit of each coordinate.

    The nodes of an input that is driven by a displacement have one coordinate together, and
    their rotations.
    """
    basis = np.eye(moving.size).reshape(*moving.shape, moving.size)
    if problem.input.drive != "displacement":
        return np.asarray((basis * moving[..., None]).reshape(moving.size, -1))
    inputs = np.searchsorted(nodes, problem.input.nodes)
    together = np.zeros(moving.shape)
    dimension = problem.lattice.dimension
    together[inputs, :dimension] = problem.input.direction
    basis[inputs, :dimension] = 0.0
    whole = np.concatenate([together[..., None], basis], axis=2) * moving[..., None]
    return np.asarray(whole.reshape(moving.size, -1))


def _means(problem: Problem, nodes: NDArray[np.int64], size: int) -> NDArray[np.float64]:
    """Return (2, n) the mean motions of input and output per unit of each unknown."""
    weights = np.zeros((2, len(nodes), size))
    for port, region in ((INPUT, problem.input), (OUTPUT, problem.output)):
        own = np.searchsorted(nodes, region.nodes)
        weights[port, own, : problem.lattice.dimension] = region.direction / len(own)
    return weights.reshape(2, -1)


def _pieces(machine: Machine) -> Iterator[tuple[str, NDArray[np.bool_], NDArray[np.int64]]]:
    """Yield parts and bridges: name, beams (M,) bool, and nodes of both ports."""
    lattice, present = machine.design.problem.lattice, machine.design.mask
    for name, part in machine.parts.items():
        own = np.zeros(len(present), np.bool_)
        own[machine.beams[name][part.design.mask]] = True
        ends = [machine.port_nodes(port) for port in machine.ports if port.part == name]
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
) -> Superelement:
    """Condense some beams to all unknowns of some nodes."""
    lattice, supports = problem.lattice, problem.supports
    subset = np.union1d(lattice.beams[selected], gripped)
    own = Lattice(lattice.positions[subset], np.searchsorted(subset, lattice.beams[selected]))
    grip = np.searchsorted(subset, gripped)
    held = Supports(
        **{
            name: np.searchsorted(subset, np.intersect1d(getattr(supports, name), subset))
            for name in ("fixed", "fixed_x", "fixed_y", "fixed_z")
        }
    )
    # A superelement contains what its input reaches, and a problem needs an output.
    inside = own.reachable(grip)
    inside[np.concatenate([grip, held.nodes])] = False
    given, watched = (grip, np.flatnonzero(inside)[:1]) if inside.any() else (grip[:-1], grip[-1:])
    along = np.eye(lattice.dimension)[0]
    piece = Problem(
        name=problem.name,
        lattice=own,
        supports=held,
        input=Input(given, along, "displacement", 1.0),
        output=Output(watched, along),
        stiffness=problem.stiffness,
        section=problem.section,
        material=problem.material,
        widths=None if problem.widths is None else problem.widths[selected],
        joints=None if problem.joints is None else problem.joints[selected],
        designable=np.array([0]),
    )
    return Superelement(piece.full_design(), [free_nodes(grip, _unknowns(problem))])


def _unknowns(problem: Problem) -> int:
    """Return the number of unknowns of a node: displacements, and in frames rotations."""
    if problem.section is None:
        return 2
    return 3 if problem.lattice.dimension == 2 else 6
