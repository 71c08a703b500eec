"""Files of entries: JSON with the schema ``bellcrank/entry/2``, on one line.

::

    {"schema": "bellcrank/entry/2", "name": "down-9-straight-50g-1df984a7", "direction": "down",
     "columns": 9, "kind": "straight-50g", "design": {...}, "characterisation": {...},
     "validation": {"level": "frame", "efficiency": 5.1, ...}, "provenance": {...},
     "figures": {"off_axis": 0.04, ...}, "checksum": "..."}

``design`` has the form of a design file, ``characterisation`` that of a file of `bellcrank
characterise`. The name ends with a hash of problem, beams and kind; ``checksum`` is a hash of all
other keys. Both are verified when a file is read. An entry of frames also has ``figures``, those
of the part (`bellcrank.machines.library.entry.FIGURES`).
"""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from bellcrank.errors import BellcrankError, InvalidFile
from bellcrank.machines.characterisation_files import (
    characterisation_from_dict,
    characterisation_to_dict,
)
from bellcrank.machines.library.entry import (
    Entry,
    FrameResult,
    canonical,
    check_direction,
    check_kind,
)
from bellcrank.model import design_from_dict, design_to_dict
from bellcrank.model.parsing import Table, parse, read_json
from bellcrank.model.storage import write_text

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

SCHEMA = "bellcrank/entry/2"
CHANGED = "the file was changed or is damaged; write the entry again (bellcrank library add DESIGN)"


class FrameTable(Table):
    """``validation``; null for an efficiency that does not exist."""

    level: Literal["frame"]
    status: str
    reached: float
    efficiency: float | None
    linear_efficiency: float | None
    stress: float
    strain: float
    force: float
    theory: str
    material: str
    width: float
    thickness: float
    scale: float
    warnings: list[str]


class EntryTable(Table):
    """A file."""

    schema_: Literal["bellcrank/entry/2"] = Field(alias="schema")
    name: str
    direction: str
    columns: int | None
    kind: str
    design: dict[str, Any]
    characterisation: dict[str, Any]
    validation: FrameTable
    provenance: dict[str, Any]
    figures: dict[str, float | None] = Field(default_factory=dict)
    checksum: str


def entry_to_dict(entry: Entry) -> dict[str, Any]:
    """Return an entry as plain data for JSON."""
    data: dict[str, Any] = {
        "schema": SCHEMA,
        "name": entry.name,
        "direction": entry.direction,
        "columns": entry.columns,
        "kind": entry.kind,
        "design": design_to_dict(entry.design),
        "characterisation": characterisation_to_dict(entry.characterisation),
        "validation": {"level": "frame", **_nan_to_null(asdict(entry.validation))},
        "provenance": dict(entry.provenance),
    }
    data["validation"]["warnings"] = list(entry.validation.warnings)
    if entry.figures:
        data["figures"] = dict(entry.figures)
    return {**data, "checksum": checksum(data)}


def entry_from_dict(data: Mapping[str, Any], source: str) -> Entry:
    """Return the entry of plain data.

    Parameters
    ----------
    data
        Data in the form of `entry_to_dict`.
    source
        Name in error messages, usually the file.

    Raises
    ------
    InvalidFile
        If the data are not an entry, or were changed.
    InvalidProblem
        If its problem is invalid.
    """
    table = checked_table(data, source)
    design = design_from_dict(table.design, f"{source}: design")
    check = _null_to_nan(table.validation.model_dump(exclude={"level"}))
    entry = Entry(
        design=design,
        direction=table.direction,
        columns=table.columns,
        kind=table.kind,
        characterisation=characterisation_from_dict(
            table.characterisation, f"{source}: characterisation"
        ),
        validation=FrameResult(**{**check, "warnings": tuple(table.validation.warnings)}),
        provenance=dict(table.provenance),
        figures=dict(table.figures),
    )
    if entry.name != table.name:
        raise InvalidFile(
            f"{source}: name: expected {entry.name!r} from its problem, beams and kind, got "
            f"{table.name!r}; {CHANGED}"
        )
    found = entry.characterisation
    if (found.problem_hash, found.mask) != (design.problem.hash, design.mask_hex):
        raise InvalidFile(f"{source}: characterisation: belongs to another design; {CHANGED}")
    return entry


def checked_table(data: Mapping[str, Any], source: str) -> EntryTable:
    """Return the table of an entry, after verification of its checksum.

    The keys ``design`` and ``characterisation`` are not parsed.

    Raises
    ------
    InvalidFile
    """
    table = parse(EntryTable, data, source)
    if checksum({key: value for key, value in data.items() if key != "checksum"}) != table.checksum:
        raise InvalidFile(f"{source}: checksum: does not match the content; {CHANGED}")
    try:
        check_direction(table.direction)
        check_kind(table.kind)
    except BellcrankError as error:
        raise InvalidFile(f"{source}: {error}") from None
    return table


def checksum(data: Mapping[str, Any]) -> str:
    """Return the first 16 hexadecimal digits of the SHA-256 hash of plain data."""
    return hashlib.sha256(canonical(data).encode()).hexdigest()[:16]


def check_file_name(path: str | os.PathLike[str], name: str) -> None:
    """Check that a file has the name of its entry.

    Raises
    ------
    InvalidFile
    """
    if Path(path).stem != name:
        raise InvalidFile(f"{path}: expected the file name {name}.json, the name of its entry")


def read_entry(path: str | os.PathLike[str]) -> Entry:
    """Read an entry.

    Raises
    ------
    InvalidFile, InvalidProblem
        As `entry_from_dict`, and if the file does not have the name of its entry.
    """
    entry = entry_from_dict(read_json(path), str(path))
    check_file_name(path, entry.name)
    return entry


def write_entry(entry: Entry, folder: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Write an entry into a folder under its name, atomically.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OutputExists, StorageError
    """
    path = Path(folder) / f"{entry.name}.json"
    text = json.dumps(entry_to_dict(entry), separators=(",", ":"), allow_nan=False)
    write_text(path, text + "\n", overwrite=overwrite)
    return path


def _nan_to_null(values: dict[str, Any]) -> dict[str, Any]:
    """Replace nan by None in the efficiencies."""
    return {
        key: None if key.endswith("efficiency") and not math.isfinite(value) else value
        for key, value in values.items()
    }


def _null_to_nan(values: dict[str, Any]) -> dict[str, Any]:
    return {
        key: math.nan if key.endswith("efficiency") and value is None else value
        for key, value in values.items()
    }
