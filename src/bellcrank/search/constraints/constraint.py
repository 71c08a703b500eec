"""Constraints on designs: a registry, in which each entry is written as a short text (a goal).

A constraint measures by how much a design violates it: 0 if it is satisfied, towards 1 far from
it. Violations that follow from the beams alone are computed before any response
(`Constraint.structure_violation`), the others afterwards (`Constraint.response_violation`). To
add one, write a function from a problem and the parsed value to a `Constraint`, and register it
with its syntax.

Examples
--------
>>> parse_goal("mass <= 0.6")
Goal(text='mass <= 0.6', name='mass', value=0.6)
>>> parse_goal("mass > 0.6")
Traceback (most recent call last):
    ...
bellcrank.errors.InvalidSettings: goal 'mass > 0.6': expected 'mass <= NUMBER', the number above 0
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings
from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.mechanics import ModelEvaluator, Response
    from bellcrank.model import Problem

TOLERANCE = 1e-6
"""Violation up to which a constraint is satisfied; responses are converged to 1e-9."""


@dataclass(frozen=True, slots=True, eq=False)
class DeformedDesign:
    """A design in equilibrium, the argument of constraints on the response.

    Parameters
    ----------
    evaluator
        The evaluator that computed the response and still holds its equilibrium.
    mask, core : (M,) bool
        The beams that are present, and those of them that carry load.
    response
        Response at full load.
    verified
        Whether the design is being verified. Constraints on the whole stroke are then evaluated
        along it, otherwise at full load only.
    """

    evaluator: ModelEvaluator
    mask: NDArray[np.bool_]
    core: NDArray[np.bool_]
    response: Response
    verified: bool = False

    @property
    def positions(self) -> NDArray[np.float64]:
        """(N, d) positions of the nodes at full load."""
        return self.evaluator.problem.lattice.positions + self.response.displacement


@dataclass(frozen=True, slots=True, kw_only=True)
class Constraint:
    """Functions that measure the violation of a constraint in one problem.

    Parameters
    ----------
    structure_violation
        From the mask and its load-bearing part, both (M,) bool, to a violation.
    response_violation
        From the deformed design to a violation.
    flip_change
        From the load-bearing part to the predicted change of the violation by the flip of each
        beam, (M,).
    predicted_violation
        From the deformed design, whose flips have been predicted, and (n,) beams to the predicted
        violation after the flip of each, (n,).
    evaluation_cost
        Rank by computing time: expensive constraints are evaluated last.
    """

    structure_violation: Callable[[NDArray[np.bool_], NDArray[np.bool_]], float] | None = None
    response_violation: Callable[[DeformedDesign], float] | None = None
    flip_change: Callable[[NDArray[np.bool_]], NDArray[np.float64]] | None = None
    predicted_violation: (
        Callable[[DeformedDesign, NDArray[np.int64]], NDArray[np.float64]] | None
    ) = None
    evaluation_cost: int = 0


@dataclass(frozen=True, slots=True)
class ConstraintType:
    """Entry of the registry of constraints.

    Parameters
    ----------
    usage
        Syntax, for messages.
    parse
        From the text after the name to the value; raises ValueError.
    make
        From a problem and the value to the constraint; raises ValueError.
    """

    usage: str
    parse: Callable[[str], Any]
    make: Callable[[Problem, Any], Constraint]


@dataclass(frozen=True, slots=True)
class Goal:
    """A constraint as text, with its name and its parsed value."""

    text: str
    name: str
    value: Any

    def constraint(self, problem: Problem) -> Constraint:
        """Return the constraint for a problem.

        Raises
        ------
        InvalidSettings
            If the constraint does not apply to the problem.
        """
        try:
            return constraints[self.name].make(problem, self.value)
        except ValueError as error:
            raise InvalidSettings(f"goal {self.text!r}: {error}") from error


constraints: Registry[ConstraintType] = Registry("goal")


def mirror_axes(goals: Iterable[Goal]) -> list[str]:
    """Return the axes along which goals demand mirror symmetry.

    >>> mirror_axes([parse_goal("mirror x"), parse_goal("no-contact 0.2")])
    ['x']
    """
    return [goal.value for goal in goals if goal.name == "mirror"]


def parse_goal(text: object) -> Goal:
    """Parse the text of a goal.

    Raises
    ------
    InvalidSettings, UnknownName
    """
    parts = re.fullmatch(r"\s*([a-z-]+)\s*(.*?)\s*", text) if isinstance(text, str) else None
    if parts is None:
        raise InvalidSettings(f"goal {text!r}: expected a text like 'mass <= 0.6'")
    name, rest = parts.groups()
    kind = constraints[name]
    try:
        return Goal(str(text), name, kind.parse(rest))
    except ValueError:
        raise InvalidSettings(f"goal {text!r}: expected {kind.usage}") from None


def no_value(rest: str) -> None:
    """Parse the rest of a goal without a value."""
    if rest:
        raise ValueError(rest)


def positive(text: str) -> float:
    """Parse a finite number above 0."""
    number = float(text)
    if not 0.0 < number < math.inf:
        raise ValueError(text)
    return number


def at_most(rest: str) -> float:
    """Parse ``<= NUMBER``."""
    return _after("<=", rest)


def at_least(rest: str) -> float:
    """Parse ``>= NUMBER``."""
    return _after(">=", rest)


def bounded(rest: str) -> tuple[str, float]:
    """Parse ``<= NUMBER`` or ``>= NUMBER``."""
    sign = rest[:2]
    return sign, (at_most if sign == "<=" else at_least)(rest)


def _after(sign: str, rest: str) -> float:
    if not rest.startswith(sign):
        raise ValueError(rest)
    return positive(rest.removeprefix(sign))


def above(value: float, bound: float) -> float:
    """Return the violation of an upper bound: 0 up to it, near 1 far beyond."""
    return 0.0 if value <= bound else 1.0 - bound / value


def below(value: float, bound: float) -> float:
    """Return the violation of a lower bound: 0 from it on, 1 at 0."""
    return 0.0 if value >= bound else 1.0 - max(value, 0.0) / bound


def counted(faults: float, half: float = 1.0) -> float:
    """Return the violation for a number of faults: 1/2 at `half`, towards 1 beyond."""
    return faults / (faults + half)
