"""Checking every byte of a store, and clearing away what is damaged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bellcrank.campaign.compaction import Part, expand, read_part, read_parts
from bellcrank.campaign.layout import foreign, part_files, run_folders, segment_files, segment_path
from bellcrank.campaign.segments import read_segment
from bellcrank.errors import BellcrankError, CorruptRun
from bellcrank.storage.files import storage_error

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.campaign.spec import Run
    from bellcrank.campaign.store import Store


@dataclass(frozen=True, slots=True)
class Verification:
    """What a check of a store has found.

    Parameters
    ----------
    files
        Number of files that are as they were written.
    rows
        In these.
    damage
        What is wrong, one sentence for each file.
    doomed
        Files to delete before the rest can be computed again: those damaged, and the later
        ones of their runs. Files of others are never among them.
    """

    files: int
    rows: int
    damage: list[str]
    doomed: list[Path]


def verify(store: Store) -> Verification:
    """Check every file of a store.

    Raises
    ------
    CorruptRun
        If the store is such that its files cannot even be found.
    """
    return _verify_table(store) if store.compacted else _verify_segments(store)


def repair(store: Store, found: Verification) -> None:
    """Delete what is damaged, so that resuming computes it again.

    Of a table, the parts that are whole become segments again.

    Raises
    ------
    StorageError
    """
    if not found.damage:
        return
    if store.compacted:
        whole = [path for path in part_files(store.path) if path not in found.doomed]
        expand(store, [read_part(path, store, thoroughly=True) for path in whole])
        found = _verify_segments(store)  # a run whose beginning was lost has to start again
    try:
        for path in found.doomed:
            path.unlink(missing_ok=True)
    except OSError as error:
        raise storage_error(store.path, error) from error


def _verify_segments(store: Store) -> Verification:
    files = rows = 0
    damage: list[str] = []
    doomed: list[Path] = []
    runs = {run.id: run for run in store.spec.runs()}
    try:
        folders = sorted(run_folders(store.path))
    except CorruptRun as error:
        return Verification(0, 0, [str(error)], [])
    for folder in folders:
        if folder.name not in runs:
            damage.append(str(foreign(folder)))
            continue
        found = _verify_run(store, runs[folder.name])
        files += found.files
        rows += found.rows
        damage += found.damage
        doomed += found.doomed
    return Verification(files, rows, damage, doomed)


def _verify_run(store: Store, run: Run) -> Verification:
    """Check the segments of a run; from the first that is damaged on, all are doomed."""
    folder = store.folder_of(run)
    try:
        listed = segment_files(folder)
    except CorruptRun as error:
        return Verification(0, 0, [str(error)], [])
    rows = 0
    damage: list[str] = []
    whole = 0
    ended = False
    for first_step, path in listed:
        if first_step != rows or ended:
            missing = segment_path(folder, rows)
            damage.append(f"{missing}: missing, though {path.name} is there")
            break
        try:
            segment = read_segment(path, store.spec, run, thoroughly=True)
        except BellcrankError as error:
            damage.append(str(error))
            break
        rows = segment.last_step + 1
        ended = segment.done
        whole += 1
    return Verification(whole, rows, damage, [path for _, path in listed[whole:]])


def _verify_table(store: Store) -> Verification:
    parts: list[Part] = []
    damage: list[str] = []
    doomed: list[Path] = []
    for path in part_files(store.path):
        try:
            parts.append(read_part(path, store, thoroughly=True))
        except BellcrankError as error:
            damage.append(str(error))
            doomed.append(path)
    if not damage:
        try:
            read_parts(store)
        except CorruptRun as error:  # one is missing
            damage.append(str(error))
    rows = sum(segment.rows for part in parts for segment in part.segments)
    return Verification(len(parts), rows, damage, doomed)
