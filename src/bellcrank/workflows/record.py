"""The record of a design's validations: a file beside it, to which each analysis adds itself."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidFile
from bellcrank.model.parsing import read_json
from bellcrank.model.storage import write_text
from bellcrank.storage.locking import locked

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.workflows.validate import Validation

SCHEMA = "bellcrank/validation/1"
KEY = ("level", "theory", "linear", "settings", "part")
"""What makes two analyses of a design the same."""


def check_record(path: Path, problem: str, mask: str) -> list[dict[str, Any]]:
    """Return the analyses that a record holds already; none if there is no such file.

    Parameters
    ----------
    problem, mask
        The identity of the design that it must be of.

    Raises
    ------
    InvalidFile
        If it is no record, a damaged one, or that of another design.
    """
    if not os.path.lexists(path):
        return []
    old = read_json(path)
    results = old.get("results")
    whole = isinstance(results, list) and all(
        isinstance(entry, dict) and all(key in entry for key in KEY) for entry in results
    )
    if old.get("schema") != SCHEMA or not whole:
        raise InvalidFile(
            f"{path}: expected a record of {SCHEMA}, to which an analysis can be added; remove it, "
            "or name another file with --record"
        )
    if (old.get("problem_hash"), old.get("mask")) != (problem, mask):
        raise InvalidFile(
            f"{path}: is the record of another design or of a changed problem; remove it, or name "
            "another file with --record"
        )
    assert isinstance(results, list)
    return results


def keep_record(validation: Validation, path: Path) -> None:
    """Add a validation to the record of its design; the same analyses are renewed.

    Raises
    ------
    InvalidFile
        If there is something else of that name.
    StorageError
        If it cannot be written.
    """
    data = validation.to_dict()
    with locked(path.with_name(f".{path.name}.lock")):
        old = check_record(path, data["problem_hash"], data["mask"])
        renewed = [_key(entry) for entry in data["results"]]
        kept = [entry for entry in old if _key(entry) not in renewed]
        record = {key: data[key] for key in ("schema", "problem", "problem_hash", "mask")}
        record |= {"results": [*kept, *data["results"]], "provenance": data["provenance"]}
        write_text(path, json.dumps(record, indent=1) + "\n", overwrite=True)


def begin_record(validation: Validation, path: Path) -> None:
    """Keep a validation of the design that a folder holds now; a record of another one goes.

    Raises
    ------
    StorageError
        If it cannot be written.
    """
    data = validation.to_dict()
    try:
        check_record(path, data["problem_hash"], data["mask"])
    except InvalidFile:
        path.unlink()
    keep_record(validation, path)


def _key(entry: dict[str, Any]) -> str:
    """Return what makes two analyses the same."""
    return json.dumps([entry[key] for key in KEY], sort_keys=True)
