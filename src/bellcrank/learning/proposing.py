"""Designs worth labelling: what networks propose in a search, above all what they dispute."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from bellcrank.errors import InvalidDataset, InvalidSettings
from bellcrank.learning.driving_settings import FIRST_CHAIN, Driving
from bellcrank.learning.heard import Heard
from bellcrank.learning.scoring import NetworkScorer
from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.provenance import provenance
from bellcrank.search.populations import population_steps
from bellcrank.search.settings import check_whole, is_number
from bellcrank.surrogate.dataset import Dataset
from bellcrank.surrogate.recipes import Recipe

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bellcrank.surrogate.predictor import Prediction, Predictor


@dataclass(frozen=True, slots=True, kw_only=True)
class ActiveSettings:
    """What a round of active learning is told.

    Parameters
    ----------
    chains, steps, seed, caution
        Of the search by networks, see `bellcrank.learning.driving_settings.Driving`. Give each
        round another seed.
    disputed, best
        Designs of each chain to label: those on which the networks differ most (of a single
        network, which differs from nobody, designs evenly spread along the chain), and those of
        the highest prediction.
    share
        Of the designs that training sees, those from rounds like this one: they are repeated
        until they are so many. 0 repeats none.
    warm
        Whether networks go on from their weights, or begin afresh.
    epochs, epoch_size, learning_rate
        Of the training in a round, where it is to differ from the recipe; None does not.

    Raises
    ------
    InvalidSettings
    """

    chains: int = 100
    steps: int = 582
    seed: int = 0
    caution: float = 0.0
    disputed: int = 50
    best: int = 20
    share: float = 0.25
    warm: bool = True
    epochs: int | None = None
    epoch_size: int | None = None
    learning_rate: float | None = None

    def __post_init__(self) -> None:
        for name in ("disputed", "best"):
            check_whole(name, getattr(self, name), 0)
        if self.disputed + self.best < 1:
            raise InvalidSettings("disputed, best: expected at least one design to label")
        if not is_number(self.share) or not 0.0 <= self.share < 1.0:
            raise InvalidSettings(f"share: expected from 0 to below 1, got {self.share!r}")
        if not is_number(self.caution) or not 0.0 <= self.caution < math.inf:
            raise InvalidSettings(f"caution: expected at least 0, got {self.caution!r}")
        if not isinstance(self.warm, bool):
            raise InvalidSettings(f"warm: expected true or false, got {self.warm!r}")
        _ = self.driving, self.adapt(Recipe(batch=2))  # refuse what makes no sense

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as plain data."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """Rebuild settings; what is not there is as by default.

        Raises
        ------
        InvalidSettings
            Also if there are keys that a round has not.

        Examples
        --------
        >>> ActiveSettings.from_dict({"chains": 7}).chains
        7
        """
        known = [each.name for each in fields(cls)]
        if unknown := sorted(set(data) - set(known)):
            raise InvalidSettings(
                f"{unknown[0]}: no such key in a round; it has: {', '.join(sorted(known))}"
            )
        return cls(**data)

    def adapt(self, recipe: Recipe) -> Recipe:
        """Return a recipe as it is in a round.

        Raises
        ------
        InvalidSettings
            If an epoch is to be smaller than the recipe's batch.

        Examples
        --------
        >>> adapted = ActiveSettings(epochs=1).adapt(Recipe())
        >>> adapted.epochs, adapted.learning_rate
        (1, 0.001)
        """
        given = {name: getattr(self, name) for name in ("epochs", "epoch_size", "learning_rate")}
        changes: dict[str, Any] = {key: each for key, each in given.items() if each is not None}
        return replace(recipe, **changes)

    @property
    def driving(self) -> Driving:
        """Settings of the search."""
        return Driving(
            chains=self.chains, steps=self.steps, seed=self.seed, caution=self.caution,
            compare=False,
        )  # fmt: skip


def propose_designs(
    predictor: Predictor,
    settings: ActiveSettings,
    *,
    heard: Heard | None = None,
    tell: Callable[[str, int, int], None] = lambda _what, _done, _total: None,
    stop: Callable[[], bool] = lambda: False,
) -> list[NDArray[np.uint8]]:
    """Let networks search, and choose of what they propose the designs worth labelling.

    Parameters
    ----------
    heard
        What the networks said before this search was stopped; gets what they say now.
    tell, stop
        See `bellcrank.learning.active.learn_actively`.

    Returns
    -------
    list of (k, bytes) uint8
        Packed masks, different ones, for each chain; in the order in which they were proposed.
        Empty if it was stopped.
    """
    heard = heard or Heard()
    scorer = _Watched(predictor, settings.caution, heard)
    rule = settings.driving.rule
    steps = population_steps(predictor.problem, scorer, rule, first=FIRST_CHAIN)
    packed, said = [], []
    for population, _ in steps:
        packed.append(np.packbits(scorer.masks, axis=1))
        said.append(scorer.said)
        tell("searching", population.step, rule.steps)
        stopped = stop()
        heard.keep(now=stopped)
        if stopped:
            return []
    designs = np.stack(packed, axis=1)
    predicted = np.stack([each.efficiency for each in said], axis=1)
    spread = np.stack(
        [np.zeros(rule.chains) if each.spread is None else each.spread for each in said], axis=1
    )
    return [
        designs[chain, _chosen(designs[chain], predicted[chain], spread[chain], settings)]
        for chain in range(rule.chains)
    ]


class _Watched(NetworkScorer):
    """A scorer that remembers what it was asked last and what its networks said."""

    masks: NDArray[np.bool_]
    said: Prediction

    def __init__(self, predictor: Predictor, caution: float, heard: Heard) -> None:
        super().__init__(predictor, caution)
        self.heard = heard

    def score(self, masks: NDArray[np.bool_]) -> NDArray[np.float64]:
        self.masks = masks.copy()
        self.said = self.heard.ask(self.predictor, masks)
        return self.judged(self.said)


def _chosen(
    designs: NDArray[np.uint8],
    predicted: NDArray[np.float64],
    spread: NDArray[np.float64],
    settings: ActiveSettings,
) -> NDArray[np.int64]:
    """Return which designs of a chain to label, in order; of equal designs the first counts."""
    _, first = np.unique(designs, axis=0, return_index=True)
    first.sort()
    best = first[np.argsort(-predicted[first], kind="stable")[: settings.best]]
    left = np.setdiff1d(first, best)
    count = min(settings.disputed, len(left))
    if spread.any():
        disputed = left[np.argsort(-spread[left], kind="stable")[:count]]
    else:
        disputed = left[np.linspace(0, len(left) - 1, count).astype(np.int64)]
    return np.union1d(best, disputed)


def label_designs(
    predictor: Predictor,
    chosen: Sequence[NDArray[np.uint8]],
    settings: ActiveSettings,
    *,
    tell: Callable[[str, int, int], None] = lambda _what, _done, _total: None,
) -> Dataset:
    """Ask the mechanics about designs, and leave out those without a unique response.

    Parameters
    ----------
    chosen
        Packed masks (k, bytes) of each chain: a run of the dataset each.

    Raises
    ------
    InvalidDataset
        If none is left.
    """
    problem = predictor.problem
    evaluator, beams = SpringEvaluator(problem), problem.lattice.beam_count
    total = sum(map(len, chosen))
    packed, efficiency, run = [], [], []
    done = 0
    for chain, designs in enumerate(chosen):
        for design in designs:
            response = evaluator.evaluate(np.unpackbits(design, count=beams).astype(bool))
            done += 1
            if response.status is Status.CONVERGED:
                packed.append(design)
                efficiency.append(response.efficiency)
                run.append(chain)
        tell("labelling", done, total)
    if not packed:
        raise InvalidDataset(f"none of {total} designs that the networks propose is sound")
    origin = {
        "active": settings.to_dict(),
        "left_out": total - len(packed),
        "networks": [member.architecture for member in predictor.members],
        "provenance": provenance(seed=settings.seed),
    }
    return Dataset(problem, np.array(packed), np.array(efficiency), np.array(run), origin=origin)
