"""Reading text from disk, and writing it so that no half file is ever left."""

from __future__ import annotations

import contextlib
import os
import tempfile
from pathlib import Path

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
    target = Path(path)
    # Asked early for a cheap refusal; `_take_name` asks again without a race.
    if not overwrite and os.path.lexists(target):
        raise _exists(target)
    try:
        handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
        temporary = Path(name)
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            temporary.chmod(0o666 & ~_umask())  # mkstemp makes files private
            _take_name(temporary, target, overwrite=overwrite)
        finally:
            with contextlib.suppress(OSError):
                temporary.unlink()
        _sync_folder(target.parent)
    except FileExistsError:
        raise _exists(target) from None
    except OSError as error:
        raise StorageError(f"{target}: cannot be written ({error.strerror or error})") from error


def _exists(target: Path) -> OutputExists:
    return OutputExists(f"{target}: exists already; remove it, or ask for it to be overwritten")


def _take_name(temporary: Path, target: Path, *, overwrite: bool) -> None:
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


def _umask() -> int:
    """Read the process's file creation mask (which can only be read by setting it)."""
    mask = os.umask(0o022)
    os.umask(mask)
    return mask


def _sync_folder(folder: Path) -> None:
    """Force a new name to disk too, where the system allows it."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
