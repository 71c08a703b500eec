"""What a Metropolis search is told."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import Dangling, minimisers
from bellcrank.registry import Registry
from bellcrank.search.costs import costs
from bellcrank.search.schedules import schedules

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

NO_LIMIT = 2**62
MOST_CHAINS = 2**15
"""What the column of a run's history holds."""


searches: Registry[type[MetropolisSettings]] = Registry("search")
"""Ways to search, by the settings they take."""


@searches.register("paper")
@dataclass(frozen=True, slots=True, kw_only=True)
class MetropolisSettings:
    """Settings of the paper's search; the defaults are the paper's.

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
    cost, schedule
        Names in the registries of costs and schedules.
    hot, cold
        Temperatures at the start and after annealing.
    annealing
        Accepted steps over which the temperature falls.
    dangling
        Whether dead-end beams count (the literal model) or are ignored.
    minimiser
        Name of a minimiser.
    minimum_degree
        Least number of beams that a removal may leave at a free node; 0 for no rule.
    patience
        Rejections in a row after which a chain ends; None for never.

    Raises
    ------
    InvalidSettings, UnknownName

    Examples
    --------
    >>> MetropolisSettings(steps=1000).temperatures[[0, 50, 100]]
    array([0.06  , 0.0305, 0.001 ])
    """

    steps: int = 20_000
    chains: int = 4
    seed: int = 0
    objective: str | None = None
    cost: str = "exponential"
    schedule: str = "linear"
    hot: float = 0.06
    cold: float = 1e-3
    annealing: int = 100
    dangling: Dangling = "counted"
    minimiser: str = "newton"
    minimum_degree: int = 0
    patience: int | None = None

    def __post_init__(self) -> None:
        for name, least in (("steps", 1), ("seed", 0), ("annealing", 0)):
            _check_whole(name, getattr(self, name), least)
        _check_whole("chains", self.chains, 1, MOST_CHAINS)
        _check_whole("minimum_degree", self.minimum_degree, 0)
        if self.patience is not None:
            _check_whole("patience", self.patience, 1)
        for name in ("hot", "cold"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise InvalidSettings(f"{name}: expected a temperature above 0, got {value!r}")
        for registry, name in ((costs, self.cost), (schedules, self.schedule)):
            registry[name]  # an unknown name explains itself
        minimisers[self.minimiser]

    @property
    def temperatures(self) -> NDArray[np.float64]:
        """Temperature after 0, 1, 2, ... accepted steps."""
        return schedules[self.schedule](self.hot, self.cold, self.annealing)

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as plain data, as `run.json` keeps them."""
        return {"search": "paper", **asdict(self)}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> MetropolisSettings:
        """Rebuild settings from plain data.

        Raises
        ------
        InvalidSettings
            If a key is unknown.
        """
        searches[str(data.get("search", "paper"))]
        known = {field.name for field in fields(cls)}
        given = {key: value for key, value in data.items() if key != "search"}
        if unknown := sorted(set(given) - known):
            raise InvalidSettings(
                f"search settings: unknown key {unknown[0]!r}; known: {', '.join(sorted(known))}"
            )
        return cls(**given)


def _check_whole(name: str, value: object, least: int, most: int = NO_LIMIT) -> None:
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise InvalidSettings(f"{name}: expected a whole number of at least {least}, got {value!r}")
    if value > most:
        raise InvalidSettings(f"{name}: expected a whole number of at most {most}, got {value!r}")
