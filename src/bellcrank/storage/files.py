"""Folders for new results, and the files that killed writers leave."""

from __future__ import annotations

import contextlib
import itertools
import re
from typing import TYPE_CHECKING

from bellcrank.errors import OutputExists
from bellcrank.model.storage import storage_error, sync_folder

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

TEMPORARY = re.compile(r"\.(.+)\.[0-9a-f]{8}")
"""Names of incomplete files, as `bellcrank.model.storage` makes them."""


def make_folder(folder: Path) -> None:
    """Make a folder and its parents if they do not exist.

    Raises
    ------
    StorageError
    """
    if folder.is_dir():
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise storage_error(folder, error) from error
    sync_folder(folder.parent)


def require_new_folder(folder: Path, ours: Callable[[str], bool] = lambda _name: False) -> None:
    """Check that a folder can take new results: it does not exist, or it is empty.

    Nothing is created. Incomplete files of a killed process do not count.

    Parameters
    ----------
    folder
        Folder to check.
    ours
        Whether a file of the given name is acceptable.

    Raises
    ------
    OutputExists
        If it is a file or holds anything else.
    StorageError
        If it cannot be read.
    """
    try:
        is_folder = folder.is_dir()
        is_file = folder.exists() and not is_folder
        names = sorted(path.name for path in folder.iterdir()) if is_folder else []
    except OSError as error:
        raise storage_error(folder, error) from error
    if is_file:
        raise OutputExists(f"{folder}: is a file; choose another folder (--out)")
    if others := [name for name in names if not ours(name) and not target_of(name)]:
        raise OutputExists(
            f"{folder}: exists already and is not empty (it holds {others[0]}); choose another "
            f"folder (--out)"
        )


def unused_folder(folder: Path) -> Path:
    """Return the first of `folder`, ``folder-2``, ``folder-3``, ... that can take new results.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as place:
    ...     (Path(place) / "crane" / "results").mkdir(parents=True)
    ...     unused_folder(Path(place) / "crane").name
    'crane-2'
    """
    for number in itertools.count(1):
        candidate = folder if number == 1 else folder.with_name(f"{folder.name}-{number}")
        try:
            require_new_folder(candidate)
        except OutputExists:
            continue
        return candidate
    raise AssertionError


def target_of(name: str) -> str | None:
    """Return the final name of an incomplete file; None for any other file.

    Examples
    --------
    >>> target_of(".run.json.5ad0c2e7"), target_of("run.json"), target_of(".hidden")
    ('run.json', None, None)
    """
    match = TEMPORARY.fullmatch(name)
    return match and match[1]


def remove_temporaries(folder: Path, ours: re.Pattern[str]) -> None:
    """Remove the incomplete files of killed writers whose final names match `ours`.

    Raises
    ------
    StorageError
    """
    try:
        for path in folder.iterdir() if folder.is_dir() else ():
            if (target := target_of(path.name)) and ours.fullmatch(target):
                path.unlink(missing_ok=True)
    except OSError as error:
        raise storage_error(folder, error) from error


def remove_files(folder: Path, ours: re.Pattern[str]) -> None:
    """Remove the files whose names match `ours`, complete or not, and the folder if empty then.

    Raises
    ------
    StorageError
    """
    try:
        for path in list(folder.iterdir()) if folder.is_dir() else ():
            if ours.fullmatch(path.name) or ours.fullmatch(target_of(path.name) or ""):
                path.unlink(missing_ok=True)
    except OSError as error:
        raise storage_error(folder, error) from error
    with contextlib.suppress(OSError):
        folder.rmdir()
