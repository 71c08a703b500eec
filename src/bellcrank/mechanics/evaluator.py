"""The response of designs: the public face of the mechanics."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from bellcrank.errors import InvalidProblem, InvalidSettings
from bellcrank.mechanics.kernels.arrays import (
    IGNORED,
    Known,
    Structure,
    System,
)
from bellcrank.mechanics.memory import check_memory
from bellcrank.mechanics.objectives import objective_of
from bellcrank.mechanics.status import Status
from bellcrank.mechanics.system import (
    allocate_flip_workspace,
    allocate_known,
    allocate_scratch,
    allocate_structure,
    build_system,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from bellcrank.mechanics.kernels.flip_prediction import FlipWorkspace
    from bellcrank.mechanics.status import Outcome
    from bellcrank.model import Design, Problem

UnloadedBeams = Literal["keep", "prune_dead_ends", "prune_all"]


VERIFICATION_INCREMENT = 1 / 32
"""Largest increment of the load for a design that somebody will build: a search may take longer
strides, and miss that one in a hundred of the designs near a loss of stability snaps."""


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """What a design does at full load.

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
        Of each node, in lattice units. Loose pieces are at rest.
    penalty
        For breaking the goals of a search, in units of the efficiency; 0 if they are kept.
    """

    status: Outcome
    efficiency: float
    energy: float
    displacement: NDArray[np.float64]
    penalty: float = 0.0

    @property
    def score(self) -> float:
        """What a search raises: the efficiency, less the penalty for broken goals."""
        return self.efficiency - self.penalty

    @property
    def is_admissible(self) -> bool:
        """Whether a search may go there: the equilibrium is stable and reached from rest."""
        return self.status.is_admissible


@dataclass(frozen=True, slots=True, eq=False)
class FlipPrediction:
    """What one Newton step tells of each flip of some beams.

    Parameters
    ----------
    beams : (n,) int64
        Which.
    change : (n,)
        Of the efficiency, as predicted; exactly zero for flips that no load can feel.
    strain : (n,)
        Of the beam, or of an absent one put between its ends as they are. Predictions for
        absent beams of large strain are wrong.
    """

    beams: NDArray[np.int64]
    change: NDArray[np.float64]
    strain: NDArray[np.float64]


class SpringEvaluator:
    """Computes responses of designs of one problem; one instance for each thread.

    Parameters
    ----------
    problem
        What is driven, held and measured.
    objective
        Name of an efficiency (see `bellcrank.mechanics.objectives`); the problem's own
        by default.
    unloaded_beams
        ``"keep"``: the literal model. ``"prune_dead_ends"``: the load-bearing core, without
        dead-end beams, whose splitting of angular springs no real part has.
        ``"prune_all"``: also without what hangs by a single node or stands on supports
        alone, which splits them as well.

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
        if unloaded_beams not in get_args(UnloadedBeams):
            raise InvalidSettings(
                f"unloaded_beams must be one of {', '.join(get_args(UnloadedBeams))}; "
                f"got {unloaded_beams!r}"
            )
        check_memory(problem)
        self.problem = problem
        self.core = get_args(UnloadedBeams).index(unloaded_beams)
        self.system: System = build_system(problem, objective_of(problem, objective))
        self.structure: Structure = allocate_structure(self.system)
        self.scratch = allocate_scratch(self.system, self.structure)
        self.known: Known = allocate_known(self.system)
        self.displacement = np.zeros_like(self.system.positions)
        self._screen: FlipWorkspace | None = None

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
            Upper bound on the load increments, as a fraction of the full load; smaller
            values follow the path more finely than the step control asks for.
        warm_start
            Start from the reference equilibrium of a similar design (`set_reference`). The
            response is the same to within the tolerance, and computed faster.
        lower_bound
            With a warm start: for an equilibrium no more efficient than this, it is not
            verified that it is the one reached from rest; its status is UNVERIFIED.

        Raises
        ------
        InvalidProblem
            If the mask has the wrong length.
        """
        return self._load(mask, self.core, warm_start, lower_bound, largest_increment)

    def _load(
        self, mask: ArrayLike, core: int, nearby: bool, least: float, largest_increment: float
    ) -> Response:
        from bellcrank.mechanics.kernels.response import respond

        status, efficiency, energy = respond(
            self.system, self._checked(mask), core, self.known, nearby, least,
            largest_increment, self.structure, self.displacement, self.scratch,
        )  # fmt: skip
        return Response(Status(status), efficiency, energy, self.displacement.copy())

    def set_reference(self) -> None:
        """Keep the equilibrium computed last, which must have converged, for warm starts."""
        self.known.present[:] = self.structure.present
        self.known.active[:] = self.structure.active
        self.known.u[:] = self.displacement

    def load_bearing(self, mask: ArrayLike) -> NDArray[np.bool_]:
        """Return which beams of a design can carry load: no loose pieces, no dead ends.

        What remains when pieces that the drive cannot reach and, repeatedly, beams that
        end in a free node of degree one are left out. Supports, input and output nodes
        are not free in this sense.

        Returns
        -------
        (M,) bool
        """
        self._load(mask, IGNORED, False, -math.inf, 1.0)
        ends_move = self.structure.active[self.system.beams].astype(bool).any(axis=1)
        core: NDArray[np.bool_] = (self.structure.present != 0) & ends_move
        return core

    def sensitivity(self, mask: ArrayLike) -> NDArray[np.float64]:
        """First-order change of the efficiency by flipping each beam, from one adjoint solve.

        Returns
        -------
        (M,)
            For a present beam, the change on removing it; for an absent one, on adding
            it. Zero for flips that no load can feel.

        Raises
        ------
        InvalidSettings
            If the design has no stable equilibrium to differentiate at.
        """
        from bellcrank.mechanics.kernels.sensitivity import find_sensitivity

        response = self.evaluate(mask)
        sensitivity = np.zeros(len(self.system.beams))
        found = response.status in (Status.CONVERGED, Status.SNAPPED) and find_sensitivity(
            self.system, self._checked(mask), self.core,
            self.structure, self.displacement, self.scratch,
            np.zeros(len(self.displacement), np.uint8), sensitivity,
        )  # fmt: skip
        if not found:
            raise InvalidSettings(f"no sensitivity: {response.status.message}")
        return sensitivity

    def predict_flips(
        self, mask: ArrayLike, beams: ArrayLike | None = None
    ) -> FlipPrediction | None:
        """Predict the change of the efficiency by each flip, from the response computed last.

        One Newton step from the equilibrium of `mask`, which must be the design that
        `evaluate` was last called with, to that of each flipped design,
        by a low-rank change of its stiffness. Much nearer to the truth than `sensitivity`,
        and for the price of one or two responses.

        Parameters
        ----------
        mask : (M,) bool
        beams : (n,) int64
            Which to flip; the designable ones by default.

        Returns
        -------
        FlipPrediction or None
            None if the equilibrium is unstable, so that there is nothing to start from.

        Examples
        --------
        >>> from bellcrank.model import find_problem
        >>> crane = find_problem("crane")
        >>> evaluator = SpringEvaluator(crane)
        >>> efficiency = evaluator.evaluate(crane.initial).efficiency
        >>> screening = evaluator.predict_flips(crane.initial)
        >>> best = screening.change.argmax()
        >>> flipped = crane.initial.copy()
        >>> flipped[screening.beams[best]] = False
        >>> gained = evaluator.evaluate(flipped).efficiency - efficiency
        >>> print(f"{screening.change[best]:.3f} predicted, {gained:.3f} gained")
        0.026 predicted, 0.026 gained
        """
        from bellcrank.mechanics.kernels.flip_prediction import predict_flips

        chosen = self.problem.designable if beams is None else np.asarray(beams, dtype=np.int64)
        if self._screen is None:
            check_memory(self.problem, predict_flips=True)
            self._screen = allocate_flip_workspace(self.system, self.structure)
        change, strain = np.zeros(len(chosen)), np.zeros(len(chosen))
        found = predict_flips(
            self.system, self._checked(mask), self.core, chosen, self.structure,
            self.displacement, self.scratch, self._screen, change, strain,
        )  # fmt: skip
        return FlipPrediction(chosen, change, strain) if found else None

    def flexibility(self) -> NDArray[np.float64]:
        """Return (n, 2, n, 2) the inverse of the stiffness that `screen` looked at last.

        By elimination index of the nodes, ``system.block``.

        Raises
        ------
        InvalidSettings
            If nothing was screened yet.
        """
        if self._screen is None:
            raise InvalidSettings("flexibility: screen a design first")
        nodes = len(self._screen.inverse)
        square = self._screen.inverse.reshape(nodes, nodes, 2, 2).transpose(0, 2, 1, 3)
        lower = np.tril(square.reshape(2 * nodes, 2 * nodes))
        whole: NDArray[np.float64] = lower + np.tril(lower, -1).T
        return whole.reshape(nodes, 2, nodes, 2)


def load_bearing_core(design: Design) -> NDArray[np.bool_]:
    """Return the mask of the beams that can carry load: see `SpringEvaluator.load_bearing`.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane").full_design()
    >>> bool(load_bearing_core(crane).all())
    True
    """
    return SpringEvaluator(design.problem, "displacement").load_bearing(design.mask)
