"""Responses of designs: the main interface of the mechanics."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from bellcrank.errors import InvalidProblem, InvalidSettings
from bellcrank.mechanics.analysis import Core, Strain, output_stiffness, strain_of
from bellcrank.mechanics.kernels.arrays import PRUNE_DEAD_ENDS, Reference, Structure, System
from bellcrank.mechanics.memory import check_memory
from bellcrank.mechanics.objectives import objective_of
from bellcrank.mechanics.output import output_motion
from bellcrank.mechanics.status import Status
from bellcrank.mechanics.system import (
    allocate_flip_workspace,
    allocate_reference,
    allocate_scratch,
    allocate_structure,
    build_system,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from bellcrank.mechanics.kernels.flip_prediction import FlipWorkspace
    from bellcrank.mechanics.output import OutputMotion
    from bellcrank.mechanics.status import Outcome
    from bellcrank.model import Problem

UnloadedBeams = Literal["keep", "prune_dead_ends", "prune_all"]
"""Treatment of beams that carry no load; see `SpringEvaluator`."""

VERIFICATION_INCREMENT = 1 / 32
"""Largest load increment for a design that will be built. Searches use larger increments, with
which about one in a hundred of the designs near a loss of stability is not recognised as
snapping."""


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """Response of a design at full load.

    Parameters
    ----------
    status
        How the computation ended; the efficiency is unique where the status is admissible. A
        `Status`, or a code that a search assigns (`bellcrank.search.Verdict`).
    efficiency
        As the objective defines it; nan for a mechanism.
    energy
        Elastic energy of beams, angular springs and output springs; nan if not computed.
    displacement : (N, 2)
        Displacement of each node, in lattice units. Loose pieces are at rest.
    penalty
        Penalty for violated constraints of a search, in units of the efficiency; else 0.
    reached
        Fraction of the load up to which the path of a frame is stable. Where it is below 1, the
        displacement is that of the last stable state, and the efficiency nan.
    """

    status: Outcome
    efficiency: float
    energy: float
    displacement: NDArray[np.float64]
    penalty: float = 0.0
    reached: float = 1.0

    @property
    def score(self) -> float:
        """The quantity that a search maximises: the efficiency less the penalty."""
        return self.efficiency - self.penalty

    @property
    def is_admissible(self) -> bool:
        """Whether a search may accept the design: a stable equilibrium, reached from rest."""
        return self.status.is_admissible


@dataclass(frozen=True, slots=True, eq=False)
class FlipPrediction:
    """Prediction of the effect of flips by one Newton step.

    Parameters
    ----------
    beams : (n,) int64
        The flipped beams.
    change : (n,)
        Predicted change of the efficiency; exactly zero for beams that carry no load.
    strain : (n,)
        Strain of the beam, or of an absent one between its ends as they are. Predictions for
        absent beams of large strain are inaccurate.
    """

    beams: NDArray[np.int64]
    change: NDArray[np.float64]
    strain: NDArray[np.float64]


def core_code(unloaded_beams: UnloadedBeams) -> int:
    """Return the code of a treatment of unloaded beams for the kernels.

    Raises
    ------
    InvalidSettings
        If it is unknown.
    """
    known = get_args(UnloadedBeams)
    if unloaded_beams not in known:
        raise InvalidSettings(
            f"unloaded_beams must be one of {', '.join(known)}; got {unloaded_beams!r}"
        )
    return known.index(unloaded_beams)


class SpringEvaluator:
    """Responses of designs of one problem; one instance for each thread.

    Parameters
    ----------
    problem
        Lattice, supports, input and output.
    objective
        Name of an objective (see `bellcrank.mechanics.objectives`); that of the problem by
        default.
    unloaded_beams
        ``"keep"``: all beams. ``"prune_dead_ends"``: the load-bearing core, without
        dead ends, which split angular springs although a part is not affected by them.
        ``"prune_all"``: also without pieces that hang by a single node or rest on supports
        alone, which split them as well.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> response = SpringEvaluator(crane).evaluate(crane.initial)
    >>> response.status.label, round(response.efficiency, 6)
    ('converged', -0.064086)
    """

    def __init__(
        self,
        problem: Problem,
        objective: str | None = None,
        unloaded_beams: UnloadedBeams = "keep",
    ) -> None:
        self.core = core_code(unloaded_beams)
        self.unloaded_beams: UnloadedBeams = unloaded_beams
        check_memory(problem)
        self.problem = problem
        self.system: System = build_system(problem, objective_of(problem, objective))
        self.structure: Structure = allocate_structure(self.system)
        self.scratch = allocate_scratch(self.system, self.structure)
        self.reference: Reference = allocate_reference(self.system)
        self.displacement = np.zeros_like(self.system.positions)
        self._workspace: FlipWorkspace | None = None
        self._factor_is_of_prediction = False

    def _checked(self, mask: ArrayLike) -> NDArray[np.uint8]:
        given = np.asarray(mask)
        if given.shape != (len(self.system.beams),):
            raise InvalidProblem(
                f"mask: expected shape ({len(self.system.beams)},), one entry for each beam, "
                f"got {given.shape}"
            )
        return given.astype(bool).astype(np.uint8)

    def evaluate(
        self,
        mask: ArrayLike,
        largest_increment: float = 1.0,
        *,
        warm_start: bool = False,
        lower_bound: float = -math.inf,
    ) -> Response:
        """Load the design `mask` from rest to the full stroke.

        Parameters
        ----------
        mask : (M,) bool
            Which beams are present.
        largest_increment
            Upper bound on the load increments, as a fraction of the full load. The step control
            chooses smaller ones where needed.
        warm_start
            Start from the reference equilibrium of a similar design (`set_reference`). The
            response is the same to within the tolerance, and computed faster.
        lower_bound
            With a warm start: for an equilibrium no more efficient than this, it is not
            verified that it is the one reached from rest; its status is UNVERIFIED. With a finite
            bound no design is loaded from rest: where that would be needed, the status is
            UNVERIFIED or UNCONVERGED.

        Raises
        ------
        InvalidProblem
            If the mask has the wrong length.
        """
        from bellcrank.mechanics.kernels.response import respond

        self._factor_is_of_prediction = False
        status, efficiency, energy = respond(
            self.system, self._checked(mask), self.core, self.reference, warm_start, lower_bound,
            largest_increment, self.structure, self.displacement, self.scratch,
        )  # fmt: skip
        return Response(Status(status), efficiency, energy, self.displacement.copy())

    def set_reference(self) -> None:
        """Make the equilibrium computed last, which must have converged, the reference."""
        self.reference.present[:] = self.structure.present
        self.reference.active[:] = self.structure.active
        self.reference.u[:] = self.displacement

    def for_problem(self, problem: Problem) -> SpringEvaluator:
        """Return an evaluator of the displacement in another problem, with the same settings."""
        return SpringEvaluator(problem, "displacement", self.unloaded_beams)

    def core_finder(self) -> Callable[[NDArray[np.bool_]], NDArray[np.bool_]]:
        """Return a function like `load_bearing` that leaves the last response as it is."""
        return Core(self).of

    def strain(self) -> Strain:
        """Return energies and input forces in the response computed last."""
        return strain_of(self)

    def largest_strain(self) -> float:
        """Return the largest absolute strain of a beam that carries load in the last response."""
        system, structure = self.system, self.structure
        moved = structure.active[system.beams].astype(bool).any(axis=1) & (structure.present != 0)
        ends = (system.positions + self.displacement)[system.beams[moved]]
        length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        return float(np.abs(length / system.rest_length[moved] - 1.0).max(initial=0.0))

    def output_motion(self) -> OutputMotion:
        """Return the motion of the output in the response computed last."""
        return output_motion(self.problem, self.displacement)

    def output_stiffness(self) -> float:
        """Return the stiffness of the output; see `bellcrank.mechanics.output_stiffness`."""
        return output_stiffness(self)

    def load_bearing(self, mask: ArrayLike) -> NDArray[np.bool_]:
        """Return the beams of a design that can carry load: no loose pieces, no dead ends.

        The remainder after pieces that the drive cannot reach and, repeatedly, beams that
        end in a free node of degree one are left out. Supports, input and output nodes
        are not free in this sense.

        Returns
        -------
        (M,) bool
        """
        return Core(self, PRUNE_DEAD_ENDS).of(self._checked(mask).astype(bool))

    def sensitivity(self, mask: ArrayLike) -> NDArray[np.float64]:
        """Return the first-order change of the efficiency by flipping each beam.

        From one adjoint solution.

        Returns
        -------
        (M,)
            For a present beam, the change on removing it; for an absent one, on adding
            it. Zero for beams that carry no load.

        Raises
        ------
        InvalidSettings
            If the design has no stable equilibrium at which to differentiate.
        """
        response = self.evaluate(mask)
        found = None
        if response.status in (Status.CONVERGED, Status.SNAPPED):
            workspace = allocate_flip_workspace(self.system, first_order=True)
            found = self._predict(mask, np.arange(len(self.system.beams)), workspace)
        if found is None:
            raise InvalidSettings(f"no sensitivity: {response.status.message}")
        return found.change

    def predict_flips(
        self, mask: ArrayLike, beams: ArrayLike | None = None
    ) -> FlipPrediction | None:
        """Predict the change of the efficiency by each flip, from the response computed last.

        One Newton step from the equilibrium of `mask`, which must be the design evaluated last,
        to that of each flipped design, by a low-rank update of its stiffness. Far more accurate
        than `sensitivity`, at the cost of one or two responses.

        Parameters
        ----------
        mask : (M,) bool
        beams : (n,) int64
            Beams to flip; the designable ones by default.

        Returns
        -------
        FlipPrediction or None
            None if the equilibrium is unstable.

        Raises
        ------
        InvalidSettings
            If the inverse of the stiffness does not fit into the available memory.

        Examples
        --------
        >>> from bellcrank.model import find_problem
        >>> crane = find_problem("crane")
        >>> evaluator = SpringEvaluator(crane)
        >>> efficiency = evaluator.evaluate(crane.initial).efficiency
        >>> prediction = evaluator.predict_flips(crane.initial)
        >>> best = prediction.change.argmax()
        >>> flipped = crane.initial.copy()
        >>> flipped[prediction.beams[best]] = False
        >>> gained = evaluator.evaluate(flipped).efficiency - efficiency
        >>> print(f"{prediction.change[best]:.3f} predicted, {gained:.3f} gained")
        0.026 predicted, 0.026 gained
        """
        chosen = self.problem.designable if beams is None else np.asarray(beams, dtype=np.int64)
        if self._workspace is None:
            check_memory(self.problem, predict_flips=True)
            self._workspace = allocate_flip_workspace(self.system)
        return self._predict(mask, chosen, self._workspace)

    def _predict(
        self, mask: ArrayLike, beams: NDArray[np.int64], workspace: FlipWorkspace
    ) -> FlipPrediction | None:
        from bellcrank.mechanics.kernels.flip_prediction import predict_flips

        change, strain = np.zeros(len(beams)), np.zeros(len(beams))
        found = predict_flips(
            self.system, self._checked(mask), self.core, beams, not len(workspace.inverse.parent),
            self.structure, self.displacement, self.scratch, workspace, change, strain,
        )  # fmt: skip
        self._factor_is_of_prediction = found and workspace is self._workspace
        return FlipPrediction(beams, change, strain) if found else None

    def inverse_blocks(
        self, rows: NDArray[np.int64], columns: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Return blocks of the inverse stiffness of a flip prediction, directly after it.

        Parameters
        ----------
        rows, columns : (...) int64
            Elimination indices of nodes, ``system.block``; broadcast.

        Returns
        -------
        (..., 2, 2)

        Raises
        ------
        InvalidSettings
            If the last call did not predict flips.
        """
        from bellcrank.mechanics.kernels.inverse import find_blocks

        if self._workspace is None or not self._factor_is_of_prediction:
            raise InvalidSettings("inverse_blocks: call predict_flips first")
        rows, columns = np.broadcast_arrays(rows, columns)
        found = np.zeros((rows.size, 4))
        find_blocks(
            self.structure, self.scratch, self._workspace.inverse,
            rows.flatten(), columns.flatten(), found,
        )  # fmt: skip
        return found.reshape(*rows.shape, 2, 2)
