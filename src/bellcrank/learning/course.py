"""What learning in rounds is asked for: how it is begun, kept in a folder and read again."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidFile, InvalidSettings, first_line
from bellcrank.learning.fitting import member_folders
from bellcrank.learning.proposing import ActiveSettings
from bellcrank.learning.round_files import ROUNDS, check_unused, read_record
from bellcrank.model.storage import write_text
from bellcrank.provenance import provenance
from bellcrank.search.settings import check_whole
from bellcrank.storage.files import make_folder
from bellcrank.surrogate.beginning import begin
from bellcrank.surrogate.folder import INITIAL, data_hash
from bellcrank.surrogate.recipes import Recipe

if TYPE_CHECKING:
    import os

    from bellcrank.learning.fitting import Ensemble
    from bellcrank.surrogate.dataset import Dataset

ROUNDS_SCHEMA = "bellcrank/rounds/1"


@dataclass(frozen=True, slots=True, kw_only=True)
class Course:
    """What learning in rounds was asked for.

    Parameters
    ----------
    rounds
        How many.
    members
        Networks.
    recipe
        Of the first training; in a round some of it may differ, as the settings say.
    settings
        Of the first round; each has the next seed.
    data
        Hash of the dataset.
    given
        Whether networks to begin with were given; else they are trained first.
    """

    rounds: int
    members: int
    recipe: Recipe
    settings: ActiveSettings
    data: str
    given: bool

    def settings_of(self, number: int) -> ActiveSettings:
        """Return the settings of a round, from 1."""
        return replace(self.settings, seed=self.settings.seed + number - 1)


def is_course(folder: str | os.PathLike[str]) -> bool:
    """Whether a folder is one of learning in rounds."""
    return (Path(folder) / ROUNDS).exists()


def write_course(folder: Path, course: Course) -> None:
    """Make the folder, and say in it what is asked for.

    Raises
    ------
    OutputExists, StorageError
    """
    make_folder(folder)
    told = {
        "schema": ROUNDS_SCHEMA,
        "rounds": course.rounds,
        "members": course.members,
        "recipe": course.recipe.to_dict(),
        "settings": course.settings.to_dict(),
        "data": course.data,
        "given": course.given,
        "provenance": provenance(seed=course.settings.seed),
    }
    write_text(folder / ROUNDS, json.dumps(told, indent=1) + "\n")


def read_course(folder: str | os.PathLike[str]) -> Course:
    """Read what was asked for.

    Raises
    ------
    InvalidFile
        If it is not there, or damaged.
    """
    place = Path(folder) / ROUNDS
    told = read_record(place, ROUNDS_SCHEMA)
    try:
        return Course(
            rounds=_count(told["rounds"]),
            members=_count(told["members"]),
            recipe=Recipe.from_dict(told["recipe"]),
            settings=ActiveSettings.from_dict(told["settings"]),
            data=str(told["data"]),
            given=bool(told["given"]),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidFile(
            f"{place}: damaged ({first_line(error)}); restore it from a copy"
        ) from None


def begin_rounds(
    data: Dataset,
    ensemble: Ensemble,
    folder: str | os.PathLike[str],
    settings: ActiveSettings,
    rounds: int,
    *,
    device: str = "auto",
) -> Course:
    """Begin to learn in rounds, in a new folder; `learn_in_rounds` does the work there.

    Parameters
    ----------
    ensemble
        Trained first, unless it has networks to go on from, which search at once then. Its recipe
        is that of the rounds too, as far as the settings do not differ.
    settings
        Of the first round; each has the next seed.
    rounds
        How many, at least 1.

    Raises
    ------
    InvalidSettings
        If there are to be no rounds, caution is asked of one network, the device is missing or
        there is nothing to learn.
    InvalidModel
        If networks to go on from have learnt another problem.
    InvalidDataset
        If the data come from a single run.
    UnknownName
        If there is no such model.
    OutputExists, StorageError
        If the folder holds something of trainings already, or cannot be written.
    """
    check_whole("rounds", rounds, 1)
    starts = ensemble.starts(data.problem)
    if settings.caution and len(starts) < 2:
        raise InvalidSettings(
            "caution: takes off what several networks dispute, and there is only one; train more "
            "(--members 3), or leave it at 0"
        )
    place = Path(folder)
    check_unused(place)
    # Kept nowhere: refuses whatever could not be trained.
    begin(data, settings.adapt(ensemble.recipe), device=device, initial=starts[0])
    course = Course(
        rounds=rounds, members=len(starts), recipe=ensemble.recipe, settings=settings,
        data=data_hash(data), given=bool(ensemble.initial),
    )  # fmt: skip
    for own, start in zip(member_folders(place, len(starts)), starts, strict=True):
        if start is not None:
            make_folder(own)
            start.write(own / INITIAL, overwrite=True)
    write_course(place, course)
    return course


def _count(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise ValueError(f"expected a whole number of at least 1, got {value!r}")
    return value
