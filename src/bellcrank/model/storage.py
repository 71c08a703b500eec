"""Reading and writing of files, which appear completely or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from bellcrank.errors import BellcrankError, InvalidFile, OutputExists, StorageError

if TYPE_CHECKING:
    from collections.abc import Iterator

FULL = (errno.ENOSPC, errno.EDQUOT)

MAX_BYTES = 256_000_000
"""Largest text file that is read: several times a problem with the largest lattice."""


def read_text(path: str | os.PathLike[str]) -> str:
    """Read a text file.

    Raises
    ------
    InvalidFile
        If there is no such file, it cannot be read, is larger than `MAX_BYTES`, or is not UTF-8
        text.
    """
    try:
        size = Path(path).stat().st_size
        if size > MAX_BYTES:
            raise InvalidFile(
                f"{path}: {size / 1e6:,.0f} MB are too large for a text file; expected at most "
                f"{MAX_BYTES / 1e6:,.0f} MB"
            )
        return Path(path).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InvalidFile(f"{path}: no such file") from None
    except UnicodeDecodeError as error:
        raise InvalidFile(
            f"{path}: expected UTF-8 text, got byte 0x{error.object[error.start]:02x} "
            f"at offset {error.start}"
        ) from None
    except OSError as error:
        raise InvalidFile(f"{path}: cannot be read ({error.strerror})") from None


def write_text(path: str | os.PathLike[str], text: str, *, overwrite: bool = False) -> None:
    """Write a text file completely or not at all.

    The text is written to a temporary file in the same folder, is forced to disk and
    then gets its name in one step, so that neither a kill nor a full disk leaves an
    incomplete file under that name.

    Raises
    ------
    OutputExists
        If the file exists and `overwrite` is not set.
    StorageError
        If the folder does not exist or cannot be written, or the disk is full.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     write_text(Path(folder) / "note.txt", "once")
    ...     write_text(Path(folder) / "note.txt", "twice", overwrite=True)
    ...     print(read_text(Path(folder) / "note.txt"))
    twice
    """
    write_bytes(path, text.encode("utf-8"), overwrite=overwrite)


def write_bytes(path: str | os.PathLike[str], content: bytes, *, overwrite: bool = False) -> None:
    """Write a binary file completely or not at all; see `write_text`."""
    with whole_file(Path(path), overwrite=overwrite) as file:
        file.write(content)


@contextlib.contextmanager
def whole_file(target: Path, *, overwrite: bool = False) -> Iterator[BinaryIO]:
    """Yield a file to read and write, which gets the name `target` once it is safe on disk.

    Of two writers of the same name the first one succeeds, unless `overwrite` is set. After an
    error nothing remains; after a kill an incomplete file may.

    Raises
    ------
    OutputExists
        If the file exists and `overwrite` is not set.
    StorageError
        If the folder does not exist or cannot be written, or the disk is full.
    """
    # Checked early, before any work; `take_name` checks again without a race.
    if not overwrite and os.path.lexists(target):
        raise already_exists(target)
    try:
        temporary, file = open_temporary(target)
        try:
            with file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            take_name(temporary, target, overwrite=overwrite)
        finally:
            with contextlib.suppress(OSError):
                temporary.unlink()
        sync_folder(target.parent)
    except BellcrankError:
        raise
    except FileExistsError:
        raise already_exists(target) from None
    except OSError as error:
        raise storage_error(target, error) from error


def storage_error(path: Path, error: OSError) -> StorageError:
    """Return the error for a file or folder that cannot be written, with reason and remedy."""
    if error.errno in FULL:
        remedy = "free some space; all stored data is intact"
    else:
        remedy = "make the folder writable, or choose another one"
    return StorageError(f"{path}: cannot be written ({error.strerror or error}); {remedy}")


def check_folder(target: Path) -> None:
    """Check that the folder of a file exists and can be written, before long work.

    Raises
    ------
    StorageError
        If not.
    """
    folder = target.parent
    if not folder.is_dir():
        raise StorageError(f"{target}: cannot be written (no folder {folder})")
    if not os.access(folder, os.W_OK):
        raise StorageError(f"{target}: cannot be written (the folder is read-only)")


def open_temporary(target: Path) -> tuple[Path, BinaryIO]:
    """Open a new hidden file in the folder of `target`.

    Files of `tempfile` are private: only the system can apply the user's file permissions without
    a race between threads.
    """
    temporary = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
    handle = os.open(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
    return temporary, os.fdopen(handle, "w+b")


def already_exists(target: Path) -> OutputExists:
    """Return the error for a file that would be overwritten."""
    return OutputExists(f"{target}: exists already; remove it, or request that it is overwritten")


def take_name(temporary: Path, target: Path, *, overwrite: bool) -> None:
    """Give a complete file its name; FileExistsError if that exists and is not to be replaced."""
    if not overwrite:
        try:
            # Unlike a rename, a link fails if another process was faster.
            os.link(temporary, target)
        except FileExistsError:
            raise
        except OSError:
            if os.path.lexists(target):
                raise FileExistsError from None
            # Some file systems have no hard links: rename below.
        else:
            return
    temporary.replace(target)


def sync_folder(folder: Path) -> None:
    """Force the names in a folder to disk, where the system allows it."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
