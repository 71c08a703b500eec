"""Lock files, which one process holds at a time and which end with that process."""

from __future__ import annotations

import contextlib
import os
from typing import TYPE_CHECKING

from bellcrank.errors import StorageError
from bellcrank.model.storage import storage_error

if TYPE_CHECKING:
    from collections.abc import Iterator
    from io import FileIO
    from pathlib import Path

LOCK = ".lock"
"""Name of the lock file of a folder with results."""


@contextlib.contextmanager
def locked(path: Path, *, wait: bool = True, option: str = "--out") -> Iterator[None]:
    """Hold a lock file, which no other process can hold at the same time.

    The lock ends with the process, however that ends. It has no effect where the operating
    system or the file system does not support locks.

    Parameters
    ----------
    path
        Path of the lock file; it is created, and removed at the end. A file that a killed process
        left does not block.
    wait
        Whether to wait while another process holds the lock.
    option
        Option of the command that chooses the folder, for the message.

    Raises
    ------
    StorageError
        If another process holds the lock and `wait` is False, or the folder cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     with locked(Path(folder) / LOCK):
    ...         print(lock_holder(Path(folder) / LOCK) == f"process {os.getpid()}")
    ...     print(lock_holder(Path(folder) / LOCK))
    True
    None
    """
    try:
        import fcntl
    except ImportError:
        yield
        return
    while True:
        with _opened(path) as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise busy(path.parent, _holder(file), option) from None
            except OSError:
                pass  # the file system does not support locks
            if not _is_current(path, file):
                continue  # the previous holder has removed it meanwhile
            with contextlib.suppress(OSError):
                file.truncate(0)
                file.write(str(os.getpid()).encode())
            try:
                yield
            finally:
                with contextlib.suppress(OSError):
                    path.unlink()
            return


def lock_holder(path: Path) -> str | None:
    """Return the process that holds a lock file, such as ``process 4711``; None if none does."""
    try:
        import fcntl

        with path.open("rb", buffering=0) as file:
            try:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                return _holder(file)
    except (ImportError, OSError):
        pass
    return None


def busy(folder: Path, holder: str, option: str = "--out") -> StorageError:
    """Return the error for a folder in which another process is working."""
    return StorageError(
        f"{folder}: {holder} is working in this folder; wait until it ends, or choose another "
        f"folder ({option})"
    )


def _holder(file: FileIO) -> str:
    """Return the process that has written its number into a lock file."""
    file.seek(0)
    number = (file.read(20) or b"").decode(errors="replace").strip()
    return f"process {number}" if number.isdigit() else "another process"


def _opened(path: Path) -> FileIO:
    try:
        return path.open("ab+", buffering=0)
    except OSError as error:
        raise storage_error(path.parent, error) from error


def _is_current(path: Path, file: FileIO) -> bool:
    """Whether an open file is still the one of that name."""
    try:
        return os.path.samestat(path.stat(), os.fstat(file.fileno()))
    except FileNotFoundError:
        return False
