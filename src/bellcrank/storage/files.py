"""Files that appear whole or not at all, and the names of those still being written."""

from __future__ import annotations

import contextlib
import errno
import os
import re
from typing import IO, TYPE_CHECKING

from bellcrank.errors import BellcrankError, OutputExists, StorageError
from bellcrank.model.storage import open_temporary, sync_folder, take_name

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

FULL = (errno.ENOSPC, errno.EDQUOT)
TEMPORARY = re.compile(r"\.(.+)\.[0-9a-f]{8}")
"""Names of files on their way, as `bellcrank.model.storage` makes them."""


@contextlib.contextmanager
def whole_file(target: Path) -> Iterator[IO[bytes]]:
    """Yield a file to write into that takes the name `target` once it is safe on disk.

    It never replaces anything: of two writers of the same name the first wins. Whatever
    goes wrong, nothing stays behind, short of a kill (see `remove_temporaries`).

    Raises
    ------
    OutputExists
        If the name is taken.
    StorageError
        If the folder cannot be written or the disk is full.
    """
    try:
        temporary, file = open_temporary(target)
        try:
            with file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            take_name(temporary, target, overwrite=False)
        finally:
            with contextlib.suppress(OSError):
                temporary.unlink()
        sync_folder(target.parent)
    except BellcrankError:
        raise
    except FileExistsError:
        raise OutputExists(
            f"{target}: exists already; is another process at work on this run?"
        ) from None
    except OSError as error:
        raise storage_error(target.parent, error) from error


def storage_error(folder: Path, error: OSError) -> StorageError:
    """Say that a folder could not be written, why, and what to do."""
    if error.errno in FULL:
        what_to_do = "make room and resume: what was stored before is intact"
    else:
        what_to_do = "make it writable, or choose another folder"
    return StorageError(f"{folder}: cannot be written ({error.strerror or error}); {what_to_do}")


def make_folder(folder: Path) -> None:
    """Make a folder and those above it, if they are not there.

    Raises
    ------
    StorageError
        If that is impossible.
    """
    if folder.is_dir():
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise storage_error(folder, error) from error
    sync_folder(folder.parent)


def target_of(name: str) -> str | None:
    """Return the name that a file was on its way to take when it was left, if it was.

    Examples
    --------
    >>> target_of(".run.json.5ad0c2e7"), target_of("run.json"), target_of(".hidden")
    ('run.json', None, None)
    """
    match = TEMPORARY.fullmatch(name)
    return match and match[1]


def remove_temporaries(folder: Path, ours: re.Pattern[str]) -> None:
    """Remove what killed writers left of files whose names match `ours`.

    Raises
    ------
    StorageError
        If they cannot be removed.
    """
    try:
        for path in folder.iterdir() if folder.is_dir() else ():
            if (target := target_of(path.name)) and ours.fullmatch(target):
                path.unlink(missing_ok=True)
    except OSError as error:
        raise storage_error(folder, error) from error
