"""What networks have learnt from, how that grows, and what each is to be taught next.

Nothing ever changes sides: what was held out when learning began stays held out, so that what is
said of a network after many rounds is said of designs that it has never seen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.surrogate.dataset import Dataset, merge
from bellcrank.surrogate.matching import require_same_numbers
from bellcrank.surrogate.splitting import Split, split_by_run

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bellcrank.learning.proposing import ActiveSettings
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


@dataclass(frozen=True, slots=True, eq=False)
class Lesson:
    """How one network is to be trained next.

    Parameters
    ----------
    recipe
        With the member's own seed.
    split
        Rows to learn from, new ones repeated, and rows held out; None leaves it to the recipe.
    initial
        The network to go on from; None begins afresh.
    """

    recipe: Recipe
    split: Split | None = None
    initial: TrainedModel | None = None


def begin_learning(data: Dataset, recipe: Recipe, models: Sequence[TrainedModel]) -> Knowledge:
    """Begin with networks that were trained by a recipe on a dataset, or on another of its problem.

    Raises
    ------
    InvalidDataset
        If all designs come from a single run.
    InvalidModel
        If a network has learnt another problem, or numbers beams otherwise.
    """
    for model in models:
        require_same_numbers(model.problem, data.problem)
    split = split_by_run(data, recipe.held_out, recipe.split_seed)
    return Knowledge(data, len(data), split, recipe, tuple(models))


def grow(knowledge: Knowledge, part: Dataset) -> Knowledge:
    """Return what is known together with the designs of one more round; networks are as before.

    Some chains of the round are held out; what was on one side of the split stays there.
    """
    before, count = knowledge.split, len(knowledge.data)
    data = merge([knowledge.data, part])
    rounds = knowledge.rounds + 1
    if part.run_count > 1:
        recipe = knowledge.recipe
        new = split_by_run(part, recipe.held_out, recipe.split_seed + rounds)
        split = Split(
            np.concatenate([before.training, new.training + count]),
            np.concatenate([before.held_out, new.held_out + count]),
        )
    else:
        rows = np.arange(count, len(data))
        split = Split(np.concatenate([before.training, rows]), before.held_out)
    return replace(knowledge, data=data, split=split, rounds=rounds)


def lesson(grown: Knowledge, member: int, settings: ActiveSettings) -> Lesson:
    """Return how a network is to be trained with what is known.

    The split is not the one that the enlarged data would get: nothing that a network has learnt
    from may be held out now.
    """
    recipe = settings.adapt(grown.recipe)
    rows = grown.split.training
    extra = rows[rows >= grown.original]
    repeated = np.tile(extra, _repeats(len(rows), len(extra), settings.share))
    return Lesson(
        recipe.of_member(member),
        Split(np.concatenate([rows, repeated]), grown.split.held_out),
        grown.models[member] if settings.warm else None,
    )


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
