"""The description of a run or campaign: a JSON file with what identifies it."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.errors import CorruptRun, InvalidFile, InvalidSettings
from bellcrank.model.storage import read_text, write_text

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path


@dataclass(frozen=True, slots=True)
class Description:
    """Content of a description file.

    Parameters
    ----------
    content
        Plain data that identifies the run or campaign; it never changes.
    provenance
        Versions, machine and time of its start.
    status
        State of the work, if the file keeps it.
    """

    content: dict[str, Any]
    provenance: dict[str, Any]
    status: str | None = None

    @property
    def hash(self) -> str:
        """Hash of the content; every file of the store carries it."""
        return content_hash(self.content)


def content_hash(content: Mapping[str, Any]) -> str:
    """Return the SHA-256 of the canonical JSON of plain data.

    Examples
    --------
    >>> content_hash({"a": 1, "b": 2}) == content_hash({"b": 2, "a": 1})
    True
    """
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def plain(what: str, data: Mapping[str, Any]) -> dict[str, Any]:
    """Return data as JSON restores it (lists in place of tuples).

    Raises
    ------
    InvalidSettings
        If JSON cannot represent it exactly.
    """
    try:
        copied: dict[str, Any] = json.loads(json.dumps(dict(data), allow_nan=False))
    except (TypeError, ValueError) as error:
        raise InvalidSettings(f"{what}: expected data that JSON can represent: {error}") from None
    return copied


def first_difference(old: Mapping[str, Any], new: Mapping[str, Any]) -> str | None:
    """Return the first key at which two tables differ, with both values, or None.

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


def write_description(
    path: Path, schema: str, description: Description, *, overwrite: bool = False
) -> None:
    """Write a description file in one step.

    Raises
    ------
    OutputExists
        If the file exists and `overwrite` is not set.
    StorageError
    """
    status = {} if description.status is None else {"status": description.status}
    data = {
        "schema": schema,
        **status,
        "hash": description.hash,
        "provenance": description.provenance,
        **description.content,
    }
    write_text(path, json.dumps(data, indent=1) + "\n", overwrite=overwrite)


def read_description(path: Path, schema: str, what: str, keys: Sequence[str]) -> Description:
    """Read a description file.

    Parameters
    ----------
    path
        Path of the file.
    schema
        Schema that it must have.
    what
        What it describes, such as ``run``.
    keys
        Keys of its content.

    Raises
    ------
    InvalidFile
        If the folder or the file does not exist, or has another schema.
    CorruptRun
        If the file is damaged, or its content was changed.
    """
    folder = path.parent
    try:
        present, described = folder.is_dir(), path.exists()
    except OSError as error:
        raise InvalidFile(f"{folder}: cannot be read ({error.strerror})") from None
    if not present:
        raise InvalidFile(f"{folder}: no such folder; expected the folder of a {what}")
    if not described:
        raise InvalidFile(f"{folder}: not the folder of a {what}: it has no {path.name}")
    text = read_text(path)
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise CorruptRun(f"{path}: not valid JSON ({error}); restore it from a copy") from None
    found = data.get("schema") if isinstance(data, dict) else None
    if found != schema:
        raise InvalidFile(f"{path}: expected schema {schema!r}, got {found!r}")
    for key in ("provenance", *keys):
        if key not in data:
            raise CorruptRun(f"{path}: key {key!r} is missing; restore the file from a copy")
    content = {key: data[key] for key in keys}
    if content_hash(content) != data.get("hash") or not isinstance(data["provenance"], dict):
        raise CorruptRun(
            f"{path}: was changed after the {what} had started; undo the change, or start another "
            f"{what} in another folder"
        )
    return Description(content, data["provenance"], data.get("status"))
