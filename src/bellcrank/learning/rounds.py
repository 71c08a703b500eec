"""Learning in rounds, kept in a folder: whatever stops it, it ends with the same networks.

The networks are trained, or given; then they search, the mechanics labels what they propose, and
they are trained again with that, as often as asked for (`bellcrank.learning.active`). Each step
of a round is a function of the steps before it, and leaves what it made in one stroke: the
labelled designs, each trained network, the record. Whoever goes on makes what is not there yet.
Between two steps everything is read back from the folder, so that nothing depends on who made it.

Examples
--------
>>> from bellcrank.learning.proposing import ActiveSettings
>>> settings = ActiveSettings(chains=200, epochs=1)
>>> begin_rounds(data, recipe, "crane-rounds", settings, rounds=3)  # doctest: +SKIP
>>> learnt = learn_in_rounds("crane-rounds", data)  # doctest: +SKIP
>>> [found.surprise.r_squared for found in learnt.rounds]  # doctest: +SKIP
[0.71, 0.88, 0.93]
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from bellcrank.errors import InvalidFile, InvalidSettings
from bellcrank.learning.active import (
    Knowledge,
    Labelled,
    Round,
    begin_learning,
    conclude,
    grow,
    label_round,
    lesson,
)
from bellcrank.learning.fitting import FitProgress, complete, member_folders, starts_of
from bellcrank.learning.heard import Heard
from bellcrank.learning.round_files import (
    DESIGNS,
    ROUNDS,
    SEARCH,
    Course,
    check_unused,
    is_course,
    read_course,
    read_labelled,
    read_round,
    round_folder,
    tidy_round,
    write_course,
    write_labelled,
    write_round,
)
from bellcrank.runs.files import make_folder
from bellcrank.surrogate.folder import DESCRIPTION, INITIAL
from bellcrank.surrogate.trained import read_model
from bellcrank.surrogate.training import begin, data_hash, resume

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Sequence

    from bellcrank.learning.proposing import ActiveSettings
    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.recipes import Recipe
    from bellcrank.surrogate.splitting import Split
    from bellcrank.surrogate.trained import TrainedModel
    from bellcrank.surrogate.training import Training


@dataclass(frozen=True, slots=True)
class RoundsProgress:
    """Where learning in rounds is.

    Parameters
    ----------
    number, rounds
        The round at hand, 0 for the first training, and how many there are to be.
    what
        Being done: ``searching``, ``labelling`` or ``training``; ``finished`` at a round's end.
    done, total
        Steps of the search, designs to label, or designs to train the network at hand with.
    fit
        Where training is, while it is going on.
    found
        What the round has found, at its end.
    """

    number: int
    rounds: int
    what: str
    done: int
    total: int
    fit: FitProgress | None = None
    found: Round | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Learnt:
    """What learning in rounds has come to.

    Parameters
    ----------
    models
        The networks after the last round.
    rounds
        What each round has found.
    """

    models: list[TrainedModel]
    rounds: list[Round]


def begin_rounds(
    data: Dataset,
    recipe: Recipe,
    folder: str | os.PathLike[str],
    settings: ActiveSettings,
    rounds: int,
    *,
    members: int | None = None,
    initial: Sequence[TrainedModel] = (),
    device: str = "auto",
) -> Course:
    """Begin to learn in rounds, in a new folder; `learn_in_rounds` does the work.

    Parameters
    ----------
    recipe
        Of the first training, and of the rounds as far as the settings do not differ.
    settings
        Of the first round; each has the next seed.
    rounds
        How many, at least 1.
    members, initial
        As `bellcrank.learning.fitting.fit` has them. With networks to go on from, the first
        training is left out.

    Raises
    ------
    InvalidSettings
        If a number makes no sense, caution is asked of one network, an architecture is not the
        recipe's, the device is missing or there is nothing to learn.
    InvalidModel
        If `initial` has learnt another problem.
    InvalidDataset
        If the data come from a single run.
    UnknownName
        If there is no such model.
    OutputExists, StorageError
        If the folder holds something of trainings already, or cannot be written.
    """
    if isinstance(rounds, bool) or not isinstance(rounds, int) or rounds < 1:
        raise InvalidSettings(f"rounds: expected a whole number of at least 1, got {rounds!r}")
    starts = starts_of(data.problem, recipe, members, initial)
    if settings.caution and len(starts) < 2:
        raise InvalidSettings(
            "caution: takes off what several networks dispute, and there is only one; train more "
            "(--members 3), or leave it at 0"
        )
    place = Path(folder)
    check_unused(place)
    # Kept nowhere: refuses whatever could not be trained.
    begin(data, settings.adapt(recipe), device=device, initial=starts[0])
    course = Course(
        rounds=rounds, members=len(starts), recipe=recipe, settings=settings,
        data=data_hash(data), given=bool(initial),
    )  # fmt: skip
    for own, start in zip(member_folders(place, len(starts)), starts, strict=True):
        if start is not None:
            make_folder(own)
            start.write(own / INITIAL, overwrite=True)
    write_course(place, course)
    return course


def learn_in_rounds(
    folder: str | os.PathLike[str],
    data: Dataset,
    *,
    device: str = "auto",
    tell: Callable[[RoundsProgress], None] = lambda _progress: None,
    stop: Callable[[], bool] = lambda: False,
) -> Learnt | None:
    """Do what `begin_rounds` has begun, or what is left of it.

    Parameters
    ----------
    data
        As it was begun with.
    tell
        Called now and then with where it is.
    stop
        Asked now and then whether to end.

    Returns
    -------
    Learnt or None
        None if it was stopped; what is done is kept.

    Raises
    ------
    InvalidFile
        If nothing was begun there, or a description or record is damaged.
    InvalidSettings
        If it was begun with other data.
    InvalidDataset
        If no design that the networks propose has a unique response.
    CorruptRun, InvalidModel
        If designs, a checkpoint or a network there are damaged.
    """
    place = Path(folder)
    if not is_course(place):
        raise InvalidFile(f"{folder}: no learning in rounds to go on with: it has no {ROUNDS}")
    course = read_course(place)
    if course.data != data_hash(data):
        raise InvalidSettings(f"{folder}: the learning there was begun with other data")
    work = _Work(place, course, device, tell, stop)
    models = work.first_networks(data)
    if models is None:
        return None
    knowledge = begin_learning(data, course.recipe, models)
    rounds: list[Round] = []
    for number in range(1, course.rounds + 1):
        made = work.make_round(knowledge, number)
        if made is None:
            return None
        knowledge = made[0]
        rounds.append(made[1])
    return Learnt(list(knowledge.models), rounds)


@dataclass(frozen=True, slots=True, eq=False)
class _Work:
    """Makes the steps that are not made yet."""

    folder: Path
    course: Course
    device: str
    tell: Callable[[RoundsProgress], None]
    stop: Callable[[], bool]

    def first_networks(self, data: Dataset) -> list[TrainedModel] | None:
        """Return the networks to begin with: trained here, or given."""
        folders = member_folders(self.folder, self.course.members)
        if self.course.given:
            return [read_model(own / INITIAL) for own in folders]
        recipe = self.course.recipe

        def take_up(member: int) -> Training:
            mine = replace(recipe, seed=recipe.seed + member)
            return self._take_up(data, mine, folders[member])

        return self._complete(folders, take_up, 0)

    def make_round(self, knowledge: Knowledge, number: int) -> tuple[Knowledge, Round] | None:
        """Make a round, or read what it has found; None if stopped."""
        settings = self.course.settings_of(number)
        place = round_folder(self.folder, number)
        tidy_round(place)
        labelled = self._label(knowledge, settings, number)
        if labelled is None:
            return None
        grown = grow(knowledge, labelled.data)
        identity = data_hash(grown.data)
        found = read_round(place, number, identity)
        if found is None and self.stop():
            return None
        folders = member_folders(place, self.course.members)

        def take_up(member: int) -> Training:
            plan = lesson(grown, member, settings)
            return self._take_up(grown.data, plan.recipe, folders[member], plan.initial, plan.split)

        models = self._complete(folders, take_up, number)
        if models is None:
            return None
        learnt = replace(grown, models=tuple(models))
        if found is None:
            found = conclude(learnt, labelled, device=self.device)
            write_round(place, number, found, identity)
            self._say(number, "finished", 1, 1, found=found)
        return learnt, found

    def _label(
        self, knowledge: Knowledge, settings: ActiveSettings, number: int
    ) -> Labelled | None:
        """Return the designs of a round; None if the search was stopped."""
        place = round_folder(self.folder, number)
        if not (place / DESIGNS).exists():
            make_folder(place)
            labelled = label_round(
                knowledge, settings, heard=Heard.at(place / SEARCH), device=self.device,
                tell=lambda what, done, total: self._say(number, what, done, total),
                stop=self.stop,
            )  # fmt: skip
            if labelled is None:
                return None
            write_labelled(place, number, labelled)
        (place / SEARCH).unlink(missing_ok=True)
        return read_labelled(place)

    def _take_up(
        self,
        data: Dataset,
        recipe: Recipe,
        folder: Path,
        initial: TrainedModel | None = None,
        split: Split | None = None,
    ) -> Training:
        """Begin a training, or go on with it."""
        if (folder / DESCRIPTION).exists():
            return resume(folder, data, device=self.device, split=split)
        return begin(data, recipe, folder, device=self.device, initial=initial, split=split)

    def _complete(
        self, folders: Sequence[Path], take_up: Callable[[int], Training], number: int
    ) -> list[TrainedModel] | None:
        def tell(fit: FitProgress) -> None:
            self._say(number, "training", fit.progress.done, fit.progress.total, fit=fit)

        return complete(folders, take_up, device=self.device, tell=tell, stop=self.stop)

    def _say(
        self,
        number: int,
        what: str,
        done: int,
        total: int,
        fit: FitProgress | None = None,
        found: Round | None = None,
    ) -> None:
        self.tell(RoundsProgress(number, self.course.rounds, what, done, total, fit, found))
