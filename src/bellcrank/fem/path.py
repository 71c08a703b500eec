"""Equilibrium path of a part from rest to the full input.

Each step starts with a predictor, the tangent or a cubic, and ends with Newton's method. The step
is halved if the motion departs from the tangents at both of its ends, where it may have jumped to
another path, and if stability is lost, so that the load at which this happens is found. The softest
mode there shows what kind of loss it is: if the load does work along the mode, the path turns back
at a limit point and the part snaps through; if not, another path branches off at a bifurcation and
the part buckles.

Where an input starts or stops, the path has a kink: a step ends there, and the next one begins as
at rest.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

LARGEST_DEPARTURE = 0.1
"""Largest departure of a step from the mean of the tangents at its ends, as a part of the motion.
On a smooth path it is of third order in the step."""
MAX_RESIDUAL_INCREASES = 3
"""Number of first iterations in which the residual may grow; later growth means divergence."""
LARGEST_CURVATURE = 0.3
"""Largest departure of the cubic from the tangent predictor, as a fraction of the latter, at which
the cubic is used."""
FEW_ITERATIONS = 4
"""Number of iterations up to which the next step is doubled."""
SOFT = 0.15
"""Stiffness of the softest mode, as a fraction of that at rest, below which stability is considered
nearly lost."""
INVERSE_ITERATIONS = 30
"""Number of inverse iterations for the softest mode."""


class PathStatus(StrEnum):
    """How the equilibrium path ends."""

    CONVERGED = "converged"
    SNAPPED = "snapped"
    UNCONVERGED = "unconverged"
    MECHANISM = "mechanism"

    @property
    def message(self) -> str:
        """Meaning of the status as a sentence."""
        return _MESSAGES[self]


_MESSAGES = {
    PathStatus.CONVERGED: "stable from rest to the full stroke",
    PathStatus.SNAPPED: "stability is lost along the stroke: the part buckles or snaps through",
    PathStatus.UNCONVERGED: "no equilibrium was found beyond a part of the stroke",
    PathStatus.MECHANISM: "a piece is not held against moving as a rigid body",
}


class StabilityLoss(StrEnum):
    """Kind of point at which stability is lost."""

    LIMIT_POINT = "limit point"
    BIFURCATION = "bifurcation"


class FactorisedStiffness(Protocol):
    """A factorised tangent stiffness."""

    @property
    def negative_eigenvalues(self) -> int:
        """Number of negative eigenvalues: 0 in a stable state."""
        ...

    @property
    def nonsingular(self) -> bool:
        """Whether no rigid-body motion is left."""
        ...

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the solution for a right-hand side."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Linearisation:
    """Equations linearised in a state.

    Parameters
    ----------
    residual : (f,) float64
        Residual, 0 in equilibrium.
    tolerance : (f,) float64 or float
        Largest admissible size of each entry of the residual.
    stiffness
        Factorised derivative of the residual with respect to the unknowns.
    """

    residual: NDArray[np.float64]
    tolerance: NDArray[np.float64] | float
    stiffness: FactorisedStiffness


class Equations(Protocol):
    """Equilibrium equations of a part under a fraction of its full input, in N and mm."""

    @property
    def count(self) -> int:
        """Number of unknowns."""
        ...

    @property
    def kinks(self) -> tuple[float, ...]:
        """Loads between 0 and 1 at which the load derivative changes suddenly, ascending."""
        ...

    def linearise(self, unknowns: NDArray[np.float64], load: float) -> Linearisation:
        """Linearise the equations; raises RuntimeError if the stiffness is singular."""
        ...

    def load_derivative(
        self, unknowns: NDArray[np.float64], load: float, toward: float = 1.0
    ) -> NDArray[np.float64]:
        """Return (f,) the derivative of the residual with respect to the load.

        At a kink, on the side of the load `toward`.
        """
        ...

    def distance(self, change: NDArray[np.float64]) -> float:
        """Return the largest component of a change of the displacements, mm."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class PathState:
    """An equilibrium on a path.

    Parameters
    ----------
    load
        Fraction of the full input, 0 to 1.
    unknowns : (f,) float64
        Unknowns in the order of the equations.
    negative_eigenvalues
        Number of unstable directions.
    """

    load: float
    unknowns: NDArray[np.float64]
    negative_eigenvalues: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class EquilibriumPath:
    """Stable equilibria from rest on.

    Parameters
    ----------
    states
        Stable states in order of the load.
    status
        Whether the last state bears the full input and, if not, why.
    factorisations
        Number of factorisations of the stiffness.
    loss
        Kind of the loss of stability beyond the last state; None if there is none.
    """

    states: list[PathState]
    status: PathStatus
    factorisations: int
    loss: StabilityLoss | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class StepControl:
    """Step sizes of the continuation.

    Parameters
    ----------
    first, largest, smallest
        First, largest and smallest step, as fractions of the full input.
    iterations
        Newton iterations after which a step is halved.
    factorisations
        Number of factorisations after which a failed step ends the path.

    Raises
    ------
    InvalidSettings
        If the first or the largest step is not above the smallest one and at most 1.
    """

    first: float = 1.0 / 16.0
    largest: float = 1.0 / 8.0
    smallest: float = 1e-4
    iterations: int = 15
    factorisations: int = 2**31

    def __post_init__(self) -> None:
        for name in ("first", "largest"):
            step = getattr(self, name)
            if not self.smallest < step <= 1.0:
                raise InvalidSettings(
                    f"{name}: expected a fraction of the stroke above {self.smallest:g} and at "
                    f"most 1, got {step!r}"
                )


def follow_path(
    equations: Equations,
    control: StepControl | None = None,
    report: Callable[[PathState], None] = lambda _state: None,
) -> EquilibriumPath:
    """Follow the equilibrium path from rest to the full input, as far as it is stable.

    Parameters
    ----------
    equations
        Equations of the part.
    control
        Step sizes.
    report
        Called with each state on the path.
    """
    return _Continuation(equations, control or StepControl(), report).run()


@dataclass(slots=True, eq=False)
class _Continuation:
    """Continuation of one path."""

    equations: Equations
    control: StepControl
    report: Callable[[PathState], None]
    factorisations: int = field(default=0, init=False)

    def run(self) -> EquilibriumPath:
        """Follow the path from rest."""
        here = PathState(0.0, np.zeros(self.equations.count))
        states = [here]
        start = self._linearise(here.unknowns, here.load)
        if start is None or not start.stiffness.nonsingular:
            return EquilibriumPath(states, PathStatus.MECHANISM, self.factorisations)
        tangent = start.stiffness
        initial_stiffness = softest_mode(tangent, self.equations.count)[0]
        rate = self._rate(tangent, here, 1.0)
        step = min(self.control.first, self.control.largest)
        unstable = False
        before: tuple[PathState, NDArray[np.float64]] | None = None
        while here.load < 1.0:
            load = self._end_of_step(here.load, step)
            predicted = self._predict(load, here, rate, before)
            found = self._correct(load, here.unknowns + predicted)
            # An unstable equilibrium shows that the path ends with a loss of stability, even if
            # Newton's method does not converge closer to it.
            unstable |= found is not None and found[0].negative_eigenvalues > 0
            slope = None if found is None else self._joined_rate(found[0], found[2], here, rate)
            if found is None or slope is None:
                step = (load - here.load) / 2.0
                if (
                    step < self.control.smallest
                    or self.factorisations > self.control.factorisations
                ):
                    loss = self._kind_of_loss(tangent, rate, initial_stiffness)
                    lost = unstable or loss is not None
                    status = PathStatus.SNAPPED if lost else PathStatus.UNCONVERGED
                    return EquilibriumPath(states, status, self.factorisations, loss)
                continue
            before = here, rate
            here, iterations, tangent = found
            states.append(here)
            self.report(here)
            rate = slope
            if here.load in self.equations.kinks:
                before, rate = None, self._rate(tangent, here, 1.0)
            if iterations <= FEW_ITERATIONS:
                step = min(self.control.largest, step * 2.0)
        return EquilibriumPath(states, PathStatus.CONVERGED, self.factorisations)

    def _end_of_step(self, load: float, step: float) -> float:
        """Return the load at the end of a step, at most the next kink."""
        return min(load + step, *(each for each in (*self.equations.kinks, 1.0) if each > load))

    def _correct(
        self, load: float, guess: NDArray[np.float64]
    ) -> tuple[PathState, int, FactorisedStiffness] | None:
        """Return an equilibrium, its number of iterations and the last stiffness, or None.

        The last correction is applied although the residual is within the tolerance already,
        because the stiffness that it needs is computed in any case.
        """
        unknowns, allowed = guess, 0.0
        for iteration in range(self.control.iterations):
            linear = self._linearise(unknowns, load)
            if linear is None:
                return None
            relative_residual = float((np.abs(linear.residual) / linear.tolerance).max(initial=0.0))
            if iteration < MAX_RESIDUAL_INCREASES:
                allowed = max(allowed, relative_residual)
            if relative_residual > allowed:
                return None
            tangent = linear.stiffness
            unknowns = unknowns - tangent.solve(linear.residual)
            if relative_residual <= 1.0:
                return PathState(load, unknowns, tangent.negative_eigenvalues), iteration, tangent
        return None

    def _rate(
        self, tangent: FactorisedStiffness, state: PathState, toward: float
    ) -> NDArray[np.float64]:
        """Return (f,) the derivative of the unknowns with respect to the load, on one side."""
        return -tangent.solve(self.equations.load_derivative(state.unknowns, state.load, toward))

    def _predict(
        self,
        load: float,
        here: PathState,
        rate: NDArray[np.float64],
        before: tuple[PathState, NDArray[np.float64]] | None,
    ) -> NDArray[np.float64]:
        """Return (f,) the predicted change of the unknowns up to a load.

        The cubic through the last two states and their tangents is used unless it departs far
        from the last tangent, where the path bends too sharply for it.
        """
        step = load - here.load
        linear_prediction = step * rate
        if before is None:
            return linear_prediction
        last, slope = before
        taken = here.load - last.load
        ratio = step / taken
        # Hermite's cubic in the fraction of the last step, continued beyond it.
        chord, begin, end = here.unknowns - last.unknowns, taken * slope, taken * rate
        second, third = 3.0 * chord - 2.0 * begin - end, begin + end - 2.0 * chord
        curved = ratio * (begin + (2.0 + ratio) * second + (3.0 + ratio * (3.0 + ratio)) * third)
        departure = self.equations.distance(curved - linear_prediction)
        is_smooth = departure < LARGEST_CURVATURE * self.equations.distance(linear_prediction)
        return curved if is_smooth else linear_prediction

    def _joined_rate(
        self,
        state: PathState,
        tangent: FactorisedStiffness,
        here: PathState,
        rate: NDArray[np.float64],
    ) -> NDArray[np.float64] | None:
        """Return the rate at a state; None if it is unstable, or may not be on the path from here.

        A jump to another path is in the tangent of neither end.
        """
        if state.negative_eigenvalues:
            return None
        slope = self._rate(tangent, state, here.load)
        motion = state.unknowns - here.unknowns
        mean = 0.5 * (state.load - here.load) * (rate + slope)
        departure = self.equations.distance(motion - mean)
        return slope if departure <= LARGEST_DEPARTURE * self.equations.distance(motion) else None

    def _kind_of_loss(
        self, tangent: FactorisedStiffness, rate: NDArray[np.float64], initial_stiffness: float
    ) -> StabilityLoss | None:
        """Classify the loss of stability near a state; None if the softest mode is stiff."""
        stiffness, mode = softest_mode(tangent, self.equations.count)
        if stiffness > SOFT * initial_stiffness:
            return None
        along = abs(float(mode @ rate)) / float(np.linalg.norm(rate))
        return StabilityLoss.LIMIT_POINT if along > 0.5 else StabilityLoss.BIFURCATION

    def _linearise(self, unknowns: NDArray[np.float64], load: float) -> Linearisation | None:
        if not np.isfinite(unknowns).all():
            return None
        self.factorisations += 1
        try:
            linear = self.equations.linearise(unknowns, load)
        except RuntimeError:
            return None
        return linear if np.isfinite(linear.residual).all() else None


def softest_mode(tangent: FactorisedStiffness, count: int) -> tuple[float, NDArray[np.float64]]:
    """Return the eigenvalue nearest to 0 and its (f,) unit vector, by inverse iteration."""
    mode = np.random.default_rng(0).standard_normal(count)
    mode /= np.linalg.norm(mode)
    eigenvalue = 1.0
    for _ in range(INVERSE_ITERATIONS):
        solved = tangent.solve(mode)
        eigenvalue = float(mode @ solved)
        mode = solved / np.linalg.norm(solved)
    return 1.0 / eigenvalue, mode
