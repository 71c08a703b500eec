"""Files in the folder of a training, and its description."""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile, InvalidSettings, OutputExists
from bellcrank.model.parsing import read_json
from bellcrank.model.storage import write_text
from bellcrank.provenance import provenance
from bellcrank.storage.files import make_folder, remove_temporaries
from bellcrank.surrogate.recipes import PRECISIONS, Recipe

if TYPE_CHECKING:
    import os

    from bellcrank.surrogate.dataset import Dataset

TRAINING_SCHEMA = "bellcrank/training/2"
DESCRIPTION = "training.json"
CHECKPOINT = "checkpoint.safetensors"
LOG = "log.csv"
MODEL = "model.safetensors"
_FILES = re.compile("|".join(map(re.escape, (DESCRIPTION, CHECKPOINT, LOG, MODEL))))


@dataclass(frozen=True, slots=True)
class Description:
    """Description of a training in its folder.

    Parameters
    ----------
    recipe
        Settings.
    precision
        ``float32`` or ``bfloat16``, as chosen at the start.
    data
        Hash of the dataset.
    """

    recipe: Recipe
    precision: str
    data: str


def check_new(folder: str | os.PathLike[str]) -> None:
    """Raise OutputExists if a folder contains any file of a training."""
    place = Path(folder)
    if (place / DESCRIPTION).exists():
        raise OutputExists(
            f"{place / DESCRIPTION}: this folder contains a training; resume it (--resume), or "
            f"choose another folder (--out)"
        )
    for name in (CHECKPOINT, LOG, MODEL):
        if (place / name).exists():
            raise OutputExists(f"{place / name}: exists already; choose another folder (--out)")


def write_description(folder: Path, description: Description) -> None:
    """Create the folder of a training, and write its description.

    Raises
    ------
    OutputExists
        If there is a description already.
    StorageError
        If it cannot be written.
    """
    make_folder(folder)
    data = {
        "schema": TRAINING_SCHEMA,
        "recipe": description.recipe.to_dict(),
        "precision": description.precision,
        "data": description.data,
        "provenance": provenance(),
    }
    write_text(folder / DESCRIPTION, json.dumps(data, indent=1) + "\n")


def read_description(folder: str | os.PathLike[str]) -> Description:
    """Read the description of a training.

    Raises
    ------
    InvalidFile
        If there is none, or it is damaged.
    """
    place = Path(folder) / DESCRIPTION
    if not place.exists():
        raise InvalidFile(f"{folder}: no training to resume: there is no {DESCRIPTION}")
    data = read_json(place)
    if data.get("schema") != TRAINING_SCHEMA:
        raise InvalidFile(
            f"{place}: expected schema {TRAINING_SCHEMA!r}, got {data.get('schema')!r}"
        )
    try:
        found = Description(
            Recipe.from_dict(data["recipe"]), str(data["precision"]), str(data["data"])
        )
    except (KeyError, TypeError, InvalidSettings) as error:
        raise InvalidFile(f"{place}: damaged ({error}); restore it from a copy") from None
    if found.precision not in PRECISIONS:
        raise InvalidFile(
            f"{place}: damaged (precision {found.precision!r}); restore it from a copy"
        )
    return found


def remove_leftovers(folder: Path) -> None:
    """Remove the temporary files of a killed training.

    Raises
    ------
    StorageError
    """
    remove_temporaries(folder, _FILES)


def data_hash(data: Dataset) -> str:
    """Return a hash of the masks, efficiencies and runs of a dataset."""
    digest = hashlib.sha256()
    for column in (data.packed, data.efficiency, data.run):
        digest.update(np.ascontiguousarray(column).tobytes())
    return digest.hexdigest()[:16]
