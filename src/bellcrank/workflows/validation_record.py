"""The record of the analyses of a design, in a file beside it."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidFile
from bellcrank.model.parsing import read_json
from bellcrank.model.storage import write_text
from bellcrank.storage.locking import locked
from bellcrank.workflows.validation import SCHEMA

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.workflows.validation import Validation

KEY = ("level", "theory", "linear", "settings", "part")
"""Entries in which two analyses of a design that are the same agree."""


def read_record(path: Path, problem: str, mask: str) -> list[dict[str, Any]]:
    """Return the analyses in a record; an empty list if the file does not exist.

    Parameters
    ----------
    path
        File of the record.
    problem, mask
        Identity of the design (`problem_identity`) and its mask in hexadecimal.

    Raises
    ------
    InvalidFile
        If the file is not a valid record, or the record of another design.
    """
    if not os.path.lexists(path):
        return []
    data = read_json(path)
    results = data.get("results")
    complete = isinstance(results, list) and all(
        isinstance(entry, dict) and all(key in entry for key in KEY) for entry in results
    )
    if data.get("schema") != SCHEMA or not complete:
        raise InvalidFile(
            f"{path}: expected a record of {SCHEMA}, to which an analysis can be added; remove it, "
            "or name another file with --record"
        )
    if (data.get("problem_hash"), data.get("mask")) != (problem, mask):
        raise InvalidFile(
            f"{path}: record of another design or of a changed problem; remove it, or name "
            "another file with --record"
        )
    assert isinstance(results, list)
    return results


def add_to_record(validation: Validation, path: Path) -> None:
    """Add a validation to the record of its design; repeated analyses replace earlier ones.

    Raises
    ------
    InvalidFile
        If the file is not a record of this design.
    StorageError
        If the file cannot be written.
    """
    data = validation.to_dict()
    with locked(path.with_name(f".{path.name}.lock")):
        old = read_record(path, data["problem_hash"], data["mask"])
        new = [_key(entry) for entry in data["results"]]
        others = [entry for entry in old if _key(entry) not in new]
        record = {key: data[key] for key in ("schema", "problem", "problem_hash", "mask")}
        if "specification" in data:
            record["specification"] = data["specification"]
        record |= {"results": [*others, *data["results"]], "provenance": data["provenance"]}
        write_text(path, json.dumps(record, indent=1) + "\n", overwrite=True)


def replace_record(validation: Validation, path: Path) -> None:
    """Add a validation to the record of its design, and remove a record of another design.

    Raises
    ------
    StorageError
        If the file cannot be written.
    """
    data = validation.to_dict()
    try:
        read_record(path, data["problem_hash"], data["mask"])
    except InvalidFile:
        path.unlink()
    add_to_record(validation, path)


def _key(entry: dict[str, Any]) -> str:
    """Return the identity of an analysis."""
    return json.dumps([entry[key] for key in KEY], sort_keys=True)
