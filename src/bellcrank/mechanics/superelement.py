"""A design condensed to the motions of its boundary nodes, along the whole stroke."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics.conditions import LinearEquations
from bellcrank.mechanics.evaluator import core_code
from bellcrank.mechanics.kernels.arrays import ACTIVE, HELD
from bellcrank.mechanics.objectives import objective_of
from bellcrank.mechanics.status import Status
from bellcrank.mechanics.system import allocate_scratch, allocate_structure, build_system

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from bellcrank.mechanics.conditions import Conditions
    from bellcrank.mechanics.evaluator import UnloadedBeams
    from bellcrank.model import Design


@dataclass(frozen=True, slots=True, eq=False)
class Coupling:
    """Boundary nodes, and the generalised coordinates that move them.

    The force by a coordinate is the sum over the nodes of force times motion.

    Parameters
    ----------
    nodes : (n,) int64
    motions : (m, n, 2)
        Displacement of the nodes per unit of each coordinate.
    """

    nodes: NDArray[np.int64]
    motions: NDArray[np.float64]

    @property
    def count(self) -> int:
        """Number m of coordinates."""
        return len(self.motions)


def uniform_motion(nodes: NDArray[np.int64], direction: NDArray[np.float64]) -> Coupling:
    """Couple nodes to one coordinate: all move by the same amount, each along its direction.

    As the displacement drive of a problem moves them.

    Parameters
    ----------
    nodes : (n,) int64
    direction : (n, 2) unit vectors
    """
    return Coupling(nodes, direction[None])


def free_nodes(nodes: NDArray[np.int64]) -> Coupling:
    """Move nodes independently, by the coordinates x, y of the first, of the second, ...

    Parameters
    ----------
    nodes : (n,) int64
    """
    return Coupling(nodes, np.eye(2 * len(nodes)).reshape(-1, len(nodes), 2))


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """A stable equilibrium under conditions.

    Parameters
    ----------
    z : (m,)
        Generalised coordinates of the couplings.
    displacement : (N, 2)
        Displacement of all nodes.
    coordinates : (k,)
        Coordinates to which conditions apply.
    force : (k,)
        External force by coordinate: positive if it does work when its coordinate grows. Where a
        spring acts, the force on the superelement, ``-k q``.
    energy
        Elastic energy of the superelement alone.
    stiffness : (m, m)
        Tangent stiffness by z; symmetric.
    asymmetry
        Largest difference between the stiffness as computed and its transpose, as a part of
        its largest entry: the rounding error of the reciprocity of Maxwell and Betti.
    """

    z: NDArray[np.float64]
    displacement: NDArray[np.float64]
    coordinates: NDArray[np.float64]
    force: NDArray[np.float64]
    energy: float
    stiffness: NDArray[np.float64]
    asymmetry: float


@dataclass(frozen=True, slots=True, eq=False)
class Condensed:
    """First-order behaviour of a superelement around one displacement.

    Parameters
    ----------
    stiffness : (m, m)
        By the coordinates z; the interior follows.
    force : (m,)
        Work per unit of each coordinate; the interior is in equilibrium after `interior_step`.
    responses : (m, N, 2)
        Displacement of all nodes per unit of each coordinate.
    interior_step : (N, 2)
        Newton step of the interior with the boundary nodes held; zero in equilibrium.
    lowest
        Estimated stiffness of the softest motion of the interior while the boundary nodes are
        held; infinite if there is no interior.
    """

    stiffness: NDArray[np.float64]
    force: NDArray[np.float64]
    responses: NDArray[np.float64]
    interior_step: NDArray[np.float64]
    lowest: float


class Superelement:
    """A design that is moved and loaded at its boundary nodes only; `follow` moves it.

    Pieces that the input of the problem does not reach stay at rest, as in a response. Supports
    are held; the drive of the problem and the springs at its output are left out.

    Parameters
    ----------
    design
    couplings
        Boundary nodes and their coordinates. The coordinates of all couplings, one after the
        other, are z (m,).
    measures : (k, m)
        Coordinates to which conditions and forces apply: q = measures z; by default z.
    unloaded_beams
        As for a `SpringEvaluator`.

    Raises
    ------
    InvalidSettings
        If a boundary node does not exist, is held by a support or occurs twice; if the measures
        do not fit the couplings; or if the interior is a mechanism while the boundary is held.
        (A piece that would hang from its boundary by one node follows it without stress, and
        is not active.)

    Examples
    --------
    The input of the full crane moves along its direction, its output is free:

    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> push = uniform_motion(crane.input.nodes, crane.input.direction)
    >>> pushed = Superelement(crane.full_design(), [push])
    >>> pushed.rest().stiffness.round(4)
    array([[9.6861]])
    """

    def __init__(
        self,
        design: Design,
        couplings: Sequence[Coupling],
        measures: ArrayLike | None = None,
        unloaded_beams: UnloadedBeams = "keep",
    ) -> None:
        core = core_code(unloaded_beams)
        problem = design.problem
        self.design = design
        self.unloaded_beams: UnloadedBeams = unloaded_beams
        self._boundary = _checked(np.concatenate([each.nodes for each in couplings]), design)
        undriven = replace(problem, input=replace(problem.input, drive="force"))
        system = build_system(undriven, objective_of(undriven, "displacement"))
        self.system = system._replace(
            load=np.zeros_like(system.load), ground=np.zeros_like(system.ground)
        )
        self.structure = allocate_structure(self.system)
        self.scratch = allocate_scratch(self.system, self.structure)
        self._held = self.system.held.copy()
        self._held[self._boundary] = HELD
        self._free = np.flatnonzero(self.system.block >= 0)
        self._order = self.system.block[self._free]
        blocks = np.arange(len(self.scratch.step))
        self._mode = np.cos(1.0 + np.stack([3.0 * blocks, 3.0 * blocks + 1.0], axis=1))
        self._find_structure(core)
        self.motions = self._motions_of(couplings)
        self._fixed = ~self.motions.reshape(len(self.motions), -1).any(axis=1)
        self.measures = self._checked_measures(measures)
        self._by_coordinate = np.linalg.pinv(self.measures.T)

    def _find_structure(self, core: int) -> None:
        from bellcrank.mechanics.kernels.structure import find_structure

        # Pieces are classified with held boundary nodes, and beams between these still move.
        classified = self.system._replace(held=self._held)
        mask = self.design.mask.astype(np.uint8)
        status = Status(find_structure(classified, mask, core, self.structure))
        if status is not Status.CONVERGED:
            raise InvalidSettings(
                f"{self.design.problem.name}: {status.message}, even while its ports are held"
            )
        self.active: NDArray[np.bool_] = self.structure.active == ACTIVE

    def _motions_of(self, couplings: Sequence[Coupling]) -> NDArray[np.float64]:
        """Return (m, N, 2) the motion of the nodes per coordinate, without the interior."""
        count = sum(each.count for each in couplings)
        motions, first = np.zeros((count, *self.system.positions.shape)), 0
        for each in couplings:
            live = self.active[each.nodes]
            motions[first : first + each.count, each.nodes] = each.motions * live[:, None]
            first += each.count
        return motions

    def _checked_measures(self, measures: ArrayLike | None) -> NDArray[np.float64]:
        count = len(self.motions)
        chosen = np.eye(count) if measures is None else np.array(measures, dtype=np.float64)
        if chosen.ndim != 2 or chosen.shape[1] != count:
            raise InvalidSettings(
                f"measures: expected shape (k, {count}), a column for each coordinate of the "
                f"couplings, got {chosen.shape}"
            )
        chosen[:, self._fixed] = 0.0
        return chosen

    @property
    def reached(self) -> NDArray[np.bool_]:
        """(k,) whether each coordinate belongs to a piece that the input reaches."""
        return np.asarray(self.measures.any(axis=1))

    def move(self, z: NDArray[np.float64], displacement: NDArray[np.float64]) -> None:
        """Set the displacement (N, 2) of the boundary nodes to the coordinates z."""
        moved = np.tensordot(z, self.motions, axes=1)
        displacement[self._boundary] = moved[self._boundary]

    def energy(self, displacement: NDArray[np.float64]) -> float:
        """Return the elastic energy at displacements (N, 2) of the nodes."""
        from bellcrank.mechanics.kernels.condensation import energy_at

        found: float = energy_at(self.system, self.structure, displacement, self.scratch)
        return found

    def condense(
        self,
        displacement: NDArray[np.float64],
        *,
        softened: bool = True,
        predicted: bool = False,
    ) -> Condensed | None:
        """Condense the tangent stiffness to the coordinates z.

        Parameters
        ----------
        displacement : (N, 2)
            Any displacement, in equilibrium or not.
        softened
            False leaves out the part that can make the stiffness indefinite.
        predicted
            Use the tension of `predict_tension` instead of that at the displacement.

        Returns
        -------
        Condensed or None
            None if the interior is not stable while the boundary nodes are held.
        """
        from bellcrank.mechanics.kernels.condensation import condense

        count, blocks = len(self.motions), len(self.scratch.step)
        ordered = np.zeros((count, blocks, 2))
        ordered[:, self._order] = self.motions[:, self._free]
        forcing, responses = np.zeros_like(ordered), np.zeros_like(ordered)
        lowest = condense(
            self.system, self.structure, self._held, displacement, 1.0 if softened else 0.0,
            predicted, ordered, forcing, responses, self._mode, self.scratch,
        )  # fmt: skip
        if lowest < 0.0:
            return None
        whole = np.zeros((count, *displacement.shape))
        whole[:, self._free] = responses[:, self._order]
        interior_step = np.zeros_like(displacement)
        interior_step[self._free] = self.scratch.step[self._order]
        stiffness = forcing.reshape(count, -1) @ responses.reshape(count, -1).T
        stiffness[self._fixed, self._fixed] = 1.0
        force = whole.reshape(count, -1) @ self.scratch.gradient.ravel()
        return Condensed(stiffness, force, whole, interior_step, lowest)

    def predict_tension(self, step: NDArray[np.float64]) -> None:
        """Compute the tension to first order after a step (N, 2) from the last condensation.

        See `bellcrank.mechanics.kernels.newton.predict_tension`.
        """
        from bellcrank.mechanics.kernels.condensation import tension_after

        ordered = np.zeros_like(self.scratch.step)
        ordered[self._order] = step[self._free]
        tension_after(self.system, self.structure, ordered, self.scratch)

    def state(
        self, z: NDArray[np.float64], displacement: NDArray[np.float64], found: Condensed
    ) -> State:
        """Return the state of an equilibrium that was condensed to `found`."""
        size = float(np.abs(found.stiffness).max())
        asymmetry = float(np.abs(found.stiffness - found.stiffness.T).max()) / size
        return State(
            z=z,
            displacement=displacement,
            coordinates=self.measures @ z,
            # In equilibrium the force by z is the transposed measures times that by coordinate.
            force=self._by_coordinate @ found.force,
            energy=self.energy(displacement),
            stiffness=0.5 * (found.stiffness + found.stiffness.T),
            asymmetry=asymmetry,
        )

    def rest(self) -> State:
        """Return the state at rest, without any force.

        Raises
        ------
        InvalidSettings
            If the interior is a mechanism, even while the boundary nodes are held.
        """
        z, displacement = np.zeros(len(self.motions)), np.zeros_like(self.system.positions)
        found = self.condense(displacement)
        if found is None:
            raise InvalidSettings(
                f"{self.design.problem.name}: {Status.MECHANISM.message}, even while its ports "
                "are held"
            )
        return self.state(z, displacement, found)

    def linear(self, state: State, conditions: Conditions) -> LinearEquations:
        """Return the linear equations around a state."""
        return LinearEquations(state.stiffness, self.measures, conditions)


def _checked(boundary: NDArray[np.int64], design: Design) -> NDArray[np.int64]:
    """Return the boundary nodes, if they are free nodes of the design."""
    problem = design.problem
    exists = np.isin(boundary, np.arange(problem.lattice.node_count))
    bad = np.flatnonzero(~exists | np.isin(boundary, problem.supports.nodes))
    if len(bad):
        raise InvalidSettings(
            f"boundary nodes: expected free nodes of {problem.name}, got {boundary[bad[0]]}, which "
            f"{'is held by a support' if exists[bad[0]] else 'does not exist'}"
        )
    if len(np.unique(boundary)) != len(boundary):
        raise InvalidSettings("boundary nodes: expected each node once")
    return boundary.astype(np.int64)
