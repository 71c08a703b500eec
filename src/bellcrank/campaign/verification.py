"""Check of every byte of a store, and removal of what is damaged."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from bellcrank.campaign.compaction import expand, read_parts, read_table_part
from bellcrank.errors import BellcrankError, CorruptRun
from bellcrank.model.storage import storage_error
from bellcrank.storage.segments import foreign

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.campaign.store import Store


@dataclass(slots=True)
class Verification:
    """Result of the check of a store.

    Parameters
    ----------
    files
        Number of intact files.
    rows
        Number of rows in these.
    damage
        One message for each file that is damaged, missing or foreign.
    doomed
        Files to delete before the rest can be computed again: the damaged ones, and the later
        ones of their runs. Foreign files are never among them.
    """

    files: int = 0
    rows: int = 0
    damage: list[str] = field(default_factory=list)
    doomed: list[Path] = field(default_factory=list)


def verify(store: Store) -> Verification:
    """Check every file of a store.

    Raises
    ------
    CorruptRun
        If the files cannot even be listed.
    """
    return _verify_table(store) if store.compacted else _verify_segments(store)


def repair(store: Store, found: Verification) -> None:
    """Delete what is damaged, so that resuming computes it again.

    The intact parts of a damaged table become segments again.

    Raises
    ------
    StorageError
    """
    if not found.damage:
        return
    if store.compacted:
        intact = [path for path in store.parts() if path not in found.doomed]
        expand(store, [read_table_part(store, path, thorough=True) for path in intact])
        found = _verify_segments(store)  # a run whose first segments are lost starts again
    try:
        for path in found.doomed:
            path.unlink(missing_ok=True)
    except OSError as error:
        raise storage_error(store.path, error) from error


def _verify_segments(store: Store) -> Verification:
    found = Verification()
    known = {run.id for run in store.spec.runs()}
    try:
        runs = store.segments.runs()
    except CorruptRun as error:
        return Verification(damage=[str(error)])
    for run in runs:
        if run in known:
            _verify_run(store, run, found)
        else:
            found.damage.append(str(foreign(store.segments.folder_of(run))))
    return found


def _verify_run(store: Store, run: str, found: Verification) -> None:
    """Check the segments of a run; the first damaged one and all later ones are doomed."""
    try:
        listed = store.segments.listed(run)
    except CorruptRun as error:
        found.damage.append(str(error))
        return
    next_step = intact = 0
    ended = False
    for first_step, path in listed:
        if first_step != next_step or ended:
            missing = store.segments.path_of(run, next_step)
            found.damage.append(f"{missing}: missing, although {path.name} exists")
            break
        try:
            segment = store.segments.read(run, path, thorough=True)
        except BellcrankError as error:
            found.damage.append(str(error))
            break
        next_step = segment.last_step + 1
        ended = segment.done
        intact += 1
    found.files += intact
    found.rows += next_step
    found.doomed += [path for _, path in listed[intact:]]


def _verify_table(store: Store) -> Verification:
    found = Verification()
    for path in store.parts():
        try:
            part = read_table_part(store, path, thorough=True)
        except BellcrankError as error:
            found.damage.append(str(error))
            found.doomed.append(path)
        else:
            found.files += 1
            found.rows += sum(segment.rows for segment in part.segments)
    if not found.damage:
        try:
            read_parts(store)
        except CorruptRun as error:  # a part is missing
            found.damage.append(str(error))
    return found
