"""Settings that all searches share."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeGuard

from bellcrank.errors import InvalidSettings
from bellcrank.search.constraints.constraint import parse_goal

if TYPE_CHECKING:
    from bellcrank.mechanics import UnloadedBeams
    from bellcrank.registry import Registry

NO_LIMIT = 2**62
MAX_CHAINS = 2**15
"""Bound set by the integer type of the column in a run's history."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchSettings:
    """Settings that all searches share; each search adds its own.

    Parameters
    ----------
    steps
        Number of proposals of each chain.
    chains
        Number of independent chains.
    seed
        Seed of the random numbers; with the number of a chain it determines the chain.
    objective
        Name of an objective, or None for the problem's default.
    unloaded_beams
        Treatment of beams that carry no load: ``"keep"`` (they remain in the model),
        ``"prune_dead_ends"`` or ``"prune_all"``.
    goals
        Constraints on the design, each a text such as ``"mass <= 0.6"``
        (`bellcrank.search.constraints`).
    strokes
        Fractions of the full input over which the efficiency is averaged.
    before_refinement
        Whether the design is refined afterwards: the search relaxes the bounds of a specification
        that a refinement meets more easily than a search (`bellcrank.search.relaxed`).

    Raises
    ------
    InvalidSettings, UnknownName
    """

    name: ClassVar[str]
    """Name in the registry of searches."""
    predicts_flips: ClassVar[bool] = False
    """Whether the search predicts all flips, which needs parts of the inverse stiffness."""

    steps: int = 25_000
    chains: int = 2
    seed: int = 0
    objective: str | None = None
    unloaded_beams: UnloadedBeams = "prune_all"
    goals: tuple[str, ...] = ()
    strokes: tuple[float, ...] = (1.0,)
    before_refinement: bool = False

    def __post_init__(self) -> None:
        check_whole("steps", self.steps, 1)
        check_whole("seed", self.seed, 0)
        check_whole("chains", self.chains, 1, MAX_CHAINS)
        check_goals(self.goals)
        check_strokes(self.strokes)
        if not isinstance(self.before_refinement, bool):
            raise InvalidSettings(
                f"before_refinement: expected true or false, got {self.before_refinement!r}"
            )

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as plain data, the form stored in `run.json`."""
        return {"search": self.name, **asdict(self)}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """Rebuild settings from plain data.

        Raises
        ------
        InvalidSettings
            If a key is unknown.
        """
        known = {field.name for field in fields(cls)}
        given: dict[str, Any] = {
            key: tuple(value) if isinstance(value, list) else value
            for key, value in data.items()
            if key != "search"
        }
        if unknown := sorted(set(given) - known):
            raise InvalidSettings(
                f"search {cls.name!r} has no setting {unknown[0]!r}; it has: "
                f"{', '.join(sorted(known))}"
            )
        return cls(**given)


def is_number(value: object) -> TypeGuard[float]:
    """Whether a value is an integer or a real number, and not a Boolean."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def check_whole(name: str, value: object, least: int, most: int = NO_LIMIT) -> None:
    """Raise an error unless a value is an integer between two bounds.

    Raises
    ------
    InvalidSettings
    """
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise InvalidSettings(f"{name}: expected a whole number of at least {least}, got {value!r}")
    if value > most:
        raise InvalidSettings(f"{name}: expected a whole number of at most {most}, got {value!r}")


def check_positive(name: str, value: object, what: str = "a number") -> None:
    """Raise an error unless a value is a finite number above zero.

    Raises
    ------
    InvalidSettings
    """
    if not is_number(value) or not 0.0 < value < math.inf:
        raise InvalidSettings(f"{name}: expected {what} above 0, got {value!r}")


def check_goals(goals: object) -> None:
    """Raise an error unless a value is a tuple of valid goals.

    Raises
    ------
    InvalidSettings, UnknownName
    """
    if not isinstance(goals, tuple):
        raise InvalidSettings(f"goals: expected texts like 'mass <= 0.6', got {goals!r}")
    for goal in goals:
        parse_goal(goal)


def check_strokes(strokes: object) -> None:
    """Raise an error unless a value is a tuple of different fractions of the full input.

    Raises
    ------
    InvalidSettings
    """
    if not isinstance(strokes, tuple) or not strokes or len(set(strokes)) < len(strokes):
        raise InvalidSettings(
            f"strokes: expected different fractions of the full input, got {strokes!r}"
        )
    for stroke in strokes:
        check_positive("strokes", stroke, "fractions of the full input")
        check_fraction("strokes", stroke)


def check_fraction(name: str, value: object) -> None:
    """Raise an error unless a value is a number from 0 to 1.

    Raises
    ------
    InvalidSettings
    """
    if not is_number(value) or not 0.0 <= value <= 1.0:
        raise InvalidSettings(f"{name}: expected a fraction from 0 to 1, got {value!r}")


def check_names(name: str, values: object, registry: Registry[Any]) -> None:
    """Raise an error unless a value is a non-empty tuple of names in a registry.

    Raises
    ------
    InvalidSettings, UnknownName
    """
    if not isinstance(values, tuple) or not values:
        raise InvalidSettings(
            f"{name}: expected names of {name}, such as [{registry.names()[0]!r}], got {values!r}"
        )
    for value in values:
        registry[value]  # raises UnknownName
