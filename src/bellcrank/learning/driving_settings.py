"""What a network-driven search is told, and what its chains are told in turn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from bellcrank.errors import InvalidSettings
from bellcrank.search import MetropolisSettings
from bellcrank.search.delayed_acceptance import ScreenedSettings

FIRST_CHAIN = 1
"""Runs of a dataset are all chain 0, each of its own seed: none of ours repeats one of them."""

CHANGEABLE = ("cost", "schedule", "hot", "cold", "annealing")
"""Settings of the chains; all others are the paper's."""

SCREENING = ("doubt", "least_chance", "lookahead")
"""Settings that an exact search has besides, see `ScreenedSettings`."""

LOOKAHEAD = 1
"""Unless told otherwise: chains side by side fill the batches, and nothing is scored in vain."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Driving:
    """What a network-driven search is told; the defaults are the paper's.

    Parameters
    ----------
    chains, steps, seed
        Independent chains, proposals of each, and what names their random numbers.
    caution
        How many standard deviations between the networks to take off their mean.
    checked
        How many of the best different designs of each chain, as predicted, the mechanics checks
        besides the last.
    confirm
        Steps after which the mechanics confirms a stretch of a chain or takes it back, see
        `bellcrank.learning.stretches`; 0 for never, as in the paper.
    exact
        Whether networks only screen what is proposed, and the mechanics decides.
    compare
        Whether to run as many chains of the mechanics.
    search
        What of the search ``paper`` is to differ: `CHANGEABLE` settings, and `SCREENING` ones of
        an exact search.

    Raises
    ------
    InvalidSettings, UnknownName
    """

    chains: int = 100
    steps: int = 582
    seed: int = 0
    caution: float = 0.0
    checked: int = 10
    confirm: int = 0
    exact: bool = False
    compare: bool = True
    search: dict[str, Any] | None = None

    def __post_init__(self) -> None:
        if isinstance(self.checked, bool) or not isinstance(self.checked, int) or self.checked < 1:
            raise InvalidSettings(f"checked: expected at least 1 design, got {self.checked!r}")
        if isinstance(self.confirm, bool) or not isinstance(self.confirm, int) or self.confirm < 0:
            raise InvalidSettings(f"confirm: expected a number of steps, got {self.confirm!r}")
        if self.exact and self.confirm:
            raise InvalidSettings(
                f"confirm: in an exact search the mechanics decides on every step already; leave "
                f"it at 0, got {self.confirm!r}"
            )
        self._check_search()

    def _check_search(self) -> None:
        given = set(self.search or {})
        if not self.exact and (foreign := sorted(given.intersection(SCREENING))):
            raise InvalidSettings(
                f"{foreign[0]}: how networks screen belongs to an exact search (--exact)"
            )
        known = (*CHANGEABLE, *(SCREENING if self.exact else ()))
        if unknown := sorted(given.difference(known)):
            raise InvalidSettings(
                f"{unknown[0]}: a search driven by networks can change only "
                f"{', '.join(known)}: efficiencies are what the networks have learnt"
            )
        _ = self.rule, self.screened_rule  # refuse what makes no sense

    @property
    def rule(self) -> MetropolisSettings:
        """Settings of the chains by networks, and of those of the mechanics."""
        search = {key: self._all[key] for key in self._all if key not in SCREENING}
        return MetropolisSettings.from_dict(search)

    @property
    def screened_rule(self) -> ScreenedSettings | None:
        """Settings of the chains of an exact search; None if it is not."""
        if not self.exact:
            return None
        return ScreenedSettings.from_dict({"lookahead": LOOKAHEAD, **self._all})

    @property
    def _all(self) -> dict[str, Any]:
        given = {"steps": self.steps, "chains": self.chains, "seed": self.seed}
        return {**given, **(self.search or {})}
