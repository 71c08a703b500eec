"""Along the stroke: equilibria of a part from rest to the full input.

A step begins with a predictor, the tangent or a cubic, and ends with Newton's method. It is made
smaller where the corrector ends far from the predictor, so that the path is not left for another
one, and where stability is lost, so that the load at which it is lost is known. There the softest
mode tells what happens: if the load pulls along it, the path turns back (a limit point) and the
part jumps; if not, another path branches off (a bifurcation) and the part buckles into it.
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

SMALLEST_STEP = 1e-4
LARGEST_DEPARTURE = 0.5
"""Of the corrector from the predictor, as a part of the predicted motion."""
HOPE = 3
"""Iterations that may raise the residual; one that does later is on its way to nowhere."""
CURVED = 0.3
"""Departure of the curved from the straight predictor up to which it is trusted."""
EASY = 4
"""Iterations up to which the next step is larger."""
SOFT = 0.15
"""Stiffness of the softest mode, as a part of what it was at rest, that counts as nearly lost."""
POWERS = 30
"""Inverse iterations for the softest mode."""


class PathStatus(StrEnum):
    """How far a path goes."""

    CONVERGED = "converged"
    SNAPPED = "snapped"
    UNCONVERGED = "unconverged"
    MECHANISM = "mechanism"

    @property
    def message(self) -> str:
        """What it means, as a sentence."""
        return _MESSAGES[self]


_MESSAGES = {
    PathStatus.CONVERGED: "stable from rest to the full stroke",
    PathStatus.SNAPPED: "stability is lost along the stroke: the part buckles or snaps through",
    PathStatus.UNCONVERGED: "no equilibrium was found beyond a part of the stroke",
    PathStatus.MECHANISM: "a piece is not held against moving as a rigid body",
}


class Loss(StrEnum):
    """How stability is lost."""

    LIMIT_POINT = "limit point"
    BIFURCATION = "bifurcation"


class Factor(Protocol):
    """A factorised tangent stiffness."""

    @property
    def negative(self) -> int:
        """Number of directions in which the state is unstable."""
        ...

    @property
    def firm(self) -> bool:
        """Whether everything is held in place, so that solutions mean something."""
        ...

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the solution for a right-hand side."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Linearised:
    """Equations near a state.

    Parameters
    ----------
    residual : (f,)
        0 in equilibrium.
    tolerance : (f,) or number
        What may be left of each entry of the residual.
    factor
        Of the derivative of the residual by the unknowns.
    """

    residual: NDArray[np.float64]
    tolerance: NDArray[np.float64] | float
    factor: Factor


class Equations(Protocol):
    """Equilibrium of a part under some of its full input; forces in N, lengths in mm."""

    @property
    def count(self) -> int:
        """Number of unknowns."""
        ...

    def linearise(self, unknowns: NDArray[np.float64], load: float) -> Linearised:
        """Return the equations near a state; RuntimeError if the stiffness is singular."""
        ...

    def pull(self, unknowns: NDArray[np.float64], load: float) -> NDArray[np.float64]:
        """Return (f,) the derivative of the residual by the load."""
        ...

    def distance(self, change: NDArray[np.float64]) -> float:
        """Return how far a change of the unknowns moves the part."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """An equilibrium.

    Parameters
    ----------
    load
        Part of the full input, 0 to 1.
    unknowns : (f,)
        As the equations number them.
    negative
        Directions in which it is unstable.
    """

    load: float
    unknowns: NDArray[np.float64]
    negative: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """Equilibria from rest on.

    Parameters
    ----------
    states
        In order of the load, all stable.
    status
        Whether the last one bears the full input, and if not, why.
    loss
        How stability is lost behind the last one, if it is.
    factorisations
        What it cost.
    """

    states: list[State]
    status: PathStatus
    factorisations: int
    loss: Loss | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Stepping:
    """How a path is followed.

    Parameters
    ----------
    first, largest
        Parts of the input that steps may take.
    iterations
        Of Newton's method before a step is halved.

    Raises
    ------
    InvalidSettings
        Unless steps are above 0 and at most the whole input.
    """

    first: float = 1.0 / 16.0
    largest: float = 1.0 / 8.0
    iterations: int = 15

    def __post_init__(self) -> None:
        for name in ("first", "largest"):
            step = getattr(self, name)
            if not SMALLEST_STEP < step <= 1.0:
                raise InvalidSettings(
                    f"{name}: expected a part of the stroke above {SMALLEST_STEP:g}, got {step!r}"
                )


@dataclass(slots=True, eq=False)
class Follower:
    """Follows one path.

    Parameters
    ----------
    equations
        Whose path.
    stepping
        With what steps.
    tell
        Called with each state that is reached.
    """

    equations: Equations
    stepping: Stepping
    tell: Callable[[State], None] = lambda _state: None
    factorisations: int = field(default=0, init=False)

    def correct(self, load: float, guess: NDArray[np.float64]) -> tuple[State, int, Factor] | None:
        """Return an equilibrium, the iterations to it and the last factor; None if none is found.

        The last correction is made although the state before it is settled already: the factor
        that it needs is needed anyway.
        """
        unknowns, first = guess, 0.0
        for iteration in range(self.stepping.iterations):
            near = self._linearise(unknowns, load)
            if near is None:
                return None
            left = float((np.abs(near.residual) / near.tolerance).max(initial=0.0))
            first = max(first, left) if iteration < HOPE else first
            if left > first:
                return None
            unknowns = unknowns - near.factor.solve(near.residual)
            if left <= 1.0:
                return State(load, unknowns, near.factor.negative), iteration, near.factor
        return None

    def rate(self, factor: Factor, state: State) -> NDArray[np.float64]:
        """Return (f,) the motion for all of the input at once, by the tangent at a state."""
        return -factor.solve(self.equations.pull(state.unknowns, state.load))

    def predict(
        self,
        load: float,
        here: State,
        rate: NDArray[np.float64],
        before: tuple[State, NDArray[np.float64]] | None,
    ) -> NDArray[np.float64]:
        """Return (f,) the motion to expect up to a load.

        By the cubic through the last two states with their tangents, unless that leads far off
        the last tangent, where a path bends too sharply for it.
        """
        step = load - here.load
        straight = step * rate
        if before is None:
            return straight
        last, slope = before
        taken = here.load - last.load
        part = step / taken
        # Hermite's cubic in the part of the last step, continued beyond it.
        chord, begin, end = here.unknowns - last.unknowns, taken * slope, taken * rate
        second, third = 3.0 * chord - 2.0 * begin - end, begin + end - 2.0 * chord
        curved = part * (begin + (2.0 + part) * second + (3.0 + part * (3.0 + part)) * third)
        bend = self.equations.distance(curved - straight)
        return curved if bend < CURVED * self.equations.distance(straight) else straight

    def strays(self, state: State, here: State, ahead: NDArray[np.float64]) -> bool:
        """Whether a state is so far from where it was expected that it may be another path's."""
        departure = self.equations.distance(state.unknowns - here.unknowns - ahead)
        return departure > LARGEST_DEPARTURE * self.equations.distance(ahead)

    def follow(self, start: State | None = None) -> Path:
        """Follow the path on which a state lies; by default that from rest."""
        here = start or State(0.0, np.zeros(self.equations.count))
        states = [here]
        near = self._linearise(here.unknowns, here.load)
        if near is None or not near.factor.firm:
            return Path(states, PathStatus.MECHANISM, self.factorisations)
        factor = near.factor
        hard = softest_mode(factor, self.equations.count)[0]
        rate = self.rate(factor, here)
        step = min(self.stepping.first, self.stepping.largest)
        unstable = False
        before: tuple[State, NDArray[np.float64]] | None = None
        while here.load < 1.0:
            load = min(1.0, here.load + step)
            ahead = self.predict(load, here, rate, before)
            found = self.correct(load, here.unknowns + ahead)
            # An unstable equilibrium ahead tells that the path ends where stability is lost,
            # even if Newton's method finds nothing at all closer to it.
            unstable |= found is not None and found[0].negative > 0
            if found is None or found[0].negative or self.strays(found[0], here, ahead):
                step = (load - here.load) / 2.0
                if step < SMALLEST_STEP:
                    loss = self._loss(factor, rate, hard)
                    lost = unstable or loss is not None
                    status = PathStatus.SNAPPED if lost else PathStatus.UNCONVERGED
                    return Path(states, status, self.factorisations, loss)
                continue
            before = here, rate
            here, iterations, factor = found
            states.append(here)
            self.tell(here)
            rate = self.rate(factor, here)
            step = min(self.stepping.largest, step * 2.0) if iterations <= EASY else step
        return Path(states, PathStatus.CONVERGED, self.factorisations)

    def _loss(self, factor: Factor, rate: NDArray[np.float64], hard: float) -> Loss | None:
        """Tell how stability is lost near a state; None if it is not."""
        stiffness, mode = softest_mode(factor, self.equations.count)
        if stiffness > SOFT * hard:
            return None
        along = abs(float(mode @ rate)) / float(np.linalg.norm(rate))
        return Loss.LIMIT_POINT if along > 0.5 else Loss.BIFURCATION

    def _linearise(self, unknowns: NDArray[np.float64], load: float) -> Linearised | None:
        if not np.isfinite(unknowns).all():
            return None
        self.factorisations += 1
        try:
            near = self.equations.linearise(unknowns, load)
        except RuntimeError:
            return None
        return near if np.isfinite(near.residual).all() else None


def softest_mode(factor: Factor, count: int) -> tuple[float, NDArray[np.float64]]:
    """Return the eigenvalue nearest to 0 and its (f,) unit vector, by inverse iteration."""
    mode = np.random.default_rng(0).standard_normal(count)
    mode /= np.linalg.norm(mode)
    size = 1.0
    for _ in range(POWERS):
        moved = factor.solve(mode)
        size = float(mode @ moved)
        mode = moved / np.linalg.norm(moved)
    return 1.0 / size, mode


def follow(
    equations: Equations,
    stepping: Stepping | None = None,
    tell: Callable[[State], None] = lambda _state: None,
) -> Path:
    """Follow the path of a part from rest to its full input, as far as it is stable.

    Parameters
    ----------
    equations
        Of the part.
    stepping
        With what steps.
    tell
        Called with each state that is reached.
    """
    return Follower(equations, stepping or Stepping(), tell).follow()
