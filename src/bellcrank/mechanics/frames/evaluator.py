"""Responses of designs as frames."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidProblem, InvalidSettings
from bellcrank.mechanics.evaluator import FlipPrediction, Response
from bellcrank.mechanics.frames.analysis import orientation, strain_of_frame
from bellcrank.mechanics.frames.beams import theories
from bellcrank.mechanics.frames.equilibria import (
    Equilibrium,
    equilibrium_between,
    stored_states,
)
from bellcrank.mechanics.frames.flips import FlipPredictor
from bellcrank.mechanics.frames.kernels.arrays import KEPT_PATH
from bellcrank.mechanics.frames.quantities import quantities
from bellcrank.mechanics.frames.system import (
    allocate_memory,
    allocate_reference,
    allocate_state,
    allocate_structure,
    build_frame,
)
from bellcrank.mechanics.objectives import objective_of
from bellcrank.mechanics.output import output_motion
from bellcrank.mechanics.status import Status

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike, NDArray

    from bellcrank.mechanics.analysis import Strain
    from bellcrank.mechanics.frames.flips import FlipChanges
    from bellcrank.mechanics.frames.kernels.arrays import State
    from bellcrank.mechanics.frames.quantities import Measures, Quantity
    from bellcrank.mechanics.output import OutputMotion
    from bellcrank.model import Problem


class FrameEvaluator:
    """Responses of designs of one problem as frames; one instance for each thread.

    Parameters
    ----------
    problem
        A problem with a section, in the plane or in space.
    objective
        Name of an objective (see `bellcrank.mechanics.objectives`); that of the problem by
        default.
    elements : int, optional
        None for one element of each beam that includes the shortening of bent beams, so that it
        follows their buckling: it is fast, is what searches use, and mostly within 0.3 % of eight
        elements. A number for that many elements of each beam, linear in their deformations as in
        most programs; eight are within 1e-4 of the limit of many.
    theory
        Name in the registry of theories: ``"euler-bernoulli"``, or ``"timoshenko"`` with shear
        deformation.
    weight : (d,), optional
        Own weight: force on a unit of volume. It is applied with the input.

    Raises
    ------
    InvalidProblem
        If the problem has no section.
    InvalidSettings
        If the number of elements is not positive.
    UnknownName
        If there is no such objective or theory.
    """

    def __init__(
        self,
        problem: Problem,
        objective: str | None = None,
        elements: int | None = None,
        theory: str = "euler-bernoulli",
        weight: ArrayLike | None = None,
    ) -> None:
        if elements is not None and (not isinstance(elements, int) or elements < 1):
            raise InvalidSettings(f"elements: expected at least 1 in each beam, got {elements!r}")
        theories[theory]
        if problem.section is None:
            build_frame(problem, objective_of(problem, objective))  # raises InvalidProblem
        self.problem = problem
        self.objective = objective
        self.elements = elements
        self.divisions = elements or 1
        self.theory = theory
        self.weight = None if weight is None else np.asarray(weight, dtype=np.float64)
        self._mask: NDArray[np.bool_] | None = None
        self._given = np.zeros(problem.lattice.beam_count, np.uint8)
        self._last: tuple[NDArray[np.bool_], Response] | None = None
        self._flips: FlipPredictor | None = None
        if self.divisions == 1:
            self._allocate(None)

    def _allocate(self, mask: NDArray[np.bool_] | None) -> None:
        """Allocate the arrays of a frame of all beams of the lattice, or of those of a mask."""
        objective = objective_of(self.problem, self.objective)
        every = np.ones(self.problem.lattice.beam_count, dtype=bool)
        self.beams = np.flatnonzero(every if mask is None else mask)
        self.frame = build_frame(
            self.problem, objective, self.elements, self.theory, mask, self.weight
        )
        self.structure = allocate_structure(self.frame)
        self.memory = allocate_memory(self.frame, self.structure)
        self.reference = allocate_reference(self.frame)
        self.state = allocate_state(len(self.frame.positions), len(self.frame.unit))
        self._mask, self._flips = mask, None

    def _checked(self, mask: ArrayLike) -> NDArray[np.bool_]:
        given = np.asarray(mask)
        count = self.problem.lattice.beam_count
        if given.shape != (count,):
            raise InvalidProblem(
                f"mask: expected shape ({count},), one entry for each beam, got {given.shape}"
            )
        return given.astype(bool)

    def _present(self, mask: ArrayLike) -> NDArray[np.uint8]:
        """Return which beams of the frame are present in a design; build its frame if needed."""
        given = self._checked(mask)
        if self.divisions == 1:
            return given.astype(np.uint8)
        if self._mask is None or not np.array_equal(given, self._mask):
            self._allocate(given)
        return np.ones(len(self.frame.beams), np.uint8)

    def evaluate(
        self,
        mask: ArrayLike,
        largest_increment: float = 1.0,
        *,
        warm_start: bool = False,
        lower_bound: float = -math.inf,
    ) -> Response:
        """Load the design `mask` from rest to the full stroke.

        As `bellcrank.mechanics.SpringEvaluator.evaluate`. With several elements of each beam,
        there is no warm start.
        """
        from bellcrank.mechanics.frames.kernels.response import respond

        present = self._present(mask)
        self._last = None
        status, efficiency, energy = respond(
            self.frame, present, self.reference, warm_start and self.divisions == 1, lower_bound,
            largest_increment, self.structure, self.state, self.memory,
        )  # fmt: skip
        nodes, dimension = self.problem.lattice.positions.shape
        displacement = self.state.u[:nodes, :dimension].copy()
        followed = status == Status.SNAPPED
        reached = float(self.memory.reached_load[0]) if followed else 1.0
        response = Response(Status(status), efficiency, energy, displacement, reached=reached)
        self._given, self._last = present, (self._checked(mask).copy(), response)
        return response

    def set_reference(self) -> None:
        """Make the equilibrium computed last, which must have converged, the reference."""
        from bellcrank.mechanics.frames.kernels.response import keep_reference

        keep_reference(self.frame, self.structure, self.state, self.memory, self.reference)

    def for_problem(self, problem: Problem) -> FrameEvaluator:
        """Return an evaluator of the displacement in another problem, with the same settings."""
        return FrameEvaluator(problem, "displacement", self.elements, self.theory, self.weight)

    def load_bearing(self, mask: ArrayLike) -> NDArray[np.bool_]:
        """Return the beams of a design that can carry load: no loose pieces, no dead ends.

        A dead end carries nothing but its own weight, which does not count.

        Returns
        -------
        (M,) bool
        """
        from bellcrank.mechanics.frames.kernels.structure import find_structure

        present = self._present(mask)
        self._last = None
        frame = replace(self.frame, has_weight=False) if self.frame.has_weight else self.frame
        find_structure(frame, present, self.structure, self.memory)
        moves = self.structure.active[self.frame.beams].astype(bool).any(axis=1)
        carrying = (self.structure.present != 0) & moves
        if self.divisions == 1:
            return np.asarray(carrying)
        core = np.zeros(self.problem.lattice.beam_count, dtype=bool)
        core[self._checked(mask)] = carrying.reshape(-1, self.divisions).all(axis=1)
        return core

    def response_of(self, mask: ArrayLike) -> Response | None:
        """Return the response computed last if it is that of a design."""
        given = self._checked(mask)
        known = self._last is not None and np.array_equal(self._last[0], given)
        return self._last[1] if self._last is not None and known else None

    @property
    def end(self) -> Equilibrium:
        """The state of the response computed last: at full load, or where the path ends."""
        reached = 1.0 if self._last is None else self._last[1].reached
        return self._configuration(reached, self.state)

    def _configuration(self, fraction: float, state: State) -> Equilibrium:
        return Equilibrium(self.problem, self.frame, self.structure, self.memory, fraction, state)

    def equilibrium(self, fraction: float = 1.0) -> Equilibrium | None:
        """Return the equilibrium at a fraction of the load, from the response computed last.

        Newton's method begins between the two stored states next to it: those at which the path was
        followed, the quarters of the load among them.

        Returns
        -------
        Equilibrium or None
            None if the stable path does not lead there.
        """
        if self._last is None:
            return None
        response = self._last[1]
        if response.status not in {Status.CONVERGED, Status.SNAPPED}:
            return None
        if fraction >= response.reached:
            return self.end if fraction == response.reached else None
        unchanged = self.memory.path[0] == KEPT_PATH
        path = self.reference if unchanged else self.memory
        stored = stored_states(self.end, int(path.count[0]), path.load, path.points)
        return equilibrium_between(self.end, stored, fraction, self._given)

    def at_rest(self, mask: ArrayLike) -> Equilibrium | None:
        """Return a design at rest, for linear motions; None for a mechanism.

        The response computed last is lost.
        """
        from bellcrank.mechanics.frames.kernels.structure import find_structure

        self._given, self._last = self._present(mask), None
        if find_structure(self.frame, self._given, self.structure, self.memory) != Status.CONVERGED:
            return None
        return self._configuration(
            1.0, allocate_state(len(self.frame.positions), len(self.frame.unit))
        )

    def flip_changes(
        self,
        equilibrium: Equilibrium,
        measured: Sequence[tuple[Quantity, Measures]],
        beams: NDArray[np.int64],
        *,
        first_order: bool,
    ) -> FlipChanges | None:
        """Return the changes of the measures of quantities by flips; None if unstable.

        Parameters
        ----------
        equilibrium
            One of this evaluator, of the design evaluated last.
        measured
            Quantities and their measures there.
        beams : (n,) int64
            Beams to flip, one at a time.
        first_order
            Compute derivatives by the presence of the beams instead.

        Raises
        ------
        InvalidSettings
            If there are several elements in each beam.
        """
        if self.divisions > 1:
            raise InvalidSettings(
                f"elements: flips are predicted with one element in each beam, not {self.elements}"
            )
        if self._flips is None:
            self._flips = FlipPredictor(self.frame, self.structure)
        return self._flips.changes(
            equilibrium, measured, beams, self._given, first_order=first_order
        )

    def _efficiency_changes(
        self, beams: NDArray[np.int64], *, first_order: bool
    ) -> FlipChanges | None:
        """Return the changes of the efficiency at the end of the response computed last."""
        efficiency, end = quantities["efficiency"], self.end
        measured = [(efficiency, efficiency.measure(end))]
        return self.flip_changes(end, measured, beams, first_order=first_order)

    def sensitivity(self, mask: ArrayLike) -> NDArray[np.float64]:
        """Return the first-order change of the efficiency by flipping each beam.

        As `bellcrank.mechanics.SpringEvaluator.sensitivity`, from one adjoint solution.

        Raises
        ------
        InvalidSettings
            If the design has no stable equilibrium at which to differentiate.
        """
        response = self.evaluate(mask)
        found = None
        if response.status in {Status.CONVERGED, Status.SNAPPED}:
            beams = np.arange(self.problem.lattice.beam_count)
            found = self._efficiency_changes(beams, first_order=True)
        if found is None:
            raise InvalidSettings(f"no sensitivity: {response.status.message}")
        (slope,) = found.measures[0].T
        derivative: NDArray[np.float64] = np.where(self._checked(mask), -slope, slope)
        return derivative

    def predict_flips(
        self, mask: ArrayLike, beams: ArrayLike | None = None
    ) -> FlipPrediction | None:
        """Predict the change of the efficiency by each flip, from the response computed last.

        As `bellcrank.mechanics.SpringEvaluator.predict_flips`; the memory grows with the number
        of beams, not with its square.
        """
        self._checked(mask)
        chosen = self.problem.designable if beams is None else np.asarray(beams, dtype=np.int64)
        found = self._efficiency_changes(chosen, first_order=False)
        if found is None:
            return None
        return FlipPrediction(chosen, found.measures[0][:, 0], found.strain)

    def core_finder(self) -> Callable[[NDArray[np.bool_]], NDArray[np.bool_]]:
        """Return a function like `load_bearing` that leaves the last response as it is."""
        return FrameEvaluator(self.problem, self.objective).load_bearing

    def strain(self) -> Strain:
        """Return energies and input forces in the response computed last."""
        return strain_of_frame(self)

    def largest_strain(self) -> float:
        """Return the largest principal strain of a beam in the response computed last."""
        return quantities["strain"].value(self.end)

    def output_stiffness(self) -> float:
        """Return the stiffness of the output; see `bellcrank.mechanics.output_stiffness`."""
        return quantities["output_stiffness"].value(self.end)

    def output_motion(self) -> OutputMotion:
        """Return the motion of the output in the response computed last."""
        nodes, dimension = self.problem.lattice.positions.shape
        turned = orientation(self.state, self.problem.output.nodes[0])
        return output_motion(self.problem, self.state.u[:nodes, :dimension], turned)
