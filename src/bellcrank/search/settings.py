"""What every search is told."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeGuard

from bellcrank.errors import InvalidSettings
from bellcrank.search.goals.terms import read_goal

if TYPE_CHECKING:
    from bellcrank.mechanics import UnloadedBeams

NO_LIMIT = 2**62
MOST_CHAINS = 2**15
"""What the column of a run's history holds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchSettings:
    """What every search is told; each search adds its own.

    Parameters
    ----------
    steps
        Proposals of each chain.
    chains
        Independent chains, each with its own random numbers.
    seed
        Together with the chain's number it determines everything.
    objective
        Name of an efficiency, or None for the problem's own.
    unloaded_beams
        Whether dead-end beams count (the literal model), are ignored, or stripped together
        with all else that no load can reach.
    goals
        What a design must keep, each a text like ``"mass <= 0.6"`` (`bellcrank.search.goals`).
    strokes
        Parts of the full input over which the efficiency is averaged.

    Raises
    ------
    InvalidSettings, UnknownName
    """

    name: ClassVar[str]
    """In the registry of searches."""
    predicts_flips: ClassVar[bool] = False
    """Whether the search predicts all flips, which needs a dense inverse of the stiffness."""

    steps: int = 20_000
    chains: int = 4
    seed: int = 0
    objective: str | None = None
    unloaded_beams: UnloadedBeams = "prune_all"
    goals: tuple[str, ...] = ()
    strokes: tuple[float, ...] = (1.0,)

    def __post_init__(self) -> None:
        check_whole("steps", self.steps, 1)
        check_whole("seed", self.seed, 0)
        check_whole("chains", self.chains, 1, MOST_CHAINS)
        check_goals(self.goals)
        check_strokes(self.strokes)

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as plain data, as `run.json` keeps them."""
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
    """Whether something is a whole or a real number; true and false are none."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def check_whole(name: str, value: object, least: int, most: int = NO_LIMIT) -> None:
    """Refuse what is not a whole number between two bounds.

    Raises
    ------
    InvalidSettings
    """
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise InvalidSettings(f"{name}: expected a whole number of at least {least}, got {value!r}")
    if value > most:
        raise InvalidSettings(f"{name}: expected a whole number of at most {most}, got {value!r}")


def check_positive(name: str, value: object, what: str = "a number") -> None:
    """Refuse what is not a finite number above zero.

    Raises
    ------
    InvalidSettings
    """
    if not is_number(value) or not 0.0 < value < math.inf:
        raise InvalidSettings(f"{name}: expected {what} above 0, got {value!r}")


def check_goals(goals: object) -> None:
    """Refuse what is not a tuple of texts that each name a goal.

    Raises
    ------
    InvalidSettings, UnknownName
    """
    if not isinstance(goals, tuple):
        raise InvalidSettings(f"goals: expected texts like 'mass <= 0.6', got {goals!r}")
    for goal in goals:
        read_goal(goal)


def check_strokes(strokes: object) -> None:
    """Refuse what is not a tuple of different parts of the full input.

    Raises
    ------
    InvalidSettings
    """
    if not isinstance(strokes, tuple) or not strokes or len(set(strokes)) < len(strokes):
        raise InvalidSettings(
            f"strokes: expected different parts of the full input, got {strokes!r}"
        )
    for stroke in strokes:
        check_positive("strokes", stroke, "parts of the full input")
        check_part("strokes", stroke)


def check_part(name: str, value: object) -> None:
    """Refuse what is not a number from 0 to 1.

    Raises
    ------
    InvalidSettings
    """
    if not is_number(value) or not 0.0 <= value <= 1.0:
        raise InvalidSettings(f"{name}: expected a part from 0 to 1, got {value!r}")
