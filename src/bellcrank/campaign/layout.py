"""What lies where in a store, and what of it is ours.

::

    campaign.json                          the resolved spec
    segments/3f2a91c40b77-12/00004000.parquet
                                           rows of one run from step 4000 on
    table/part-00000.parquet               all rows, once all runs are done
    proposals -> segments | table          what readers see

``proposals`` is a link that is switched in one step, so that whoever reads
``proposals/**/*.parquet`` finds each row once at any time. Inside ``segments`` and ``table``
nothing else may lie; beside them, it is left alone.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
from typing import TYPE_CHECKING

from bellcrank.errors import CorruptRun, OutputExists
from bellcrank.model.storage import sync_folder
from bellcrank.storage.files import make_folder, storage_error, target_of

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

DESCRIPTION = "campaign.json"
SEGMENTS = "segments"
TABLE = "table"
VISIBLE = "proposals"
SEGMENT_NAME = re.compile(r"\d{8,}\.parquet")
PART_NAME = re.compile(r"part-\d{5}\.parquet")
TOP_NAME = re.compile(re.escape(DESCRIPTION) + "|" + VISIBLE)
OURS = (DESCRIPTION, SEGMENTS, TABLE, VISIBLE)


def segment_path(run_folder: Path, first_step: int) -> Path:
    """Return the name of the segment that begins with `first_step`."""
    return run_folder / f"{first_step:08d}.parquet"


def part_path(folder: Path, number: int) -> Path:
    """Return the name of a part of the table."""
    return folder / TABLE / f"part-{number:05d}.parquet"


def segment_files(run_folder: Path) -> list[tuple[int, Path]]:
    """Return first step and path of each segment of a run, in order.

    Raises
    ------
    CorruptRun
        If something else lies there.
    """
    found = _our_files(run_folder, SEGMENT_NAME)
    return sorted((int(path.stem), path) for path in found)


def part_files(folder: Path) -> list[Path]:
    """Return the parts of the table, in order.

    Raises
    ------
    CorruptRun
        If something else lies there.
    """
    return sorted(_our_files(folder / TABLE, PART_NAME))


def run_folders(folder: Path) -> Iterator[Path]:
    """Yield the folders in ``segments``, whoever they belong to.

    Raises
    ------
    CorruptRun
        If something else lies there.
    """
    try:
        entries = list(os.scandir(folder / SEGMENTS))
    except FileNotFoundError:
        return
    for entry in entries:
        if not entry.is_dir(follow_symlinks=False):
            raise foreign(folder / SEGMENTS / entry.name)
        yield folder / SEGMENTS / entry.name


def _our_files(folder: Path, ours: re.Pattern[str]) -> list[Path]:
    try:
        names = [path.name for path in folder.iterdir()]
    except FileNotFoundError:
        return []
    except NotADirectoryError:
        raise foreign(folder) from None
    found = []
    for name in names:
        if ours.fullmatch(name):
            found.append(folder / name)
        elif not ours.fullmatch(target_of(name) or ""):  # or a file that a killed writer left
            raise foreign(folder / name)
    return found


def foreign(path: Path) -> CorruptRun:
    """Make the error about a file that no campaign has put there."""
    return CorruptRun(
        f"{path}: does not belong to this campaign; move it elsewhere, or readers of the store "
        f"would take it for data"
    )


def prepare_folder(folder: Path) -> None:
    """Make the folders of a store, as far as they are not there.

    Raises
    ------
    OutputExists
        If something else lies there.
    StorageError
        If that is impossible.
    """
    try:
        taken = folder.exists() and not folder.is_dir()
        names = sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []
    except OSError as error:
        raise storage_error(folder, error) from error
    if taken:
        raise OutputExists(f"{folder}: is a file; choose another folder (--out)")
    if others := [name for name in names if name not in OURS and not target_of(name)]:
        raise OutputExists(
            f"{folder}: exists already and is not empty (it holds {others[0]}); choose another "
            f"folder (--out)"
        )
    make_folder(folder)
    make_folder(folder / SEGMENTS)
    if not os.path.lexists(folder / VISIBLE):
        show(folder, SEGMENTS)


def shown(folder: Path) -> str:
    """Return which of ``segments`` and ``table`` readers see.

    Raises
    ------
    CorruptRun
        If the link is missing or leads elsewhere.
    """
    link = folder / VISIBLE
    target = ""
    with contextlib.suppress(OSError):
        target = str(link.readlink())
    if target not in (SEGMENTS, TABLE):
        raise CorruptRun(
            f"{link}: expected a link to {SEGMENTS} or {TABLE}; restore it with: "
            f"ln -s {SEGMENTS} {link}"
        )
    return target


def show(folder: Path, target: str) -> None:
    """Let readers see ``segments`` or ``table`` from now on, in one step.

    Raises
    ------
    StorageError
    """
    temporary = folder / f".{VISIBLE}.{secrets.token_hex(4)}"
    try:
        temporary.symlink_to(target, target_is_directory=True)
        try:
            temporary.replace(folder / VISIBLE)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise storage_error(folder, error) from error
    sync_folder(folder)


def delete_segments(folder: Path) -> None:
    """Delete all segments and what killed writers left of some, and the folders empty then.

    Raises
    ------
    StorageError
    """
    for run_folder in list(run_folders(folder)):
        _delete_files(run_folder, SEGMENT_NAME)
    with contextlib.suppress(OSError):
        (folder / SEGMENTS).rmdir()


def delete_table(folder: Path) -> None:
    """Delete all parts of the table.

    Raises
    ------
    StorageError
    """
    _delete_files(folder / TABLE, PART_NAME)


def _delete_files(folder: Path, ours: re.Pattern[str]) -> None:
    try:
        for path in list(folder.iterdir()) if folder.is_dir() else ():
            if ours.fullmatch(path.name) or ours.fullmatch(target_of(path.name) or ""):
                path.unlink(missing_ok=True)
    except OSError as error:
        raise storage_error(folder, error) from error
    with contextlib.suppress(OSError):
        folder.rmdir()
