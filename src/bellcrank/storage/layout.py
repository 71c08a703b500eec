"""What lies where in the folder of a run, and what of it is ours.

::

    run.json                      problem, settings, provenance, status
    chains/003/00004000.parquet   proposals of chain 3 from step 4000 on, until finished
    history.parquet               all proposals, once finished
    .lock                         held by the process at work on it

Everything else in the folder belongs to somebody else and is never touched.
"""

from __future__ import annotations

import contextlib
import re
from typing import TYPE_CHECKING

from bellcrank.errors import OutputExists
from bellcrank.storage.files import make_folder, remove_temporaries, storage_error, target_of

if TYPE_CHECKING:
    from pathlib import Path

DESCRIPTION = "run.json"
HISTORY = "history.parquet"
LOCK = ".lock"
CHAINS = "chains"
SHARD_NAME = re.compile(r"\d{8,}\.parquet")
CHAIN_NAME = re.compile(r"\d{3,}")
TOP_NAME = re.compile(re.escape(DESCRIPTION) + "|" + re.escape(HISTORY))


def chain_folder(folder: Path, chain: int) -> Path:
    """Return where the shards of a chain lie."""
    return folder / CHAINS / f"{chain:03d}"


def shard_path(chain_folder: Path, first_step: int) -> Path:
    """Return the name of the shard that begins with `first_step`."""
    return chain_folder / f"{first_step:08d}.parquet"


def chain_numbers(folder: Path) -> list[int]:
    """Return the numbers of the chains that have shards in the folder of a run."""
    root = folder / CHAINS
    names = [path.name for path in root.iterdir()] if root.is_dir() else []
    numbers = sorted(int(name) for name in names if CHAIN_NAME.fullmatch(name))
    return [number for number in numbers if shard_files(chain_folder(folder, number))]


def shard_files(chain_folder: Path) -> list[tuple[int, Path]]:
    """Return first step and path of each shard of a chain, in order."""
    found = chain_folder.iterdir() if chain_folder.is_dir() else ()
    return sorted((int(path.stem), path) for path in found if SHARD_NAME.fullmatch(path.name))


def check_free(folder: Path, *, overwrite: bool = False) -> None:
    """Refuse a place that a new run cannot take, without making anything there.

    Raises
    ------
    OutputExists
        If it is a file, or a folder that is not empty and `overwrite` is not set.
    StorageError
        If it cannot be looked at.
    """
    try:
        is_folder = folder.is_dir()
        taken = folder.exists() and not is_folder
    except OSError as error:
        raise storage_error(folder, error) from error
    if taken:
        raise OutputExists(f"{folder}: is a file; choose another folder (--out)")
    if is_folder and not overwrite and (found := _content(folder)):
        go_on = f", or go on with the run in it (--resume {folder})" * (DESCRIPTION in found)
        raise OutputExists(
            f"{folder}: exists already and is not empty (it holds {found[0]}); "
            f"choose another folder (--out){go_on}"
        )


def claim_folder(folder: Path, *, overwrite: bool) -> None:
    """Make the folder of a new run, or clear the one that is there if told to.

    Raises
    ------
    OutputExists
        If something is there already and `overwrite` is not set.
    StorageError
        If the folder cannot be made or written.
    """
    check_free(folder, overwrite=overwrite)
    make_folder(folder)
    check_free(folder, overwrite=overwrite)
    _delete_run(folder)


def _content(folder: Path) -> list[str]:
    """Return the names in a folder, but for what a kill at the very beginning leaves."""
    try:
        names = sorted(path.name for path in folder.iterdir())
    except OSError as error:
        raise storage_error(folder, error) from error
    return [name for name in names if not TOP_NAME.fullmatch(target_of(name) or "")]


def _delete_run(folder: Path) -> None:
    """Delete a run, its description first: what is left is then taken for no run."""
    remove_temporaries(folder, TOP_NAME)
    try:
        (folder / DESCRIPTION).unlink(missing_ok=True)
        (folder / HISTORY).unlink(missing_ok=True)
    except OSError as error:
        raise storage_error(folder, error) from error
    delete_shards(folder)


def delete_shards(folder: Path) -> None:
    """Delete the shards of all chains, and the folders that are empty then.

    Raises
    ------
    StorageError
    """
    root = folder / CHAINS
    places = list(root.iterdir()) if root.is_dir() else []
    for place in places:
        if not CHAIN_NAME.fullmatch(place.name):
            continue
        remove_temporaries(place, SHARD_NAME)
        try:
            for _, path in shard_files(place):
                path.unlink(missing_ok=True)
        except OSError as error:
            raise storage_error(folder, error) from error
        with contextlib.suppress(OSError):
            place.rmdir()
    with contextlib.suppress(OSError):
        root.rmdir()
