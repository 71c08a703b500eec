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
>>> record = run_surrogate_search(crane, load_predictor(crane, device="cpu"), settings)
>>> [design["offer"] for design in record["by_network"]]
['final', 'verified']
"""

from __future__ import annotations

import heapq
import math
import time
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status
from bellcrank.model import Design, unpack_mask
from bellcrank.provenance import provenance
from bellcrank.search import Evaluator, MetropolisSettings, chain_blocks
from bellcrank.surrogate.evaluator import NetworkEvaluator
from bellcrank.surrogate.matching import require_same_problem

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.predictor import Predictor

SCHEMA = "bellcrank/surrogate-search/1"
FIRST_CHAIN = 1
"""Number of the first chain. The runs of a dataset are chains 0, so that none is repeated."""
OFFERS = {
    "final": "last design of each chain",
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

    Raises
    ------
    InvalidSettings
    """

    chains: int = 100
    steps: int = 582
    seed: int = 0
    verified: int = 10
    compare: bool = True

    def __post_init__(self) -> None:
        if self.verified < 1:
            raise InvalidSettings(f"verified: expected at least 1 design, got {self.verified}")
        _ = self.metropolis  # checks the values

    @property
    def metropolis(self) -> MetropolisSettings:
        """Settings of the chains."""
        return MetropolisSettings(steps=self.steps, chains=self.chains, seed=self.seed)


def run_surrogate_search(
    problem: Problem,
    predictor: Predictor,
    settings: SurrogateSearchSettings | None = None,
    *,
    training: Dataset | None = None,
    report: Callable[[str, int, int], None] = lambda _by, _done, _total: None,
) -> dict[str, Any]:
    """Search with a network, verify what it finds, and compare with the mechanics.

    Parameters
    ----------
    training
        Dataset to compute distances to, for example the one that the network was trained on.
    report
        Called with ``network`` or ``mechanics``, the number of finished chains and of all.

    Returns
    -------
    dict
        Record as plain data: settings, medians over the chains (see `medians_of`), share of
        accepted proposals and duration by ``network`` and ``mechanics``, and the offered designs
        ``by_network`` and ``by_mechanics``, one for each chain and rule of `OFFERS`. Each has a
        hexadecimal mask and, evaluated by the mechanics from rest in small increments, a status
        and an efficiency (None unless the status is ``converged``); those of the network also
        the predicted efficiency and, with a dataset, the number of beams in which they differ
        from its nearest design.

    Raises
    ------
    InvalidSettings
        If the initial design has no unique response.
    InvalidModel
        If the dataset is for another problem.
    """
    settings = settings or SurrogateSearchSettings()
    if training is not None:
        require_same_problem(training.problem, problem)
    judge, seconds, acceptance = SpringEvaluator(problem), {}, {}
    designs: dict[str, list[dict[str, Any]]] = {"network": [], "mechanics": []}
    evaluators: dict[str, Evaluator] = {"network": NetworkEvaluator(predictor)}
    if settings.compare:
        evaluators["mechanics"] = SpringEvaluator(problem)
    for name, evaluator in evaluators.items():
        start, shares = time.monotonic(), []
        for done in range(settings.chains):
            report(name, done, settings.chains)
            share, offers = _run_chain(evaluator, settings, FIRST_CHAIN + done, judge)
            shares.append(share)
            designs[name] += offers
        seconds[name] = round(time.monotonic() - start, 3)
        acceptance[name] = median(shares)
    found = designs["network"]
    beams = problem.lattice.beam_count
    masks = np.array([unpack_mask(design["mask"], beams) for design in found], np.bool_)
    for design, predicted in zip(found, predictor.predict(masks).tolist(), strict=True):
        design |= {"predicted": predicted, "distance": None}
    if training is not None:
        packed = np.packbits(masks, axis=1)
        distances = smallest_distances(packed, training.packed).tolist()
        for design, distance in zip(found, distances, strict=True):
            design["distance"] = distance
    return {
        "schema": SCHEMA,
        "problem": problem.name,
        "problem_hash": problem.hash,
        "settings": {**asdict(settings), "search": settings.metropolis.to_dict()},
        "architecture": predictor.model.architecture,
        "acceptance": acceptance,
        "medians": {rule: medians_of(designs, rule) for rule in OFFERS},
        "by_network": found,
        "by_mechanics": designs["mechanics"],
        "seconds": seconds,
        "provenance": provenance(seed=settings.seed),
    }


def _run_chain(
    evaluator: Evaluator, settings: SurrogateSearchSettings, number: int, judge: SpringEvaluator
) -> tuple[float, list[dict[str, Any]]]:
    """Run a chain; return the share of accepted proposals and the offered designs."""
    problem = evaluator.problem
    seen: dict[bytes, float] = {np.packbits(problem.initial).tobytes(): -math.inf}
    for state, proposals in chain_blocks(evaluator, settings.metropolis, number):
        last = state
        stable = np.flatnonzero(proposals.status == int(Status.CONVERGED))
        order = stable[np.argsort(-proposals.efficiency[stable], kind="stable")]
        for row in order[: 4 * settings.verified]:  # the same design may occur several times
            seen[proposals.mask[row].tobytes()] = float(proposals.efficiency[row])
    best = heapq.nlargest(settings.verified, seen, key=seen.__getitem__)
    candidates = []
    for mask in (*(packed.hex() for packed in best), last.to_dict()["mask"]):
        response = judge.evaluate(
            unpack_mask(mask, problem.lattice.beam_count), VERIFICATION_INCREMENT
        )
        converged = response.status is Status.CONVERGED
        efficiency = response.efficiency if converged else None
        candidates.append({"mask": mask, "status": response.status.label, "efficiency": efficiency})
    chosen = {"final": candidates[-1], "verified": max(candidates, key=rank)}
    offers = [{"chain": number, "offer": rule, **chosen[rule]} for rule in OFFERS]
    return last.accepted / last.step, offers


def rank(design: dict[str, Any]) -> float:
    """Return the efficiency of an offered design for comparisons; -inf if there is none."""
    return -math.inf if design["efficiency"] is None else float(design["efficiency"])


def medians_of(designs: dict[str, list[dict[str, Any]]], rule: str) -> dict[str, Any]:
    """Return medians over the chains, and numbers of designs without a unique response.

    Parameters
    ----------
    designs
        Offered designs by ``network`` and ``mechanics``.
    rule
        Key of `OFFERS`.

    Returns
    -------
    dict
        ``network``, ``mechanics`` (efficiencies by the mechanics) and their numbers of failures
        (``network_failed``, ``mechanics_failed``); ``predicted`` and ``distance`` for the
        designs of the network.
    """
    found: dict[str, Any] = {}
    for name, offered in designs.items():
        rows = [design for design in offered if design["offer"] == rule]
        found[name] = median(map(rank, rows))
        found[f"{name}_failed"] = sum(design["efficiency"] is None for design in rows)
        if name == "network":
            for key in ("predicted", "distance"):
                found[key] = median(design[key] for design in rows)
    return found


def best_design(problem: Problem, record: dict[str, Any]) -> Design | None:
    """Return the most efficient design found with the network; None if no design is stable."""
    best = max(record["by_network"], key=rank)
    if best["efficiency"] is None:
        return None
    return Design(
        problem=problem,
        mask=unpack_mask(best["mask"], problem.lattice.beam_count),
        efficiency=best["efficiency"],
        provenance={
            **record["provenance"],
            "found": {"by": "search with a network", **best, "settings": record["settings"]},
        },
    )


def smallest_distances(designs: NDArray[np.uint8], known: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Return the number of beams in which each design differs from the nearest known one.

    Parameters
    ----------
    designs : (n, bytes) uint8
        Packed masks.
    known : (k, bytes) uint8
        Packed masks over the same beams; at least one.

    Returns
    -------
    (n,) int64

    Examples
    --------
    >>> designs = np.packbits([[1, 1, 0], [0, 0, 0]], axis=1)
    >>> known = np.packbits([[1, 1, 1], [0, 0, 1], [0, 1, 1]], axis=1)
    >>> smallest_distances(designs, known).tolist()
    [1, 1]
    """
    filled = ((0, 0), (0, -known.shape[1] % 8))
    first, second = (np.pad(each, filled).view(np.uint64) for each in (designs, known))
    nearest = [
        np.bitwise_count(second ^ design).sum(axis=1, dtype=np.int64).min() for design in first
    ]
    return np.array(nearest, np.int64)


def median(values: Iterable[float | None]) -> float | None:
    """Return the median; None if there are no values or it falls on designs that failed.

    Failed designs count as -inf, so that failures do not improve the median.

    Examples
    --------
    >>> median([1.0, 3.0, 2.0, -math.inf]), median([None]), median([1.0, -math.inf])
    (1.5, None, None)
    """
    known = [value for value in values if value is not None]
    found = float(np.median(known)) if known else math.nan
    return found if math.isfinite(found) else None
