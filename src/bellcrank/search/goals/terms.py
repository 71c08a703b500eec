"""Goals that a search must keep: a registry of terms, each written as a short text.

A term measures by how much a design breaks it: an excess from 0, kept, towards 1. What the
beams alone can tell is asked before any response is computed (`Term.of_beams`), the rest
afterwards (`Term.of_response`). To add one, write a file with a function from a problem and the
value behind the name to a `Term`, and register it with what may be written.

Examples
--------
>>> read_goal("mass <= 0.6")
Goal(text='mass <= 0.6', name='mass', value=0.6)
>>> read_goal("mass > 0.6")
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
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.mechanics import Response, SpringEvaluator
    from bellcrank.model import Problem

SMALLEST_EXCESS = 1e-6
"""Below it a goal counts as kept; responses are settled to 1e-9."""


@dataclass(frozen=True, slots=True, eq=False)
class Moved:
    """A design and its equilibrium, as terms see it.

    Parameters
    ----------
    evaluator
        Who computed the response, and still holds it.
    mask, core : (M,) bool
        The beams that are present, and those of them that carry load.
    response
        At full load.
    verified
        Whether the design is verified, so that constraints on the whole stroke are evaluated along
        it. Otherwise they are evaluated at full load only.
    """

    evaluator: SpringEvaluator
    mask: NDArray[np.bool_]
    core: NDArray[np.bool_]
    response: Response
    verified: bool = False

    @property
    def positions(self) -> NDArray[np.float64]:
        """(N, 2) of the nodes in the moved state."""
        return self.evaluator.problem.lattice.positions + self.response.displacement


@dataclass(frozen=True, slots=True, kw_only=True)
class Term:
    """What a goal measures.

    Parameters
    ----------
    of_beams
        From the mask and its load-bearing part, both (M,) bool, to an excess.
    of_response
        From the moved design to an excess.
    by_flip
        From the load-bearing part to what each beam's flip is foreseen to add to the excess,
        (M,), for searches that predict.
    foreseen
        From the moved design, just screened, and (n,) beams to the excess foreseen after the
        flip of each, (n,).
    price
        Dear terms are asked last.
    """

    of_beams: Callable[[NDArray[np.bool_], NDArray[np.bool_]], float] | None = None
    of_response: Callable[[Moved], float] | None = None
    by_flip: Callable[[NDArray[np.bool_]], NDArray[np.float64]] | None = None
    foreseen: Callable[[Moved, NDArray[np.int64]], NDArray[np.float64]] | None = None
    price: int = 0


@dataclass(frozen=True, slots=True)
class Kind:
    """An entry of the registry.

    Parameters
    ----------
    usage
        What may be written, for messages.
    read
        From what follows the name to the value; raises ValueError.
    make
        From a problem and the value to the term.
    """

    usage: str
    read: Callable[[str], Any]
    make: Callable[[Problem, Any], Term]


@dataclass(frozen=True, slots=True)
class Goal:
    """A goal as it was written, and as it was understood."""

    text: str
    name: str
    value: Any

    def term(self, problem: Problem) -> Term:
        """Return what it measures in designs of a problem.

        Raises
        ------
        InvalidSettings
            If it makes no sense there.
        """
        try:
            return terms[self.name].make(problem, self.value)
        except ValueError as error:
            raise InvalidSettings(f"goal {self.text!r}: {error}") from error


terms: Registry[Kind] = Registry("goal")


def read_goal(text: object) -> Goal:
    """Understand a goal.

    Raises
    ------
    InvalidSettings, UnknownName
    """
    parts = re.fullmatch(r"\s*([a-z-]+)\s*(.*?)\s*", text) if isinstance(text, str) else None
    if parts is None:
        raise InvalidSettings(f"goal {text!r}: expected a text like 'mass <= 0.6'")
    name, rest = parts.groups()
    kind = terms[name]
    try:
        return Goal(str(text), name, kind.read(rest))
    except ValueError:
        raise InvalidSettings(f"goal {text!r}: expected {kind.usage}") from None


def nothing(rest: str) -> None:
    """Read the rest of a goal that is only a name."""
    if rest:
        raise ValueError(rest)


def positive(text: str) -> float:
    """Read a finite number above 0."""
    number = float(text)
    if not 0.0 < number < math.inf:
        raise ValueError(text)
    return number


def at_most(rest: str) -> float:
    """Read ``<= NUMBER``."""
    return _behind("<=", rest)


def at_least(rest: str) -> float:
    """Read ``>= NUMBER``."""
    return _behind(">=", rest)


def bounded(rest: str) -> tuple[str, float]:
    """Read ``<= NUMBER`` or ``>= NUMBER``."""
    sign = rest[:2]
    return sign, (at_most if sign == "<=" else at_least)(rest)


def _behind(sign: str, rest: str) -> float:
    if not rest.startswith(sign):
        raise ValueError(rest)
    return positive(rest.removeprefix(sign))


def above(value: float, bound: float) -> float:
    """Excess of a value over its upper bound: 0 up to it, near 1 far beyond."""
    return 0.0 if value <= bound else 1.0 - bound / value


def below(value: float, bound: float) -> float:
    """Excess of a value under its lower bound: 0 from it on, 1 at 0."""
    return 0.0 if value >= bound else 1.0 - max(value, 0.0) / bound


def counted(faults: float, usual: float = 1.0) -> float:
    """Excess of a number of faults: one half at the usual number."""
    return faults / (faults + usual)
