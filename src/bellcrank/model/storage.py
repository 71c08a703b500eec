"""Reading text from disk, and writing it so that no half file is ever left."""

from __future__ import annotations

import contextlib
import os
import secrets
from pathlib import Path
from typing import BinaryIO

from bellcrank.errors import InvalidFile, OutputExists, StorageError


def read_text(path: str | os.PathLike[str]) -> str:
    """Read a text file.

    Raises
    ------
    InvalidFile
        If there is no such file, it may not be read, or is not UTF-8 text.
    """
    try:
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
    """Write a text file whole or not at all.

    The text goes to a temporary file in the same folder, is forced to disk and
    then takes its name in one step, so that neither a kill nor a full disk
    leaves half a file under it.

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
    """As `write_text`, with bytes."""
    target = Path(path)
    # Asked early for a cheap refusal; `take_name` asks again without a race.
    if not overwrite and os.path.lexists(target):
        raise already_exists(target)
    try:
        temporary, file = open_temporary(target)
        try:
            with file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            take_name(temporary, target, overwrite=overwrite)
        finally:
            with contextlib.suppress(OSError):
                temporary.unlink()
        sync_folder(target.parent)
    except FileExistsError:
        raise already_exists(target) from None
    except OSError as error:
        raise StorageError(f"{target}: cannot be written ({error.strerror or error})") from error


def check_folder(target: Path) -> None:
    """Refuse a file in a folder that is not there or may not be written, before long work.

    Raises
    ------
    StorageError
    """
    folder = target.parent
    if not folder.is_dir():
        raise StorageError(f"{target}: cannot be written (no folder {folder})")
    if not os.access(folder, os.W_OK):
        raise StorageError(f"{target}: cannot be written (the folder is read-only)")


def open_temporary(target: Path) -> tuple[Path, BinaryIO]:
    """Open a new file beside `target`, hidden until it takes its name.

    Not by `tempfile`, whose files are private: only the system can apply the user's file
    permissions without a race between threads.
    """
    temporary = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
    handle = os.open(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
    return temporary, os.fdopen(handle, "w+b")


def already_exists(target: Path) -> OutputExists:
    """Make the error that refuses to write over something."""
    return OutputExists(f"{target}: exists already; remove it, or ask for it to be overwritten")


def take_name(temporary: Path, target: Path, *, overwrite: bool) -> None:
    """Give a finished file its name; FileExistsError if that is taken and not to be replaced."""
    if not overwrite:
        try:
            # Unlike a rename, a link fails if somebody else was faster.
            os.link(temporary, target)
        except FileExistsError:
            raise
        except OSError:
            if os.path.lexists(target):
                raise FileExistsError from None
            # Some file systems know no hard links: rename below.
        else:
            return
    temporary.replace(target)


def sync_folder(folder: Path) -> None:
    """Force a new name to disk too, where the system allows it."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
