"""What learning in rounds leaves in its folder, and how it is read again.

``rounds.json`` says what was asked for (`bellcrank.learning.course`). ``round-1/``, ``round-2/``,
... hold the labelled designs, the trainings with their checkpoints and models, and at last a
record: a round that has one is finished. Networks to begin with are kept beside ``rounds.json``:
those of the first training, or copies of those that were given.
"""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bellcrank.errors import BellcrankError, CorruptRun, InvalidFile, OutputExists, first_line
from bellcrank.learning.active import Labelled, Round
from bellcrank.model.parsing import read_json
from bellcrank.model.storage import write_text
from bellcrank.provenance import provenance
from bellcrank.storage.files import make_folder, remove_temporaries
from bellcrank.surrogate.dataset import read_dataset
from bellcrank.surrogate.folder import check_new
from bellcrank.surrogate.metrics import Accuracy

if TYPE_CHECKING:
    import os

ROUNDS = "rounds.json"
RECORD = "round.json"
DESIGNS = "designs.parquet"
SEARCH = "search.npz"
"""What the networks have said so far, while they are searching."""
ROUND_SCHEMA = "bellcrank/round/1"
_OURS = re.compile("|".join(map(re.escape, (DESIGNS, RECORD, SEARCH))))


def round_folder(folder: Path, number: int) -> Path:
    """Return the folder of a round, from 1."""
    return folder / f"round-{number}"


def tidy_round(place: Path) -> None:
    """Remove the files of a round that a killed process was writing.

    Raises
    ------
    StorageError
    """
    remove_temporaries(place, _OURS)


def is_finished(folder: Path, number: int) -> bool:
    """Whether a round has been made to its end."""
    return (round_folder(folder, number) / RECORD).exists()


def last_finished(folder: Path) -> Path:
    """Return the folder with the newest networks: of the last finished round, or this one.

    Examples
    --------
    >>> last_finished(Path("where-nothing-is")).name
    'where-nothing-is'
    """
    number = 0
    while is_finished(folder, number + 1):
        number += 1
    return round_folder(folder, number) if number else folder


def check_unused(folder: str | os.PathLike[str]) -> None:
    """Refuse a folder that holds anything of trainings, before something is written into it.

    Raises
    ------
    OutputExists
    """
    place = Path(folder)
    taken = [place / ROUNDS, *sorted(place.glob("round-*"))]
    for path in taken:
        if path.exists():
            raise OutputExists(
                f"{path}: learning in rounds lies there already; go on with it (--resume), or "
                f"choose another folder (--out)"
            )
    for own in (place, *sorted(place.glob("member-*"))):
        check_new(own)


def write_labelled(place: Path, number: int, labelled: Labelled) -> None:
    """Keep the designs of a round, with what is known about them, in one file.

    Raises
    ------
    OutputExists, StorageError
    """
    make_folder(place)
    origin = {
        **labelled.data.origin,
        "round": number,
        "proposed": labelled.proposed,
        "surprise": labelled.surprise.to_dict(),
    }
    replace(labelled.data, origin=origin).write(place / DESIGNS)


def read_labelled(place: Path) -> Labelled:
    """Read the designs of a round.

    Raises
    ------
    CorruptRun
        If they are missing or damaged.
    """
    path = place / DESIGNS
    try:
        data = read_dataset(path)
        surprise = Accuracy.from_dict(data.origin["surprise"])
        return Labelled(data, int(data.origin["proposed"]), surprise)
    except BellcrankError as error:
        reason = str(error).removeprefix(f"{path}: ").partition("; bellcrank")[0]
    except (KeyError, TypeError, ValueError) as error:
        reason = first_line(error)
    raise CorruptRun(
        f"{path}: cannot be read ({reason}); delete it and resume: the round searches again"
    )


def write_round(place: Path, number: int, found: Round, data: str) -> None:
    """Keep the record of a round: it is finished then.

    Parameters
    ----------
    data
        Hash of all that its networks have learnt from.

    Raises
    ------
    OutputExists, StorageError
    """
    told = {
        "schema": ROUND_SCHEMA,
        "round": number,
        **found.to_dict(),
        "data": data,
        "provenance": provenance(),
    }
    write_text(place / RECORD, json.dumps(told, indent=1) + "\n")


def read_round(place: Path, number: int, data: str) -> Round | None:
    """Read the record of a round; None if there is none yet.

    Parameters
    ----------
    data
        Hash of all that its networks should have learnt from.

    Raises
    ------
    InvalidFile
        If it is damaged.
    CorruptRun
        If its networks have learnt from something else than lies there.
    """
    path = place / RECORD
    if not path.exists():
        return None
    what_to_do = "delete it and resume: it is made again"
    try:
        told = read_record(path, ROUND_SCHEMA)
        found = Round.from_dict(told)
        if told["round"] != number:
            raise InvalidFile(f"it is of round {told['round']}")
    except (KeyError, TypeError, ValueError) as error:
        reason = first_line(error).removeprefix(f"{path}: ")
        raise InvalidFile(f"{path}: damaged ({reason}); {what_to_do}") from None
    if told.get("data") != data:
        raise CorruptRun(
            f"{path}: its networks have learnt from other designs than those that lie there; "
            f"restore {DESIGNS} in this and the earlier rounds from a copy"
        )
    return found


def read_record(path: Path, schema: str) -> dict[str, Any]:
    """Read a JSON file that says by a schema what it is.

    Raises
    ------
    InvalidFile
        If it cannot be read, or is something else.
    """
    told = read_json(path)
    if told.get("schema") != schema:
        raise InvalidFile(f"{path}: expected schema {schema!r}, got {told.get('schema')!r}")
    return told
