"""Active learning: let networks search, label by mechanics what they propose, train them again.

A search driven by a network goes where the network is too hopeful, and there is little of that
in the data of searches by mechanics. A round labels such designs, above all those that several
networks dispute, and goes on training with them. Each chain is a run of its own, so that
designs which resemble each other stay on one side of the split; what was held out stays so.

Examples
--------
>>> knowledge = begin_learning(data, recipe, models)  # doctest: +SKIP
>>> for _ in range(3):  # doctest: +SKIP
...     knowledge, found = learn_actively(knowledge, ActiveSettings(seed=knowledge.rounds))
...     print(found.surprise)
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.learning.proposing import ActiveSettings, label_designs, propose_designs
from bellcrank.surrogate.dataset import Dataset, merge
from bellcrank.surrogate.metrics import Accuracy, accuracy
from bellcrank.surrogate.predictor import Predictor
from bellcrank.surrogate.splitting import Split, split_by_run
from bellcrank.surrogate.training import begin

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bellcrank.surrogate.recipes import Recipe
    from bellcrank.surrogate.trained import TrainedModel


@dataclass(frozen=True, slots=True, eq=False)
class Knowledge:
    """Where active learning stands between two rounds.

    Parameters
    ----------
    data
        All labelled designs.
    original
        How many of them, the first ones, were there before.
    split
        Which of them are learnt from and which are held out; nothing ever changes sides.
    recipe
        Of the training; member k has the recipe's seed + k.
    models
        The networks.
    rounds
        Made so far.
    """

    data: Dataset
    original: int
    split: Split
    recipe: Recipe
    models: tuple[TrainedModel, ...]
    rounds: int = 0


@dataclass(frozen=True, slots=True)
class Round:
    """What a round of active learning has found.

    Parameters
    ----------
    proposed, labelled
        Designs that the mechanics was asked about, and those with a unique response.
    surprise
        How good the predictions for these were before training.
    held_out
        For each network, how good it is afterwards on what is held out of the original data.
    """

    proposed: int
    labelled: int
    surprise: Accuracy
    held_out: tuple[Accuracy, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the record as plain data."""
        return asdict(self)


def begin_learning(data: Dataset, recipe: Recipe, models: Sequence[TrainedModel]) -> Knowledge:
    """Begin with networks that were trained by a recipe on a dataset.

    Raises
    ------
    InvalidDataset
        If all designs come from a single run.
    """
    split = split_by_run(data, recipe.held_out, recipe.split_seed)
    return Knowledge(data, len(data), split, recipe, tuple(models))


def learn_actively(
    knowledge: Knowledge,
    settings: ActiveSettings,
    *,
    device: str = "auto",
    tell: Callable[[str, int, int], None] = lambda _what, _done, _total: None,
    stop: Callable[[], bool] = lambda: False,
) -> tuple[Knowledge, Round] | None:
    """Make one round: search, label, train.

    Parameters
    ----------
    tell
        Called with what is being done (``searching``, ``labelling`` or ``training``), how much
        of it is done and how much there is.
    stop
        Asked now and then whether to end.

    Returns
    -------
    Knowledge and Round, or None
        None if it was stopped: what was known before still holds.

    Raises
    ------
    InvalidSettings
        If caution is asked of one network, or a warm start of another kind of network.
    InvalidDataset
        If no proposed design has a unique response.
    """
    predictor = Predictor(knowledge.data.problem, knowledge.models, device=device)
    chosen = propose_designs(predictor, settings, tell=tell, stop=stop)
    if stop():
        return None
    part = label_designs(predictor, chosen, settings, tell=tell)
    said = predictor.predict(_masks(part.packed, part)).efficiency
    grown = _grow(knowledge, part)
    models = []
    for member in range(len(knowledge.models)):
        model = _train(grown, member, settings, device=device, tell=tell, stop=stop)
        if model is None:
            return None
        models.append(model)
    held_out = tuple(_test(grown, model, device) for model in models)
    found = Round(sum(map(len, chosen)), len(part), accuracy(said, part.efficiency), held_out)
    return replace(grown, models=tuple(models), rounds=knowledge.rounds + 1), found


def _grow(knowledge: Knowledge, part: Dataset) -> Knowledge:
    """Return what is known together with newly labelled designs."""
    before, count = knowledge.split, len(knowledge.data)
    data = merge([knowledge.data, part])
    if part.run_count > 1:
        recipe = knowledge.recipe
        new = split_by_run(part, recipe.held_out, recipe.split_seed + knowledge.rounds + 1)
        split = Split(
            np.concatenate([before.training, new.training + count]),
            np.concatenate([before.held_out, new.held_out + count]),
        )
    else:
        rows = np.arange(count, len(data))
        split = Split(np.concatenate([before.training, rows]), before.held_out)
    return replace(knowledge, data=data, split=split)


def _test(knowledge: Knowledge, model: TrainedModel, device: str) -> Accuracy:
    """Test a network on some of what is held out of the original data."""
    rows = knowledge.split.held_out
    rows = rows[rows < knowledge.original]
    rows = rows[:: -(-len(rows) // knowledge.recipe.tested)]
    predicted = model.predict(knowledge.data.packed[rows], device=device)
    return accuracy(predicted, knowledge.data.efficiency[rows])


def _train(
    knowledge: Knowledge,
    member: int,
    settings: ActiveSettings,
    *,
    device: str,
    tell: Callable[[str, int, int], None],
    stop: Callable[[], bool],
) -> TrainedModel | None:
    """Train one network with what is known; None if stopped."""
    recipe, old = knowledge.recipe, knowledge.models[member]
    training = begin(knowledge.data, replace(recipe, seed=recipe.seed + member), device=device)
    # Not the split that the enlarged data would get: nothing that a network has learnt from may
    # be held out now.
    rows = knowledge.split.training
    extra = rows[rows >= knowledge.original]
    training.split = Split(
        np.concatenate([rows, np.tile(extra, _repeats(len(rows), len(extra), settings.share))]),
        knowledge.split.held_out,
    )
    if settings.warm:
        training.go_on_from(old)
    for progress in training.run(stop):
        tell("training", progress.done, progress.total)
    return training.finish(recipe.tested) if training.is_done else None


def _repeats(rows: int, extra: int, share: float) -> int:
    """Return how often to repeat new rows, beyond once, to make a share of all.

    Examples
    --------
    >>> _repeats(rows=1000, extra=100, share=0.25), _repeats(rows=1000, extra=500, share=0.25)
    (2, 0)
    """
    if not extra:
        return 0
    wanted = share / (1.0 - share) * (rows - extra)
    return max(math.ceil(wanted / extra) - 1, 0)


def _masks(packed: NDArray[np.uint8], data: Dataset) -> NDArray[np.bool_]:
    return np.unpackbits(packed, axis=1, count=data.problem.lattice.beam_count).astype(bool)
