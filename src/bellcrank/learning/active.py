"""Active learning: let networks search, label by mechanics what they propose, train them again.

A search driven by a network goes where the network is too hopeful, and there is little of that
in the data of searches by mechanics. A round labels such designs, above all those that several
networks dispute, and goes on training with them. Each chain is a run of its own, so that
designs which resemble each other stay on one side of the split; what was held out stays so.

A round has two steps, `label_round` and the training by the `lesson` for each network (see
`bellcrank.learning.knowledge`); `learn_actively` makes both, and `bellcrank.learning.rounds`
keeps what they make.

Examples
--------
>>> from bellcrank.learning.knowledge import begin_learning
>>> from bellcrank.learning.proposing import ActiveSettings
>>> knowledge = begin_learning(data, recipe, models)  # doctest: +SKIP
>>> for _ in range(3):  # doctest: +SKIP
...     knowledge, found = learn_actively(knowledge, ActiveSettings(seed=knowledge.rounds))
...     print(found.surprise)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from bellcrank.learning.knowledge import grow, lesson
from bellcrank.learning.proposing import label_designs, propose_designs
from bellcrank.surrogate.beginning import begin
from bellcrank.surrogate.metrics import Accuracy, accuracy
from bellcrank.surrogate.predictor import Predictor
from bellcrank.surrogate.splitting import thinned

if TYPE_CHECKING:
    from collections.abc import Callable

    from bellcrank.learning.heard import Heard
    from bellcrank.learning.knowledge import Knowledge
    from bellcrank.learning.proposing import ActiveSettings
    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.trained import TrainedModel


@dataclass(frozen=True, slots=True, eq=False)
class Labelled:
    """What a round has found before anything is learnt from it.

    Parameters
    ----------
    data
        Designs that the networks proposed and that have a unique response; a run a chain.
    proposed
        Designs that the mechanics was asked about.
    surprise
        How good the networks' predictions for `data`, or some of it, were.
    """

    data: Dataset
    proposed: int
    surprise: Accuracy


@dataclass(frozen=True, slots=True)
class Round:
    """What a round of active learning has found.

    Parameters
    ----------
    proposed, labelled
        Designs that the mechanics was asked about, and those with a unique response.
    surprise
        How good the predictions for these, or some of them, were before training.
    held_out
        For each network, how good it is afterwards on what is held out of the original data.
    """

    proposed: int
    labelled: int
    surprise: Accuracy
    held_out: tuple[Accuracy, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the record as plain data."""
        return {
            "proposed": self.proposed,
            "labelled": self.labelled,
            "surprise": self.surprise.to_dict(),
            "held_out": [each.to_dict() for each in self.held_out],
        }

    @classmethod
    def from_dict(cls, told: dict[str, Any]) -> Self:
        """Rebuild a record from `to_dict`; what else it says is left aside.

        Raises
        ------
        KeyError, TypeError, ValueError
            If it is none.
        """
        held_out = tuple(map(Accuracy.from_dict, told["held_out"]))
        surprise = Accuracy.from_dict(told["surprise"])
        return cls(int(told["proposed"]), int(told["labelled"]), surprise, held_out)


def learn_actively(
    knowledge: Knowledge,
    settings: ActiveSettings,
    *,
    device: str = "auto",
    tell: Callable[[str, int, int], None] = lambda _what, _done, _total: None,
    stop: Callable[[], bool] = lambda: False,
) -> tuple[Knowledge, Round] | None:
    """Make one round: search, label, train. Nothing is kept on disk.

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
    labelled = label_round(knowledge, settings, device=device, tell=tell, stop=stop)
    if labelled is None or stop():
        return None
    grown = grow(knowledge, labelled.data)
    models = []
    for member in range(len(knowledge.models)):
        plan = lesson(grown, member, settings)
        training = begin(
            grown.data, plan.recipe, device=device, initial=plan.initial, split=plan.split
        )
        for progress in training.run(stop):
            tell("training", progress.done, progress.total)
        if not training.is_done:
            return None
        models.append(training.finish(plan.recipe.tested))
    learnt = replace(grown, models=tuple(models))
    return learnt, conclude(learnt, labelled, device=device)


def label_round(
    knowledge: Knowledge,
    settings: ActiveSettings,
    *,
    heard: Heard | None = None,
    device: str = "auto",
    tell: Callable[[str, int, int], None] = lambda _what, _done, _total: None,
    stop: Callable[[], bool] = lambda: False,
) -> Labelled | None:
    """Make the first step of a round: let the networks search, and label what they propose.

    Parameters
    ----------
    heard
        What the networks said before the search was stopped; gets what they say now.

    Returns
    -------
    Labelled or None
        None if the search was stopped; labelling, which is quick, goes to its end.

    Raises
    ------
    InvalidSettings
        If caution is asked of one network.
    InvalidDataset
        If no proposed design has a unique response.
    """
    predictor = Predictor(knowledge.data.problem, knowledge.models, device=device)
    chosen = propose_designs(predictor, settings, heard=heard, tell=tell, stop=stop)
    if not chosen:
        return None
    data = label_designs(predictor, chosen, settings, tell=tell)
    some = thinned(np.arange(len(data)), knowledge.recipe.tested)
    beams = data.problem.lattice.beam_count
    masks = np.unpackbits(data.packed[some], axis=1, count=beams).astype(bool)
    surprise = accuracy(predictor.predict(masks).efficiency, data.efficiency[some])
    return Labelled(data, sum(map(len, chosen)), surprise)


def conclude(learnt: Knowledge, labelled: Labelled, *, device: str = "auto") -> Round:
    """Return what a round has found, after its networks were trained.

    Parameters
    ----------
    learnt
        With the networks of this round.
    """
    held_out = tuple(_test(learnt, model, device) for model in learnt.models)
    return Round(labelled.proposed, len(labelled.data), labelled.surprise, held_out)


def _test(knowledge: Knowledge, model: TrainedModel, device: str) -> Accuracy:
    """Test a network on some of what is held out of the original data."""
    rows = knowledge.split.held_out
    rows = thinned(rows[rows < knowledge.original], knowledge.recipe.tested)
    predicted = model.predict(knowledge.data.packed[rows], device=device)
    return accuracy(predicted, knowledge.data.efficiency[rows])
