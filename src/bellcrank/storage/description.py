"""The description of a run, ``run.json``: what was asked for, and how far it is."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.errors import CorruptRun, InvalidFile, InvalidSettings
from bellcrank.model import problem_to_dict
from bellcrank.model.storage import read_text, write_text
from bellcrank.storage.layout import DESCRIPTION

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from bellcrank.model import Problem

RUN_SCHEMA = "bellcrank/run/1"
STATUSES = ("running", "stopped", "finished")


@dataclass(frozen=True, slots=True)
class Description:
    """What ``run.json`` says.

    Parameters
    ----------
    problem
        Schema ``bellcrank/problem/1``.
    settings
        Of the search, as plain data.
    provenance
        Of the start of the run.
    status
        One of ``running``, ``stopped``, ``finished``.
    """

    problem: dict[str, Any]
    settings: dict[str, Any]
    provenance: dict[str, Any]
    status: str = "running"

    @property
    def spec(self) -> str:
        """Identity of what was asked for; every shard carries it."""
        return spec_hash(self.problem, self.settings)

    @property
    def mask_bytes(self) -> int:
        """Bytes of a packed mask over the problem's beams."""
        return (len(self.problem["beams"]) + 7) // 8


def spec_hash(problem: Mapping[str, Any], settings: Mapping[str, Any]) -> str:
    """Hash of problem and settings: SHA-256 of their canonical JSON.

    Examples
    --------
    >>> spec_hash({"a": 1, "b": 2}, {}) == spec_hash({"b": 2, "a": 1}, {})
    True
    """
    text = json.dumps(
        {"problem": problem, "settings": settings}, sort_keys=True, separators=(",", ":")
    )
    return hashlib.sha256(text.encode()).hexdigest()


def plain(what: str, data: Mapping[str, Any]) -> dict[str, Any]:
    """Return data as it will come back from JSON (lists for tuples).

    Raises
    ------
    InvalidSettings
        If JSON cannot hold it exactly.
    """
    try:
        copied: dict[str, Any] = json.loads(json.dumps(dict(data), allow_nan=False))
    except (TypeError, ValueError) as error:
        raise InvalidSettings(f"{what}: expected plain data that JSON can hold: {error}") from None
    return copied


def describe(
    problem: Problem, settings: Mapping[str, Any], provenance: Mapping[str, Any]
) -> Description:
    """Describe a new run."""
    return Description(
        plain("problem", problem_to_dict(problem)),
        plain("settings", settings),
        plain("provenance", provenance),
    )


def first_difference(old: Mapping[str, Any], new: Mapping[str, Any]) -> str | None:
    """Say where two settings differ, or None.

    Examples
    --------
    >>> first_difference({"steps": 10}, {"steps": 20})
    'steps is 10 there and 20 here'
    """
    for key in sorted({*old, *new}):
        there, here = old.get(key, "absent"), new.get(key, "absent")
        if there != here:
            return f"{key} is {_short(there)} there and {_short(here)} here"
    return None


def _short(value: object) -> str:
    text = str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def require_same(
    folder: Path,
    description: Description,
    problem: Problem | None,
    settings: Mapping[str, Any] | None,
) -> None:
    """Check problem and settings, where given, against those of a run.

    Raises
    ------
    InvalidSettings
        Naming the first difference.
    """
    told = []
    if problem is not None:
        told.append(("problem", description.problem, problem_to_dict(problem)))
    if settings is not None:
        told.append(("settings", description.settings, dict(settings)))
    for what, old, new in told:
        if difference := first_difference(old, plain(what, new)):
            raise InvalidSettings(
                f"{folder}: the run began with other {what}: {difference}; go on with those "
                f"it has, or start another run in another folder"
            )


def write_description(folder: Path, description: Description) -> None:
    """Write ``run.json``, replacing the one that is there in one step.

    Raises
    ------
    StorageError
    """
    data = {
        "schema": RUN_SCHEMA,
        "status": description.status,
        "spec": description.spec,
        "provenance": description.provenance,
        "settings": description.settings,
        "problem": description.problem,
    }
    write_text(folder / DESCRIPTION, json.dumps(data, indent=1) + "\n", overwrite=True)


def read_description(folder: Path) -> Description:
    """Read ``run.json``.

    Raises
    ------
    InvalidFile
        If the folder does not exist or is not that of a run.
    CorruptRun
        If the file is damaged, or was changed after the run had begun.
    """
    path = folder / DESCRIPTION
    try:
        present, described = folder.is_dir(), path.exists()
    except OSError as error:
        raise InvalidFile(f"{folder}: cannot be read ({error.strerror})") from None
    if not present:
        raise InvalidFile(f"{folder}: no such folder; expected the folder of a run")
    if not described:
        raise InvalidFile(
            f"{folder}: not the folder of a run: it has no {DESCRIPTION}; nothing to go on from"
        )
    try:
        data = json.loads(read_text(path))
    except ValueError as error:
        if isinstance(error, InvalidFile):
            raise
        raise CorruptRun(f"{path}: not valid JSON ({error}); restore it from a copy") from None
    schema = data.get("schema") if isinstance(data, dict) else None
    if schema != RUN_SCHEMA:
        raise InvalidFile(f"{path}: expected schema {RUN_SCHEMA!r}, got {schema!r}")
    for key in ("problem", "settings", "provenance"):
        if not isinstance(data.get(key), dict):
            raise CorruptRun(f"{path}: {key}: expected a table, got {data.get(key)!r}")
    if not isinstance(data["problem"].get("beams"), list):
        raise CorruptRun(f"{path}: problem: it has no list of beams")
    if data.get("status") not in STATUSES:
        raise CorruptRun(
            f"{path}: status: expected one of {', '.join(STATUSES)}, got {data.get('status')!r}"
        )
    description = Description(data["problem"], data["settings"], data["provenance"], data["status"])
    if description.spec != data.get("spec"):
        raise CorruptRun(
            f"{path}: problem or settings were changed after the run had begun; undo that, "
            f"or start another run in another folder"
        )
    return description
