"""An entry as a file: JSON of the schema ``bellcrank/entry/1``, one line of it.

::

    {"schema": "bellcrank/entry/1", "name": "down-9-free-3fa2c1b0", "direction": "down",
     "columns": 9, "kind": "free", "design": {...}, "characterisation": {...},
     "validation": {"level": "frame", "efficiency": 5.1, ...},
     "lever": {"efficiency": 3.8, "better": true, ...}, "provenance": {...}, "checksum": "..."}

``design`` is as in a design file, ``characterisation`` as `bellcrank characterise` keeps it. The
hash in the name is that of problem, beams and kind; ``checksum`` is that of all other keys. Both
are compared when a file is read, so that a figure that is read is the figure that was measured.
"""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from bellcrank.errors import BellcrankError, InvalidFile
from bellcrank.machines.library.entry import (
    Entry,
    FrameCheck,
    LeverCheck,
    canonical,
    check_direction,
    check_kind,
)
from bellcrank.machines.record import characterisation_from_dict, characterisation_to_dict
from bellcrank.model import design_from_dict, design_to_dict
from bellcrank.model.parsing import Table, parse, read_json
from bellcrank.model.storage import write_text

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

SCHEMA = "bellcrank/entry/1"


class FrameTable(Table):
    """``validation``; null for what is no number."""

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


class LeverTable(Table):
    """``lever``; null where no lever is stable."""

    efficiency: float | None
    unbound_efficiency: float | None
    shape: str
    mask: str
    better: bool


class EntryTable(Table):
    """A whole file."""

    schema_: Literal["bellcrank/entry/1"] = Field(alias="schema")
    name: str
    direction: str
    columns: int | None
    kind: str
    design: dict[str, Any]
    characterisation: dict[str, Any]
    validation: FrameTable
    lever: LeverTable
    provenance: dict[str, Any]
    checksum: str


def entry_to_dict(entry: Entry) -> dict[str, Any]:
    """Return an entry as plain data, ready for JSON."""
    check, lever = entry.validation, entry.lever
    measured = {
        name: getattr(check, name)
        for name in FrameTable.model_fields
        if name not in ("level", "warnings")
    }
    data: dict[str, Any] = {
        "schema": SCHEMA,
        "name": entry.name,
        "direction": entry.direction,
        "columns": entry.columns,
        "kind": entry.kind,
        "design": design_to_dict(entry.design),
        "characterisation": characterisation_to_dict(entry.characterisation),
        "validation": {
            "level": "frame",
            **measured,
            "efficiency": _finite(check.efficiency),
            "linear_efficiency": _finite(check.linear_efficiency),
            "warnings": list(check.warnings),
        },
        "lever": {
            "efficiency": _finite(lever.efficiency),
            "unbound_efficiency": _finite(lever.unbound_efficiency),
            "shape": lever.shape,
            "mask": lever.mask,
            "better": entry.better,
        },
        "provenance": dict(entry.provenance),
    }
    return {**data, "checksum": checksum(data)}


def entry_from_dict(data: Mapping[str, Any], source: str) -> Entry:
    """Read plain data back.

    Parameters
    ----------
    data
        As `entry_to_dict` makes it.
    source
        What to call it in an error, usually the file.

    Raises
    ------
    InvalidFile
        If it is no entry, or has been changed since it was written.
    InvalidProblem
        If the problem in it is impossible.
    """
    table = checked_table(data, source)
    design = design_from_dict(table.design, f"{source}: design")
    check, lever = table.validation, table.lever
    entry = Entry(
        design=design,
        direction=table.direction,
        columns=table.columns,
        kind=table.kind,
        characterisation=characterisation_from_dict(
            table.characterisation, f"{source}: characterisation"
        ),
        validation=FrameCheck(
            **{
                **check.model_dump(exclude={"level"}),
                "efficiency": _number(check.efficiency),
                "linear_efficiency": _number(check.linear_efficiency),
                "warnings": tuple(check.warnings),
            }
        ),
        lever=LeverCheck(
            _number(lever.efficiency), _number(lever.unbound_efficiency), lever.shape, lever.mask
        ),
        provenance=dict(table.provenance),
    )
    if entry.name != table.name:
        raise InvalidFile(
            f"{source}: name: expected {entry.name!r}, which its problem, beams and kind make, got "
            f"{table.name!r}; {CHANGED}"
        )
    found = entry.characterisation
    if (found.problem_hash, found.mask) != (design.problem.hash, design.mask_hex):
        raise InvalidFile(f"{source}: characterisation: is that of another design; {CHANGED}")
    return entry


CHANGED = "the file was changed or damaged: make the entry anew (bellcrank library add DESIGN)"


def checked_table(data: Mapping[str, Any], source: str) -> EntryTable:
    """Read the tables of an entry, but not yet what its design and two-port say.

    Raises
    ------
    InvalidFile
    """
    table = parse(EntryTable, data, source)
    if checksum({key: value for key, value in data.items() if key != "checksum"}) != table.checksum:
        raise InvalidFile(f"{source}: checksum: does not fit the content; {CHANGED}")
    try:
        check_direction(table.direction)
        check_kind(table.kind)
    except BellcrankError as error:
        raise InvalidFile(f"{source}: {error}") from None
    return table


def checksum(data: Mapping[str, Any]) -> str:
    """Return the SHA-256 of plain data, shortened to 16 digits."""
    return hashlib.sha256(canonical(data).encode()).hexdigest()[:16]


def read_entry(path: str | os.PathLike[str]) -> Entry:
    """Read an entry.

    Raises
    ------
    InvalidFile, InvalidProblem
        As `entry_from_dict`, and if the file is not called like the entry in it.
    """
    entry = entry_from_dict(read_json(path), str(path))
    if Path(path).stem != entry.name:
        raise InvalidFile(f"{path}: holds the entry {entry.name}, and must be called like it")
    return entry


def write_entry(entry: Entry, folder: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Write an entry into a folder, under its name; whole or not at all.

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    OutputExists, StorageError
    """
    path = Path(folder) / f"{entry.name}.json"
    text = json.dumps(entry_to_dict(entry), separators=(",", ":"), allow_nan=False)
    write_text(path, text + "\n", overwrite=overwrite)
    return path


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _number(value: float | None) -> float:
    return math.nan if value is None else value
