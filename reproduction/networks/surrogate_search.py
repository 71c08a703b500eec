"""The paper's search with a trained network in place of the mechanics.

Metropolis chains search with the efficiencies that a network predicts. The mechanics then
evaluates the designs that each chain offers, and as many chains search with the mechanics for
comparison. A network's errors accumulate along a search, which favours designs that the network
overestimates, so that only the efficiencies computed by the mechanics count.

Examples
--------
>>> from bellcrank.model import find_problem
>>> from bellcrank.surrogate.predictor import load_predictor
>>> crane = find_problem("crane")
>>> settings = SurrogateSearchSettings(chains=1, steps=20, verified=2)
>>> result = run_surrogate_search(crane, load_predictor(crane, device="cpu"), settings)
>>> [design.offer for design in result.by_network]
['final', 'predicted', 'verified']
"""

from __future__ import annotations

import heapq
import math
import threading
import time
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status
from bellcrank.model import Design, unpack_mask
from bellcrank.provenance import provenance
from bellcrank.search import Evaluator, MetropolisSettings, chain_blocks
from bellcrank.surrogate.evaluator import NetworkEvaluator
from bellcrank.surrogate.matching import beams_between, renumbered
from reproduction.networks.distances import smallest_distances

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.predictor import Predictor

SCHEMA = "bellcrank/surrogate-search/1"
FIRST_CHAIN = 1
"""Number of the first chain. The runs of a dataset are chains 0, so that none is repeated."""
CHANGEABLE = ("cost", "schedule", "hot", "cold", "annealing")
"""Settings of the chains that can differ from the paper's."""
OFFERS = {
    "final": "last design of each chain",
    "predicted": "best design of each chain as the chain evaluated it",
    "verified": "best design of each chain as verified by the mechanics",
}
"""Rules by which each chain offers one design."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SurrogateSearchSettings:
    """Settings of a search with a network; the defaults are the paper's.

    Parameters
    ----------
    chains, steps, seed
        Number of independent chains, proposals of each, and seed of the random numbers.
    verified
        Number of best different designs of each chain that the mechanics evaluates in addition
        to the last one.
    compare
        Whether to run as many chains with the mechanics.
    search
        Settings of the search ``paper`` to change; see `CHANGEABLE`.

    Raises
    ------
    InvalidSettings, UnknownName
    """

    chains: int = 100
    steps: int = 582
    seed: int = 0
    verified: int = 10
    compare: bool = True
    search: dict[str, Any] | None = None

    def __post_init__(self) -> None:
        if isinstance(self.verified, bool) or not isinstance(self.verified, int):
            raise InvalidSettings(f"verified: expected a whole number, got {self.verified!r}")
        if self.verified < 1:
            raise InvalidSettings(f"verified: expected at least 1 design, got {self.verified}")
        if unknown := sorted(set(self.search or {}).difference(CHANGEABLE)):
            raise InvalidSettings(
                f"{unknown[0]}: not a setting of a search with a network; expected one of "
                f"{', '.join(CHANGEABLE)}"
            )
        _ = self.metropolis  # checks the values

    @property
    def metropolis(self) -> MetropolisSettings:
        """Settings of the chains."""
        given = {"steps": self.steps, "chains": self.chains, "seed": self.seed}
        return MetropolisSettings.from_dict({**given, **(self.search or {})})


@dataclass(frozen=True, slots=True)
class OfferedDesign:
    """A design that a chain offers, evaluated by the mechanics.

    Parameters
    ----------
    chain
        Number of the chain.
    offer
        Key of `OFFERS`.
    mask
        Hexadecimal mask.
    status
        Label of `bellcrank.mechanics.Status`, loaded from rest in small increments.
    efficiency
        None unless the status is ``converged``.
    predicted
        Efficiency that the network predicts; None for a chain with the mechanics.
    distance
        Number of beams in which it differs from the nearest design of the dataset; None without
        a dataset.
    """

    chain: int
    offer: str
    mask: str
    status: str
    efficiency: float | None
    predicted: float | None = None
    distance: int | None = None

    @property
    def rank(self) -> float:
        """Efficiency for comparisons and medians; -inf if there is none."""
        return -math.inf if self.efficiency is None else self.efficiency


@dataclass(frozen=True, slots=True, eq=False)
class SurrogateSearchResult:
    """Designs found with a network and, for comparison, with the mechanics.

    Parameters
    ----------
    problem, settings
        The task and the settings.
    architecture
        Name of the network's architecture.
    stopped
        Whether the search was stopped before its end.
    by_network, by_mechanics
        One design for each chain and rule of `OFFERS`; the latter empty without comparison.
    acceptance
        Share of accepted proposals for ``network`` and ``mechanics``, median over the chains.
    seconds
        Duration of each part: ``network``, ``mechanics``, ``verification``.
    provenance
        Of the record.
    """

    problem: Problem
    settings: SurrogateSearchSettings
    architecture: str
    stopped: bool
    by_network: tuple[OfferedDesign, ...]
    by_mechanics: tuple[OfferedDesign, ...]
    acceptance: dict[str, float | None]
    seconds: dict[str, float]
    provenance: dict[str, Any]

    @property
    def best(self) -> OfferedDesign | None:
        """The most efficient design found with the network; None if no design is stable."""
        stable = [design for design in self.by_network if design.efficiency is not None]
        return max(stable, key=lambda design: design.rank, default=None)

    def offered(self, offer: str, *, by_network: bool = True) -> list[OfferedDesign]:
        """Return the designs offered by one rule, chain by chain."""
        designs = self.by_network if by_network else self.by_mechanics
        return [design for design in designs if design.offer == offer]

    def medians(self) -> dict[str, dict[str, Any]]:
        """Return medians over the chains and numbers of failed designs for each offer."""
        found: dict[str, dict[str, Any]] = {}
        for offer in OFFERS:
            network = self.offered(offer)
            mechanics = self.offered(offer, by_network=False)
            found[offer] = {
                "predicted": median(design.predicted for design in network),
                "network": median(design.rank for design in network),
                "network_failed": sum(design.efficiency is None for design in network),
                "mechanics": median(design.rank for design in mechanics),
                "mechanics_failed": sum(design.efficiency is None for design in mechanics),
                "distance": median(design.distance for design in network),
            }
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return the record as plain data."""
        return {
            "schema": SCHEMA,
            "problem": self.problem.name,
            "problem_hash": self.problem.hash,
            "settings": {**asdict(self.settings), "search": self.settings.metropolis.to_dict()},
            "architecture": self.architecture,
            "stopped": self.stopped,
            "acceptance": self.acceptance,
            "medians": self.medians(),
            "best": None if self.best is None else asdict(self.best),
            "by_network": [asdict(design) for design in self.by_network],
            "by_mechanics": [asdict(design) for design in self.by_mechanics],
            "seconds": self.seconds,
            "provenance": self.provenance,
        }

    def best_design(self) -> Design | None:
        """Return the best design with its efficiency and origin."""
        if self.best is None:
            return None
        found = {"by": "search with a network", **asdict(self.best), "settings": self.settings}
        return Design(
            problem=self.problem,
            mask=unpack_mask(self.best.mask, self.problem.lattice.beam_count),
            efficiency=self.best.efficiency,
            provenance={**self.provenance, "found": {**found, "settings": asdict(self.settings)}},
        )


@dataclass(frozen=True, slots=True)
class SurrogateSearchProgress:
    """Progress of a search with a network.

    Parameters
    ----------
    stage
        ``searching``, ``verifying`` or ``comparing``.
    done, total
        Chains, or designs while verifying.
    """

    stage: str
    done: int
    total: int


@dataclass(frozen=True, slots=True)
class _Chain:
    """End of one chain: last and best masks (packed), and the share of accepted proposals."""

    final: bytes
    best: list[bytes]
    acceptance: float


def run_surrogate_search(
    problem: Problem,
    predictor: Predictor,
    settings: SurrogateSearchSettings | None = None,
    *,
    training: Dataset | None = None,
    report: Callable[[SurrogateSearchProgress], None] = lambda _progress: None,
    stop: threading.Event | None = None,
) -> SurrogateSearchResult:
    """Search with a network, verify what it finds, and compare with the mechanics.

    Parameters
    ----------
    training
        Dataset to compute distances to, for example the one that the network was trained on.
    report
        Called with the progress.
    stop
        Ends the search when set: the designs found so far are verified, without comparison.

    Raises
    ------
    InvalidSettings
        If the initial design has no unique response.
    InvalidModel
        If the dataset is for another problem.
    """
    settings = settings or SurrogateSearchSettings()
    stop = stop or threading.Event()
    beams = None if training is None else beams_between(training.problem, problem)
    seconds: dict[str, float] = {}
    acceptance: dict[str, float | None] = {}
    offers: dict[str, tuple[OfferedDesign, ...]] = {}
    evaluators: dict[str, tuple[str, Evaluator]] = {
        "network": ("searching", NetworkEvaluator(predictor))
    }
    if settings.compare:
        evaluators["mechanics"] = ("comparing", SpringEvaluator(problem))
    for name, (stage, evaluator) in evaluators.items():
        if name == "mechanics" and stop.is_set():
            break
        start = time.monotonic()
        chains = _run_chains(evaluator, settings, stage, report, stop)
        seconds[name] = round(time.monotonic() - start, 3)
        acceptance[name] = median(chain.acceptance for chain in chains)
        start = time.monotonic()
        offers[name] = _verify(problem, chains, report)
        seconds["verification"] = round(
            seconds.get("verification", 0.0) + time.monotonic() - start, 3
        )
    by_network = offers["network"]
    masks = _masks_of(by_network, problem.lattice.beam_count)
    predicted = predictor.predict(masks).tolist()
    distance: list[int | None] = [None] * len(masks)
    if training is not None and beams is not None:
        packed = np.packbits(renumbered(masks, beams), axis=1)
        distance = smallest_distances(packed, training.packed)[0].tolist()
    by_network = tuple(
        replace(design, predicted=value, distance=beams_apart)
        for design, value, beams_apart in zip(by_network, predicted, distance, strict=True)
    )
    return SurrogateSearchResult(
        problem, settings, predictor.model.architecture, stop.is_set(), by_network,
        offers.get("mechanics", ()), acceptance, seconds, provenance(seed=settings.seed),
    )  # fmt: skip


def _run_chains(
    evaluator: Evaluator,
    settings: SurrogateSearchSettings,
    stage: str,
    report: Callable[[SurrogateSearchProgress], None],
    stop: threading.Event,
) -> list[_Chain]:
    """Run chains one after the other until the last one or until stopped."""
    problem, rule = evaluator.problem, settings.metropolis
    chains: list[_Chain] = []
    report(SurrogateSearchProgress(stage, 0, settings.chains))
    for number in range(settings.chains):
        seen: dict[bytes, float] = {np.packbits(problem.initial).tobytes(): -math.inf}
        for state, proposals in chain_blocks(evaluator, rule, FIRST_CHAIN + number):
            last = state
            stable = np.flatnonzero(proposals.status == int(Status.CONVERGED))
            order = stable[np.argsort(-proposals.efficiency[stable], kind="stable")]
            for row in order[: 4 * settings.verified]:  # the same design may occur several times
                seen[proposals.mask[row].tobytes()] = float(proposals.efficiency[row])
            if stop.is_set():
                break
        best = heapq.nlargest(settings.verified, seen, key=seen.__getitem__)
        chains.append(
            _Chain(bytes.fromhex(last.to_dict()["mask"]), best, last.accepted / last.step)
        )
        report(SurrogateSearchProgress(stage, number + 1, settings.chains))
        if stop.is_set():
            break
    return chains


def _verify(
    problem: Problem, chains: list[_Chain], report: Callable[[SurrogateSearchProgress], None]
) -> tuple[OfferedDesign, ...]:
    """Evaluate the offers of each chain with the mechanics, each design once."""
    evaluator = SpringEvaluator(problem)
    known: dict[bytes, OfferedDesign] = {}
    designs: list[OfferedDesign] = []
    for done, chain in enumerate(chains):
        report(SurrogateSearchProgress("verifying", done, len(chains)))
        for packed in (chain.final, *chain.best):
            if packed not in known:
                mask = unpack_mask(packed.hex(), problem.lattice.beam_count)
                found = evaluator.evaluate(mask, VERIFICATION_INCREMENT)
                stable = found.status is Status.CONVERGED
                known[packed] = OfferedDesign(
                    0, "", packed.hex(), found.status.label, found.efficiency if stable else None
                )
        verified = max([*chain.best, chain.final], key=lambda packed: known[packed].rank)
        for offer, packed in zip(OFFERS, (chain.final, chain.best[0], verified), strict=True):
            designs.append(replace(known[packed], chain=FIRST_CHAIN + done, offer=offer))
    report(SurrogateSearchProgress("verifying", len(chains), len(chains)))
    return tuple(designs)


def _masks_of(designs: Iterable[OfferedDesign], beams: int) -> NDArray[np.bool_]:
    """Return the masks (n, M) of designs."""
    return np.array([unpack_mask(design.mask, beams) for design in designs], np.bool_)


def median(values: Iterable[float | None]) -> float | None:
    """Return the median; None if there are no values or it falls on designs that failed.

    Failed designs count as -inf, so that failures do not improve the median.

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
