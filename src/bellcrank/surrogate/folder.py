"""The folder of a training: what lies in it, and what it says about itself."""

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

    from numpy.typing import ArrayLike

    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.splitting import Split

TRAINING_SCHEMA = "bellcrank/training/1"
DESCRIPTION = "training.json"
CHECKPOINT = "checkpoint.safetensors"
LOG = "log.csv"
MODEL = "model.safetensors"
INITIAL = "initial.safetensors"
"""A copy of the network that a training goes on from."""
_OURS = re.compile("|".join(map(re.escape, (DESCRIPTION, CHECKPOINT, LOG, MODEL, INITIAL))))


@dataclass(frozen=True, slots=True)
class Description:
    """What a training's folder says about it.

    Parameters
    ----------
    recipe
        How it learns.
    precision
        Of the arithmetic, as it was chosen when it began.
    data
        Hash of what it learns from.
    split
        Hash of which rows are learnt from and which are held out; None if the recipe says it.
    initial
        Whether it goes on from a network, a copy of which lies in the folder.
    members
        Networks of the ensemble that it belongs to, itself included.
    """

    recipe: Recipe
    precision: str
    data: str
    split: str | None = None
    initial: bool = False
    members: int = 1


def check_new(folder: str | os.PathLike[str]) -> None:
    """Refuse a folder that holds anything of a training.

    Raises
    ------
    OutputExists
    """
    place = Path(folder)
    if (place / DESCRIPTION).exists():
        raise OutputExists(
            f"{place / DESCRIPTION}: a training lies there already; go on with it (--resume), or "
            f"choose another folder (--out)"
        )
    for name in (CHECKPOINT, LOG, MODEL):
        if (place / name).exists():
            raise OutputExists(f"{place / name}: exists already; choose another folder (--out)")


def write_description(folder: Path, told: Description) -> None:
    """Make the folder of a training, and say in it what it is.

    Raises
    ------
    OutputExists
        If somebody else was faster.
    StorageError
        If that is impossible.
    """
    make_folder(folder)
    data = {
        "schema": TRAINING_SCHEMA,
        "recipe": told.recipe.to_dict(),
        "precision": told.precision,
        "data": told.data,
        "split": told.split,
        "initial": told.initial,
        "members": told.members,
        "provenance": provenance(),
    }
    write_text(folder / DESCRIPTION, json.dumps(data, indent=1) + "\n")


def read_description(folder: str | os.PathLike[str]) -> Description:
    """Read what a training's folder says about it.

    Raises
    ------
    InvalidFile
        If no training lies there, or its description is damaged.
    """
    place = Path(folder) / DESCRIPTION
    if not place.exists():
        raise InvalidFile(f"{folder}: no training to go on with: it has no {DESCRIPTION}")
    told = read_json(place)
    if told.get("schema") != TRAINING_SCHEMA:
        raise InvalidFile(
            f"{place}: expected schema {TRAINING_SCHEMA!r}, got {told.get('schema')!r}"
        )
    try:
        recipe = Recipe.from_dict(told["recipe"])
        precision, data = str(told["precision"]), str(told["data"])
        members = int(told.get("members", 1))
    except (KeyError, TypeError, InvalidSettings) as error:
        raise InvalidFile(f"{place}: damaged ({error}); restore it from a copy") from None
    if precision not in PRECISIONS:
        raise InvalidFile(f"{place}: damaged (precision {precision!r}); restore it from a copy")
    initial = bool(told.get("initial"))
    return Description(recipe, precision, data, told.get("split"), initial, members)


def tidy(folder: Path) -> None:
    """Remove the files that a killed training was writing.

    Raises
    ------
    StorageError
    """
    remove_temporaries(folder, _OURS)


def require_data(folder: str | os.PathLike[str], told: Description, data: Dataset) -> None:
    """Refuse data that a training was not begun with.

    Raises
    ------
    InvalidSettings
    """
    if told.data != data_hash(data):
        raise InvalidSettings(f"{folder}: the training there was begun with other data")


def data_hash(data: Dataset) -> str:
    """Return the identity of what is learnt from: masks, efficiencies and runs."""
    return _hash(data.packed, data.efficiency, data.run)


def split_hash(split: Split) -> str:
    """Return the identity of a split: its rows, in their order."""
    return _hash([len(split.training)], split.training, split.held_out)


def _hash(*columns: ArrayLike) -> str:
    digest = hashlib.sha256()
    for column in columns:
        digest.update(np.ascontiguousarray(column).tobytes())
    return digest.hexdigest()[:16]
