"""What a network-driven search has made: records, as plain data and in figures."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bellcrank.learning.scoring import Truth
    from bellcrank.model import Problem

DRIVEN_SCHEMA = "bellcrank/driven/1"
OFFERS = {
    "final": "where each chain ends",
    "predicted": "the best of each chain, as predicted",
    "checked": "the best of each chain, as checked",
}
"""Rules by which a chain offers one design. For chains of the mechanics, the last two are the
best design that the chain saw, before and after it was loaded in small steps."""
EXACT_OFFERS = {**OFFERS, "predicted": "the best of each chain, as computed"}
"""The same for an exact search, whose chains know designs by the mechanics too."""


@dataclass(frozen=True, slots=True)
class Made:
    """A design that a chain offers.

    Parameters
    ----------
    chain
        Its number.
    offer
        Which rule it is offered by.
    mask
        In hexadecimal.
    truth
        What the mechanics says of it.
    predicted
        What the networks say of it; None for chains of the mechanics.
    spread
        How much they dispute; None for one network.
    distance
        In how many beams it differs from the nearest design of the dataset; None if not asked for.
    """

    chain: int
    offer: str
    mask: str
    truth: Truth
    predicted: float | None = None
    spread: float | None = None
    distance: int | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return the record as plain data."""
        told = asdict(self)
        truth = told.pop("truth")
        return {**told, "efficiency": truth["efficiency"], "status": truth["status"]}


@dataclass(frozen=True, slots=True)
class Effort:
    """What it took n chains to get where they are; each entry is of one chain.

    Parameters
    ----------
    steps
        Proposals.
    accepted
        Of these.
    responses
        That the mechanics computed on the way, for proposals or to confirm stretches; that of
        the initial design, and checks in the end, come on top.
    scored
        Designs that networks looked at on the way.
    """

    steps: tuple[int, ...]
    accepted: tuple[int, ...]
    responses: tuple[int, ...]
    scored: tuple[int, ...]

    def medians(self) -> dict[str, float | None]:
        """Return medians over the chains; the acceptance is a share of the proposals.

        Examples
        --------
        >>> Effort((10, 10), (4, 6), (8, 6), (20, 30)).medians()
        {'acceptance': 0.5, 'responses': 7.0, 'scored': 25.0}
        """
        shares = [taken / made for taken, made in zip(self.accepted, self.steps, strict=True)]
        return {
            "acceptance": median(shares),
            "responses": median(self.responses),
            "scored": median(self.scored),
        }

    def to_dict(self) -> dict[str, Any]:
        """Return all as plain data."""
        return {**asdict(self), "medians": self.medians()}


@dataclass(frozen=True, slots=True, eq=False)
class Driven:
    """Designs made with a network and, beside them, by the mechanics in as many steps.

    Parameters
    ----------
    problem
        What they are for.
    settings
        As plain data.
    steps
        That each chain has made: fewer than the settings say if the search was stopped.
    stopped
        Whether it was.
    by_network, by_mechanics
        One for each chain and offer; the latter empty if not compared.
    network, mechanics
        What the chains took; the latter None if not compared.
    seconds
        That the parts took, by name: ``network`` and ``mechanics`` are their chains.
    provenance
        Of the record.
    """

    problem: Problem
    settings: dict[str, Any]
    steps: int
    stopped: bool
    by_network: tuple[Made, ...]
    by_mechanics: tuple[Made, ...]
    network: Effort
    mechanics: Effort | None
    seconds: dict[str, float]
    provenance: dict[str, Any]

    @property
    def exact(self) -> bool:
        """Whether networks only screened, and the mechanics decided."""
        return bool(self.settings["exact"])

    @property
    def offers(self) -> dict[str, str]:
        """The rules by which chains offer designs, in words."""
        return EXACT_OFFERS if self.exact else OFFERS

    @property
    def best(self) -> Made | None:
        """The most efficient design that the network made; None if none is sound."""
        sound = [made for made in self.by_network if made.truth.efficiency is not None]
        return max(sound, key=lambda made: made.truth.rank, default=None)

    def offered(self, offer: str, *, by_network: bool = True) -> list[Made]:
        """Return the designs offered by one rule, chain by chain."""
        made = self.by_network if by_network else self.by_mechanics
        return [each for each in made if each.offer == offer]

    def summary(self) -> dict[str, Any]:
        """Return medians and counts for each offer, as plain data."""
        told: dict[str, Any] = {}
        for offer in OFFERS:
            network = self.offered(offer)
            mechanics = self.offered(offer, by_network=False)
            told[offer] = {
                "predicted": median(made.predicted for made in network),
                "network": median(made.truth.rank for made in network),
                "network_failed": _failed(network),
                "mechanics": median(made.truth.rank for made in mechanics),
                "mechanics_failed": _failed(mechanics),
                "distance": median(made.distance for made in network),
            }
        return told

    def to_dict(self) -> dict[str, Any]:
        """Return all as plain data: schema ``bellcrank/driven/1``."""
        best = self.best
        return {
            "schema": DRIVEN_SCHEMA,
            "problem": self.problem.name,
            "problem_hash": self.problem.hash,
            "settings": self.settings,
            "steps": self.steps,
            "stopped": self.stopped,
            "effort": {
                "network": self.network.to_dict(),
                "mechanics": None if self.mechanics is None else self.mechanics.to_dict(),
            },
            "medians": self.summary(),
            "best": None if best is None else best.to_dict(),
            "by_network": [made.to_dict() for made in self.by_network],
            "by_mechanics": [made.to_dict() for made in self.by_mechanics],
            "seconds": self.seconds,
            "provenance": self.provenance,
        }


def median(values: Iterable[float | None]) -> float | None:
    """Return the median; None if there is nothing, or if it falls on designs that failed.

    Designs without an efficiency count as -inf: a search is not better for failing more.

    Examples
    --------
    >>> median([1.0, 3.0, 2.0, -math.inf]), median([None]), median([1.0, -math.inf])
    (1.5, None, None)
    """
    known = [value for value in values if value is not None]
    if not known:
        return None
    ordered = np.sort(np.array(known, np.float64))
    low, high = ordered[(len(ordered) - 1) // 2], ordered[len(ordered) // 2]
    return float(0.5 * (low + high)) if math.isfinite(low) else None


def _failed(made: list[Made]) -> int:
    return sum(each.truth.efficiency is None for each in made)
