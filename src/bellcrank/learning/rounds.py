"""Learning in rounds, kept in a folder: whatever stops it, it ends with the same networks.

The networks are trained, or given; then they search, the mechanics labels what they propose, and
they are trained again with that, as often as asked for (`bellcrank.learning.active`). Each step
of a round is a function of the steps before it, and leaves what it made in one stroke: the
labelled designs, each trained network, the record. Whoever goes on makes what is not there yet.
Between two steps everything is read back from the folder, so that nothing depends on who made it.

Examples
--------
>>> from bellcrank.learning.course import begin_rounds
>>> from bellcrank.learning.fitting import Ensemble
>>> from bellcrank.learning.proposing import ActiveSettings
>>> settings = ActiveSettings(chains=200, epochs=1)
>>> begin_rounds(data, Ensemble(recipe, 3), "crane-rounds", settings, rounds=3)  # doctest: +SKIP
>>> learnt = learn_in_rounds("crane-rounds", data)  # doctest: +SKIP
>>> [found.surprise.r_squared for found in learnt.rounds]  # doctest: +SKIP
[0.71, 0.88, 0.93]
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from bellcrank.errors import InvalidFile, InvalidSettings
from bellcrank.learning.active import conclude, label_round
from bellcrank.learning.course import is_course, read_course
from bellcrank.learning.fitting import complete, member_folders
from bellcrank.learning.heard import Heard
from bellcrank.learning.knowledge import Lesson, begin_learning, grow, lesson
from bellcrank.learning.round_files import (
    DESIGNS,
    ROUNDS,
    SEARCH,
    read_labelled,
    read_round,
    round_folder,
    tidy_round,
    write_labelled,
    write_round,
)
from bellcrank.storage.files import make_folder
from bellcrank.surrogate.beginning import begin, resume
from bellcrank.surrogate.folder import DESCRIPTION, INITIAL, data_hash
from bellcrank.surrogate.trained import read_model

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Sequence

    from bellcrank.learning.active import Labelled, Round
    from bellcrank.learning.course import Course
    from bellcrank.learning.fitting import FitProgress
    from bellcrank.learning.knowledge import Knowledge
    from bellcrank.learning.proposing import ActiveSettings
    from bellcrank.surrogate.dataset import Dataset
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

        def take_up(member: int) -> Training:
            plan = Lesson(self.course.recipe.of_member(member))
            return self._take_up(data, plan, folders[member])

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
            return self._take_up(grown.data, lesson(grown, member, settings), folders[member])

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

    def _take_up(self, data: Dataset, plan: Lesson, folder: Path) -> Training:
        """Begin a training, or go on with it."""
        if (folder / DESCRIPTION).exists():
            return resume(folder, data, device=self.device, split=plan.split)
        return begin(
            data, plan.recipe, folder, device=self.device, initial=plan.initial, split=plan.split
        )

    def _complete(
        self, folders: Sequence[Path], take_up: Callable[[int], Training], number: int
    ) -> list[TrainedModel] | None:
        def tell(fit: FitProgress) -> None:
            self._say(number, "training", fit.progress.done, fit.progress.total, fit=fit)

        most = self.course.recipe.tested if number else None
        return complete(folders, take_up, most=most, device=self.device, tell=tell, stop=self.stop)

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
