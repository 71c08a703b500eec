"""A design condensed to the motions of its boundary nodes, along the whole stroke."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics.conditions import LinearEquations
from bellcrank.mechanics.evaluator import core_code
from bellcrank.mechanics.frames.condensation import FrameCondensation
from bellcrank.mechanics.spring_condensation import SpringCondensation
from bellcrank.mechanics.status import Status

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike, NDArray

    from bellcrank.mechanics.conditions import Conditions
    from bellcrank.mechanics.coupling import Coupling
    from bellcrank.mechanics.evaluator import UnloadedBeams
    from bellcrank.model import Design


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """A stable equilibrium under conditions.

    Parameters
    ----------
    z : (m,)
        Generalised coordinates of the couplings.
    displacement : (N, c)
        Displacement of all nodes; in frames also their rotation, in space as a unit quaternion.
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
    """First-order behaviour of a superelement around one configuration.

    Parameters
    ----------
    stiffness : (m, m)
        By the coordinates z; the interior follows.
    force : (m,)
        Work per unit of each coordinate; the interior is in equilibrium after `interior_step`.
    response
        Function from a change of the coordinates (m,) to the motion (N, b) of all nodes.
    interior_step : (N, b)
        Newton step of the interior with the boundary nodes held; zero in equilibrium.
    lowest
        Estimated stiffness of the softest motion of the interior while the boundary nodes are
        held, of each part; infinite if there is no interior.
    """

    stiffness: NDArray[np.float64]
    force: NDArray[np.float64]
    response: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    interior_step: NDArray[np.float64]
    lowest: tuple[float, ...]


def state_of(
    z: NDArray[np.float64],
    displacement: NDArray[np.float64],
    found: Condensed,
    measures: NDArray[np.float64],
    energy: float,
) -> State:
    """Return the state of an equilibrium that was condensed to `found`.

    Parameters
    ----------
    z : (m,)
        Coordinates.
    displacement : (N, c)
        Displacement of all nodes.
    measures : (k, m)
        Coordinates to which conditions apply, q = measures z.
    energy
        Elastic energy.
    """
    size = float(np.abs(found.stiffness).max())
    return State(
        z=z,
        displacement=displacement,
        coordinates=measures @ z,
        # In equilibrium the force by z is the transposed measures times that by coordinate.
        force=np.linalg.pinv(measures.T) @ found.force,
        energy=energy,
        stiffness=0.5 * (found.stiffness + found.stiffness.T),
        asymmetry=float(np.abs(found.stiffness - found.stiffness.T).max()) / size,
    )


class Condensation(Protocol):
    """The mechanics of one design while unknowns of its boundary nodes are prescribed.

    A configuration (N, c) is a state of the nodes, a motion (N, b) leads from one to another: b
    unknowns of each node, displacements and in frames rotations.
    """

    status: Status
    """MECHANISM if a piece can move although the boundary is held."""
    active: NDArray[np.bool_]
    """(N,) nodes of pieces that the input of the problem reaches and that can carry load."""
    interior_step: NDArray[np.float64]
    """(N, b) Newton step of the interior in the last condensation."""

    @property
    def gradient(self) -> NDArray[np.float64]:
        """(N, b) derivative of the energy in the last condensation."""

    def rest(self) -> NDArray[np.float64]:
        """Return the configuration at rest."""

    def energy(self, configuration: NDArray[np.float64]) -> float:
        """Return the elastic energy."""

    def condense(
        self,
        configuration: NDArray[np.float64],
        motions: NDArray[np.float64],
        softening: float,
        predicted: bool,
    ) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """Return the lowest stiffness of the interior, and (m, N, b) forces and responses.

        Forces are the stiffness times each motion (m, N, b) of the boundary, responses the
        motion of all nodes with the interior following. The lowest stiffness is negative if the
        interior is not stable.
        """

    def predict_tension(self, motion: NDArray[np.float64]) -> None:
        """Compute the tensions to first order after a motion, for the next condensation."""

    def moved(
        self, configuration: NDArray[np.float64], motion: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the configuration after a motion."""

    def motion(self, start: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the motion from one configuration to another."""


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

    >>> from bellcrank.mechanics import Superelement, uniform_motion
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
        undriven = replace(problem, input=replace(problem.input, drive="force", during=None))
        held = _held_unknowns(design, couplings)
        free = replace(design, problem=undriven)
        self.model: Condensation = (
            SpringCondensation(free, held, core)
            if problem.section is None
            else FrameCondensation(free, held)
        )
        if self.model.status is not Status.CONVERGED:
            raise InvalidSettings(
                f"{problem.name}: {self.model.status.message}, even while its ports are held"
            )
        self.motions = self._motions_of(couplings, held.shape)
        self._fixed = ~self.motions.reshape(len(self.motions), -1).any(axis=1)
        self.measures = self._checked_measures(measures)

    @property
    def active(self) -> NDArray[np.bool_]:
        """(N,) nodes of pieces that the input reaches and that can carry load."""
        return self.model.active

    def _motions_of(
        self, couplings: Sequence[Coupling], shape: tuple[int, ...]
    ) -> NDArray[np.float64]:
        """Return (m, N, b) the motion of the nodes per coordinate, without the interior."""
        motions, first = np.zeros((sum(each.count for each in couplings), *shape)), 0
        for each in couplings:
            live = self.active[each.nodes]
            unknowns = each.motions.shape[2]
            motions[first : first + each.count, each.nodes, :unknowns] = (
                each.motions * live[:, None]
            )
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

    def moved(
        self, displacement: NDArray[np.float64], motion: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the displacement (N, c) after a motion (N, b)."""
        return self.model.moved(displacement, motion)

    def motion(self, start: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the motion (N, b) that leads from one displacement to another."""
        return self.model.motion(start, end)

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
        displacement : (N, c)
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
        lowest, forcing, responses = self.model.condense(
            displacement, self.motions, 1.0 if softened else 0.0, predicted
        )
        if lowest < 0.0:
            return None
        count = len(self.motions)
        stiffness = forcing.reshape(count, -1) @ responses.reshape(count, -1).T
        stiffness[self._fixed, self._fixed] = 1.0
        force = responses.reshape(count, -1) @ self.model.gradient.ravel()
        return Condensed(
            stiffness,
            force,
            lambda change: np.tensordot(change, responses, axes=1),
            self.model.interior_step,
            (lowest,),
        )

    def predict_tension(self, motion: NDArray[np.float64]) -> None:
        """Compute the tension to first order after a motion (N, b) from the last condensation.

        See `bellcrank.mechanics.kernels.newton.predict_tension`.
        """
        self.model.predict_tension(motion)

    def state(
        self, z: NDArray[np.float64], displacement: NDArray[np.float64], found: Condensed
    ) -> State:
        """Return the state of an equilibrium that was condensed to `found`."""
        return state_of(z, displacement, found, self.measures, self.energy(displacement))

    def energy(self, displacement: NDArray[np.float64]) -> float:
        """Return the elastic energy at displacements (N, c) of the nodes."""
        return self.model.energy(displacement)

    def rest(self) -> State:
        """Return the state at rest, without any force.

        Raises
        ------
        InvalidSettings
            If the interior is a mechanism, even while the boundary nodes are held.
        """
        z, displacement = np.zeros(len(self.motions)), self.model.rest()
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


def _held_unknowns(design: Design, couplings: Sequence[Coupling]) -> NDArray[np.bool_]:
    """Return (N, b) the unknowns of the nodes that the couplings prescribe."""
    lattice, framed = design.problem.lattice, design.problem.section is not None
    unknowns = 3 * (lattice.dimension - 1) if framed else lattice.dimension
    held = np.zeros((lattice.node_count, unknowns), dtype=bool)
    for each in couplings:
        held[each.nodes, : each.motions.shape[2]] = True
    return held


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
