"""Training one network, or several that differ in their seeds, in one folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile, InvalidSettings
from bellcrank.learning.round_files import check_unused, last_finished
from bellcrank.storage.files import make_folder
from bellcrank.surrogate.beginning import begin, resume
from bellcrank.surrogate.folder import (
    DESCRIPTION,
    INITIAL,
    MODEL,
    read_description,
    require_data,
)
from bellcrank.surrogate.matching import require_same_numbers
from bellcrank.surrogate.metrics import Accuracy
from bellcrank.surrogate.predictor import load_models
from bellcrank.surrogate.splitting import thinned
from bellcrank.surrogate.trained import read_model

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable, Sequence

    from bellcrank.model import Problem
    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.progress import Progress
    from bellcrank.surrogate.recipes import Recipe
    from bellcrank.surrogate.trained import TrainedModel
    from bellcrank.surrogate.training import Training

MOST_MEMBERS = 100
SHIPPED_WORD = "shipped"
"""Stands for the network that comes with bellcrank."""
PICTURE = "training.png"
DRAWN = 20_000
"""Held-out designs in the picture, at most."""


@dataclass(frozen=True, slots=True, eq=False)
class Ensemble:
    """Networks to be trained by one recipe, each with the next seed.

    Parameters
    ----------
    recipe
        Of the first of them.
    members
        How many; by default as many as there are in `initial`, or one.
    initial
        Networks that they go on from: one each, or one for all. By default they begin with
        random weights.

    Raises
    ------
    InvalidSettings
        If the number of members makes no sense, or an architecture is not the recipe's.
    """

    recipe: Recipe
    members: int | None = None
    initial: Sequence[TrainedModel] = ()

    def __post_init__(self) -> None:
        count, initial = self.count, self.initial
        if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST_MEMBERS:
            raise InvalidSettings(f"members: expected 1 to {MOST_MEMBERS}, got {count!r}")
        if len(initial) > 1 and count != len(initial):
            raise InvalidSettings(
                f"members: {count} networks cannot go on from {len(initial)}; leave it out for one "
                f"each, or give a single network to go on from"
            )
        for model in initial:
            if model.architecture != self.recipe.model:
                raise InvalidSettings(
                    f"a {self.recipe.model!r} cannot go on from the weights of a "
                    f"{model.architecture!r}; ask for that model (--model {model.architecture}), "
                    f"or begin afresh"
                )

    @property
    def count(self) -> int:
        """How many there are."""
        return (len(self.initial) or 1) if self.members is None else self.members

    def starts(self, problem: Problem) -> list[TrainedModel | None]:
        """Return what each network goes on from; None is random weights.

        Raises
        ------
        InvalidModel
            If one has learnt another problem, or numbers its beams otherwise.
        """
        for model in self.initial:
            require_same_numbers(model.problem, problem)
        if not self.initial:
            return [None] * self.count
        return [self.initial[member % len(self.initial)] for member in range(self.count)]


@dataclass(frozen=True, slots=True)
class FitProgress:
    """Where the training of an ensemble is.

    Parameters
    ----------
    member, members
        The network at hand, from 0, and how many there are.
    progress
        Of that network.
    """

    member: int
    members: int
    progress: Progress


def fit(
    data: Dataset,
    ensemble: Ensemble | None,
    folder: str | os.PathLike[str],
    *,
    device: str = "auto",
    tell: Callable[[FitProgress], None] = lambda _progress: None,
    stop: Callable[[], bool] = lambda: False,
) -> list[TrainedModel] | None:
    """Train networks, one after the other; go on where a folder has begun ones.

    Parameters
    ----------
    ensemble
        To be begun; None goes on with what is there.
    folder
        Gets the model, or for several members a folder of each.

    Returns
    -------
    list of TrainedModel or None
        None if it was stopped; what is done is kept.

    Raises
    ------
    InvalidSettings
        If the data are others than those that it was begun with.
    InvalidModel
        If networks to go on from have learnt another problem.
    OutputExists
        If a training lies in the folder and an ensemble was given.
    InvalidFile
        If none lies there and no ensemble was given.
    """
    place = Path(folder)
    if ensemble is None:
        folders = _begun(place, data, device)
    else:
        starts = ensemble.starts(data.problem)
        check_unused(place)
        folders = member_folders(place, len(starts))
        for own, start in zip(folders, starts, strict=True):  # for whoever goes on to find
            if start is not None:
                make_folder(own)
                start.write(own / INITIAL, overwrite=True)
        for member, own in enumerate(folders):
            begin(
                data, ensemble.recipe.of_member(member), own, device=device,
                initial=starts[member], members=len(folders),
            )  # fmt: skip
    return complete(
        folders, lambda member: resume(folders[member], data, device=device),
        device=device, tell=tell, stop=stop,
    )  # fmt: skip


def member_folders(place: Path, members: int) -> list[Path]:
    """Return the folders of the networks of an ensemble: that of the whole, if there is one."""
    if members == 1:
        return [place]
    return [place / f"member-{member}" for member in range(members)]


def complete(
    folders: Sequence[Path],
    take_up: Callable[[int], Training],
    *,
    most: int | None = None,
    device: str = "auto",
    tell: Callable[[FitProgress], None] = lambda _progress: None,
    stop: Callable[[], bool] = lambda: False,
) -> list[TrainedModel] | None:
    """Train to the end what is not trained yet, one network after the other.

    Parameters
    ----------
    folders
        Of the networks.
    take_up
        Begins or resumes the training of that number.
    most
        Held-out designs to test each on in the end; by default as its recipe says.

    Returns
    -------
    list of TrainedModel or None
        As they lie in the folders: the same, to the last bit, whoever trained them. None if it
        was stopped.
    """
    for member, own in enumerate(folders):
        if (own / PICTURE).exists():  # which is made last
            continue

        def say(progress: Progress, member: int = member) -> None:
            tell(FitProgress(member, len(folders), progress))

        training = take_up(member)
        for progress in training.run(stop):
            say(progress)
        if not training.is_done:
            return None
        finished = (own / MODEL).exists()
        model = read_model(own / MODEL) if finished else training.finish(most, say)
        _draw(training, model, own / PICTURE, device)
    return [read_model(own / MODEL) for own in folders]


def _draw(training: Training, model: TrainedModel, path: Path, device: str) -> None:
    """Draw how well a network has learnt, on some of what was held out."""
    from bellcrank.plots.learning import Learnt, draw_learnt

    record, data = model.record, training.data
    tested = Accuracy.from_dict(record["held_out"])
    held_out = len(np.unique(data.run[training.split.held_out]))
    rows = thinned(training.split.held_out, min(DRAWN, tested.count))
    learnt = Learnt(
        name=f"{data.problem.name} by {model.architecture}",
        note=f"{record['designs']:,} designs seen, of {data.run_count - held_out:,} runs, in "
        f"{record['seconds'] / 60.0:.0f} minutes; tested on {held_out:,} other runs",
        predicted=model.predict(data.packed[rows], device=device),
        actual=data.efficiency[rows],
        r_squared=tested.r_squared,
        determination=tested.determination,
        designs=np.array([epoch["designs"] for epoch in record["epochs"]], np.float64),
        accuracy=np.array([epoch["r_squared"] for epoch in record["epochs"]], np.float64),
    )
    draw_learnt(learnt, path, overwrite=True)


def _begun(place: Path, data: Dataset, device: str) -> list[Path]:
    """Return the folders of the networks that are trained in a folder.

    A kill in the beginning may have left some of an ensemble without one; they are begun here.
    """
    found = _in_order(path.parent for path in place.glob(f"member-*/{DESCRIPTION}"))
    if not found and not (place / DESCRIPTION).exists():
        raise InvalidFile(f"{place}: no training to go on with: it has no {DESCRIPTION}")
    for own in found or [place]:  # finished ones too, which nobody resumes
        told = read_description(own)
        require_data(own, told, data)
    if not found:
        return [place]
    first = int(own.name.removeprefix("member-"))
    folders = member_folders(place, max(told.members, first + 1))
    for member, own in enumerate(folders):
        if own not in found:
            begin(
                data, told.recipe.of_member(member - first), own, device=device,
                initial=read_model(own / INITIAL) if told.initial else None, members=len(folders),
            )  # fmt: skip
    return folders


def networks_to_go_on_from(problem: Problem, start: str | os.PathLike[str]) -> list[TrainedModel]:
    """Return the networks that a word stands for.

    Parameters
    ----------
    problem
        That they are to go on learning.
    start
        A file, the folder of a training, or ``shipped`` for the network that comes with
        bellcrank.

    Raises
    ------
    InvalidModel
        If they have learnt another problem or are damaged, or none comes with bellcrank.
    InvalidFile
        If there is no such file.
    InvalidSettings
        If PyTorch is not installed.
    """
    return load_models(problem, () if str(start) == SHIPPED_WORD else model_files(start))


def model_files(path: str | os.PathLike[str]) -> list[Path]:
    """Return the model files that a path stands for: itself, or those in a training's folder.

    Where learning went on in rounds, they are those of the last finished round.

    Raises
    ------
    InvalidFile
        If it is a folder without any.
    """
    place = Path(path)
    if not place.is_dir():
        return [place]
    place = last_finished(place)
    if (place / MODEL).exists():
        return [place / MODEL]
    found = _in_order(place.glob(f"member-*/{MODEL}"))
    if not found:
        raise InvalidFile(f"{place}: no trained model in this folder; expected {MODEL}")
    return found


def _in_order(paths: Iterable[Path]) -> list[Path]:
    """Return paths by the numbers in their names: member-2 comes before member-10."""
    return sorted(paths, key=lambda path: (len(str(path)), path))
