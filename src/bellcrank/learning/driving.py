"""Search driven by networks, and the truth about what it makes.

The paper's search with a network in place of the mechanics, as many chains at once as the
machine likes. Networks err, and a search finds where: whatever a chain offers is loaded by the
mechanics, in small steps, before a word is said about its efficiency. Beside it run as many
chains of the mechanics, of as many steps, with the same rule; what they offer is chosen and
checked in the same way.

Examples
--------
>>> from bellcrank.model import find_problem
>>> from bellcrank.surrogate.predictor import load_predictor
>>> crane = find_problem("crane")
>>> driven = drive(crane, load_predictor(crane), Driving(chains=20))  # doctest: +SKIP
>>> driven.summary()["checked"]  # doctest: +SKIP
{'predicted': ..., 'network': ..., 'network_failed': 0, 'mechanics': ...}
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
from bellcrank.learning.driven import OFFERS, Driven, Made
from bellcrank.learning.scoring import Judge, NetworkScorer
from bellcrank.learning.stretches import Confirmer
from bellcrank.mechanics import Evaluator, Status
from bellcrank.provenance import provenance
from bellcrank.search import MetropolisSettings, chain_blocks
from bellcrank.search.populations import Population, population_steps, start_population
from bellcrank.surrogate.distances import smallest_distances
from bellcrank.surrogate.matching import beams_between

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.predictor import Predictor

FIRST_CHAIN = 1
"""Runs of a dataset are all chain 0, each of its own seed: none of ours repeats one of them."""

CHANGEABLE = ("cost", "schedule", "hot", "cold", "annealing")
"""Settings of the chains; all others are the paper's."""


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
    compare
        Whether to run as many chains of the mechanics.
    search
        What of the search ``paper`` is to differ: `CHANGEABLE` settings.

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
    compare: bool = True
    search: dict[str, Any] | None = None

    def __post_init__(self) -> None:
        if isinstance(self.checked, bool) or not isinstance(self.checked, int) or self.checked < 1:
            raise InvalidSettings(f"checked: expected at least 1 design, got {self.checked!r}")
        if isinstance(self.confirm, bool) or not isinstance(self.confirm, int) or self.confirm < 0:
            raise InvalidSettings(f"confirm: expected a number of steps, got {self.confirm!r}")
        if unknown := sorted(set(self.search or {}) - set(CHANGEABLE)):
            raise InvalidSettings(
                f"{unknown[0]}: a search driven by networks can change only "
                f"{', '.join(CHANGEABLE)}: efficiencies are what the networks have learnt"
            )
        _ = self.rule  # refuses what makes no sense

    @property
    def rule(self) -> MetropolisSettings:
        """Settings of the chains, of the networks and of the mechanics."""
        given = {"steps": self.steps, "chains": self.chains, "seed": self.seed}
        return MetropolisSettings.from_dict({**given, **(self.search or {})})


@dataclass(frozen=True, slots=True)
class DrivingProgress:
    """Where a network-driven search is.

    Parameters
    ----------
    what
        Being done: ``searching``, ``checking`` or ``comparing``.
    done, total
        Steps, designs or chains of it.
    figure
        Median of what the networks say of the chains' designs, while searching.
    """

    what: str
    done: int
    total: int
    figure: float | None = None


def drive(
    problem: Problem,
    predictor: Predictor,
    settings: Driving | None = None,
    *,
    training: Dataset | None = None,
    tell: Callable[[DrivingProgress], None] = lambda _progress: None,
    stop: threading.Event | None = None,
) -> Driven:
    """Let networks search, check what they offer, and compare it with what mechanics finds.

    Parameters
    ----------
    training
        What the networks have learnt from: the distance to it is told.
    tell
        Called now and then with how far it is.
    stop
        Set it to end soon: what the chains offer by then is checked, and nothing compared.

    Raises
    ------
    InvalidSettings
        If caution is asked of one network, or the initial design has no unique response.
    InvalidModel
        If the training designs are for another problem.
    """
    settings = settings or Driving()
    stop = stop or threading.Event()
    beams = None if training is None else beams_between(training.problem, problem)
    scorer = NetworkScorer(predictor, settings.caution)
    seconds: dict[str, float] = {}
    clock = time.monotonic()
    population, responses = _search(problem, scorer, settings, tell, stop)
    seconds["network"], clock = time.monotonic() - clock, time.monotonic()
    made = _offers_of(problem, predictor, population, settings, tell)
    seconds["checking"], clock = time.monotonic() - clock, time.monotonic()
    compared: tuple[Made, ...] = ()
    if settings.compare and not stop.is_set():
        compared = _by_mechanics(problem, settings, tell, stop)
        seconds["mechanics"], clock = time.monotonic() - clock, time.monotonic()
    if training is not None and beams is not None:
        made = _with_distances(made, training, beams)
        seconds["distances"] = time.monotonic() - clock
    told = {
        **asdict(settings), "search": settings.rule.to_dict(),
        "networks": [member.architecture for member in predictor.members],
    }  # fmt: skip
    return Driven(
        problem, told, population.step, stop.is_set(), made, compared,
        float(np.median(population.accepted)), responses,
        {name: round(taken, 3) for name, taken in seconds.items()}, provenance(seed=settings.seed),
    )  # fmt: skip


def _search(
    problem: Problem,
    scorer: NetworkScorer,
    settings: Driving,
    tell: Callable[[DrivingProgress], None],
    stop: threading.Event,
) -> tuple[Population, int]:
    """Let the networks search, until the end or until stopped; count responses asked for."""
    rule = settings.rule
    tell(DrivingProgress("searching", 0, rule.steps))
    population = start_population(problem, scorer, rule, settings.checked)
    confirmer = Confirmer.at(Evaluator(problem), rule, FIRST_CHAIN, population)

    def review(here: Population) -> Population:
        due = settings.confirm and here.step % settings.confirm == 0
        return confirmer.confirm(here) if due else here

    steps = population_steps(
        problem, scorer, rule, first=FIRST_CHAIN, keep=settings.checked, review=review
    )
    for population, _ in steps:
        median = float(np.median(population.score))
        tell(DrivingProgress("searching", population.step, rule.steps, median))
        if stop.is_set():
            break
    if settings.confirm and population.step % settings.confirm:
        population = confirmer.confirm(population)
    return population, confirmer.asked


def _offers_of(
    problem: Problem,
    predictor: Predictor,
    population: Population,
    settings: Driving,
    tell: Callable[[DrivingProgress], None],
) -> tuple[Made, ...]:
    """Check what each chain of the networks offers."""
    total = len(population.masks) * (settings.checked + 1)
    judge = Judge(problem, lambda done: tell(DrivingProgress("checking", done, total)))
    chosen: list[tuple[int, str, NDArray[np.uint8]]] = []
    for row, mask in enumerate(population.masks):
        final = np.packbits(mask)
        ranked = [packed for _, packed in population.kept.ranked(row)]
        checked = max([*ranked, final], key=lambda packed: judge.truth(packed).rank)
        for offer, packed in zip(OFFERS, (final, ranked[0], checked), strict=True):
            chosen.append((FIRST_CHAIN + row, offer, packed))
    beams = problem.lattice.beam_count
    packed = np.array([each[2] for each in chosen])
    said = predictor.predict(np.unpackbits(packed, axis=1, count=beams).astype(bool))
    spread = [None] * len(chosen) if said.spread is None else said.spread.tolist()
    return tuple(
        Made(chain, offer, packed.tobytes().hex(), judge.truth(packed), predicted, dispute)
        for (chain, offer, packed), predicted, dispute in zip(
            chosen, said.efficiency.tolist(), spread, strict=True
        )
    )


def _by_mechanics(
    problem: Problem,
    settings: Driving,
    tell: Callable[[DrivingProgress], None],
    stop: threading.Event,
) -> tuple[Made, ...]:
    """Run as many chains of the mechanics; each offers and checks as those of the networks do."""
    rule = settings.rule
    evaluator, judge = Evaluator(problem), Judge(problem)
    made: list[Made] = []
    for chain in range(FIRST_CHAIN, FIRST_CHAIN + rule.chains):
        best: dict[bytes, float] = {np.packbits(problem.initial).tobytes(): -math.inf}
        last = ""
        for state, proposals in chain_blocks(evaluator, rule, chain):
            last = state.to_dict()["mask"]
            sound = np.flatnonzero(proposals.status == int(Status.CONVERGED))
            order = sound[np.argsort(-proposals.efficiency[sound], kind="stable")]
            for row in order[: 4 * settings.checked]:  # the same design may come several times
                best[proposals.mask[row].tobytes()] = float(proposals.efficiency[row])
        final = np.frombuffer(bytes.fromhex(last), np.uint8)
        ranked = [
            np.frombuffer(mask, np.uint8)
            for mask in heapq.nlargest(settings.checked, best, key=best.__getitem__)
        ]
        checked = max([*ranked, final], key=lambda packed: judge.truth(packed).rank)
        for offer, packed in zip(OFFERS, (final, ranked[0], checked), strict=True):
            made.append(Made(chain, offer, packed.tobytes().hex(), judge.truth(packed)))
        tell(DrivingProgress("comparing", chain - FIRST_CHAIN + 1, rule.chains))
        if stop.is_set():
            break
    return tuple(made)


def _with_distances(
    made: tuple[Made, ...], training: Dataset, beams: NDArray[np.int64]
) -> tuple[Made, ...]:
    """Return the designs with their distances to what was learnt from."""
    packed = np.array([np.frombuffer(bytes.fromhex(each.mask), np.uint8) for each in made])
    masks = np.unpackbits(packed, axis=1, count=len(beams))
    known = np.zeros_like(masks)
    known[:, beams] = masks
    distance, _ = smallest_distances(np.packbits(known, axis=1), training.packed)
    return tuple(replace(each, distance=int(far)) for each, far in zip(made, distance, strict=True))
