"""Search driven by networks, and the truth about what it makes.

The paper's search with a network in place of the mechanics, as many chains at once as the
machine likes. Networks err, and a search finds where: whatever a chain offers is loaded by the
mechanics, in small steps, before a word is said about its efficiency. Beside it run as many
chains of the mechanics, of as many steps, with the same rule; what they offer is chosen and
checked in the same way. In an *exact* search the networks only screen: the mechanics decides on
whatever they let pass, so that the chains visit designs as often as chains of the mechanics do,
however bad the networks (`bellcrank.search.screened`).

Examples
--------
>>> from bellcrank.learning.driving_settings import Driving
>>> from bellcrank.model import find_problem
>>> from bellcrank.surrogate.predictor import load_predictor
>>> crane = find_problem("crane")
>>> driven = drive(crane, load_predictor(crane), Driving(chains=20))  # doctest: +SKIP
>>> driven.summary()["checked"]  # doctest: +SKIP
{'predicted': ..., 'network': ..., 'network_failed': 0, 'mechanics': ...}
"""

from __future__ import annotations

import threading
import time
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.learning.driven import OFFERS, Driven, Effort, Made
from bellcrank.learning.driving_settings import FIRST_CHAIN, Driving
from bellcrank.learning.finding import Chains, Found, by_mechanics, by_networks, by_screening
from bellcrank.learning.scoring import Judge, NetworkScorer
from bellcrank.provenance import provenance
from bellcrank.surrogate.distances import smallest_distances
from bellcrank.surrogate.matching import beams_between, renumbered

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.predictor import Predictor


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
        While searching, the median of what is known of the chains' designs: their predicted
        efficiency; in an exact search, the true one.
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
        For example what the networks have learnt from: the distance to it is told.
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
    clock = _Clock()
    found = _search(problem, scorer, settings, tell, stop)
    clock.note("network")
    made = _offers_of(problem, found, settings, tell, predictor)
    clock.note("checking")
    compared: tuple[Made, ...] = ()
    effort: Effort | None = None
    if settings.compare and not stop.is_set():
        other = by_mechanics(_chains(problem, settings, "comparing", tell, stop), settings.rule)
        clock.note("mechanics")
        compared, effort = _offers_of(problem, other, settings, tell), other.effort
        clock.note("checking")
    if training is not None and beams is not None:
        made = _with_distances(made, training, beams)
        clock.note("distances")
    told = {
        **asdict(settings), "search": (settings.screened_rule or settings.rule).to_dict(),
        "networks": [member.architecture for member in predictor.members],
    }  # fmt: skip
    return Driven(
        problem, told, found.effort.steps[0], stop.is_set(), made, compared, found.effort, effort,
        clock.seconds, provenance(seed=settings.seed),
    )  # fmt: skip


class _Clock:
    """Seconds that the parts of a job take, by name."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.monotonic()

    def note(self, name: str) -> None:
        """Add the time since the last note to what a part took."""
        now = time.monotonic()
        self.seconds[name] = round(self.seconds.get(name, 0.0) + now - self._last, 3)
        self._last = now


def _search(
    problem: Problem,
    scorer: NetworkScorer,
    settings: Driving,
    tell: Callable[[DrivingProgress], None],
    stop: threading.Event,
) -> Found:
    """Let the networks search or screen, until the end or until stopped."""
    chains = _chains(problem, settings, "searching", tell, stop)
    if (rule := settings.screened_rule) is not None:
        return by_screening(chains, scorer, rule)
    return by_networks(chains, scorer, settings.rule, settings.confirm)


def _chains(
    problem: Problem,
    settings: Driving,
    what: str,
    tell: Callable[[DrivingProgress], None],
    stop: threading.Event,
) -> Chains:
    total = settings.steps if what == "searching" else settings.chains
    return Chains(
        problem, FIRST_CHAIN, settings.checked,
        lambda done, figure: tell(DrivingProgress(what, done, total, figure)), stop,
    )  # fmt: skip


def _offers_of(
    problem: Problem,
    found: Found,
    settings: Driving,
    tell: Callable[[DrivingProgress], None],
    predictor: Predictor | None = None,
) -> tuple[Made, ...]:
    """Check what each chain offers, and ask networks what they say of it."""
    total = len(found.final) * (settings.checked + 1)
    judge = Judge(problem, lambda done: tell(DrivingProgress("checking", done, total)))
    made: list[Made] = []
    for chain, (final, best) in enumerate(zip(found.final, found.best, strict=True), FIRST_CHAIN):
        checked = max([*best, final], key=lambda packed: judge.truth(packed).rank)
        for offer, packed in zip(OFFERS, (final, best[0], checked), strict=True):
            made.append(Made(chain, offer, packed.tobytes().hex(), judge.truth(packed)))
    return tuple(made) if predictor is None else _with_predictions(made, predictor)


def _with_predictions(made: Sequence[Made], predictor: Predictor) -> tuple[Made, ...]:
    """Return the designs with what networks say of them."""
    said = predictor.predict(_masks_of(made, predictor.problem.lattice.beam_count))
    spread = [None] * len(made) if said.spread is None else said.spread.tolist()
    return tuple(
        replace(each, predicted=predicted, spread=dispute)
        for each, predicted, dispute in zip(made, said.efficiency.tolist(), spread, strict=True)
    )


def _masks_of(made: Sequence[Made], beams: int) -> NDArray[np.bool_]:
    """Return the masks (n, M) of designs."""
    packed = np.array([np.frombuffer(bytes.fromhex(each.mask), np.uint8) for each in made])
    return np.unpackbits(packed, axis=1, count=beams).astype(np.bool_)


def _with_distances(
    made: tuple[Made, ...], training: Dataset, beams: NDArray[np.int64]
) -> tuple[Made, ...]:
    """Return the designs with their distances to those of a dataset."""
    known = renumbered(_masks_of(made, len(beams)), beams)
    distance, _ = smallest_distances(np.packbits(known, axis=1), training.packed)
    return tuple(replace(each, distance=int(far)) for each, far in zip(made, distance, strict=True))
