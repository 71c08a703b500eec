"""Locks that keep other processes out of a folder, and that end with whoever holds them."""

from __future__ import annotations

import contextlib
import os
from typing import TYPE_CHECKING

from bellcrank.errors import StorageError
from bellcrank.storage.files import storage_error

if TYPE_CHECKING:
    from collections.abc import Iterator
    from io import FileIO
    from pathlib import Path


@contextlib.contextmanager
def locked(path: Path, busy: str | None = None) -> Iterator[None]:
    """Hold a lock file, which no other process can hold at the same time.

    However the process ends, its lock ends with it. Where the system has no such locks, or the
    file system does not keep them, nobody is kept out.

    Parameters
    ----------
    path
        Of the file; made, and removed in the end. What a kill leaves of it locks nobody out.
    busy
        What to say if it is held; by default that is waited for.

    Raises
    ------
    StorageError
        If it is held and `busy` says so, or the folder cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     with locked(Path(folder) / ".lock"):
    ...         try:
    ...             with locked(Path(folder) / ".lock", "somebody is at work here"):
    ...                 pass
    ...         except StorageError as error:
    ...             print(error)
    somebody is at work here
    """
    try:
        import fcntl
    except ImportError:
        yield
        return
    wait = fcntl.LOCK_EX if busy is None else fcntl.LOCK_EX | fcntl.LOCK_NB
    while True:
        with _opened(path) as file:
            try:
                fcntl.flock(file, wait)
            except BlockingIOError:
                raise StorageError(busy) from None
            except OSError:
                pass  # the file system keeps no locks
            if not _is_there(path, file):
                continue  # whoever held it has removed it meanwhile
            try:
                yield
            finally:
                with contextlib.suppress(OSError):
                    path.unlink()
            return


def _opened(path: Path) -> FileIO:
    try:
        return path.open("wb", buffering=0)
    except OSError as error:
        raise storage_error(path.parent, error) from error


def _is_there(path: Path, file: FileIO) -> bool:
    """Whether an open file is still the one of that name."""
    try:
        return os.path.samestat(path.stat(), os.fstat(file.fileno()))
    except FileNotFoundError:
        return False
