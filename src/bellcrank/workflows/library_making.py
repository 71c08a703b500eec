"""Making of entries: a search for each task, then selection, measurement and writing.

Searches are of frames of the default part. Candidates are verified as in `bellcrank design`;
without one that has no fault there is no entry.

Each entry is written once, when it is complete. Searches are run folders, which can be resumed, so
that an interrupted run continues to the same entries.
"""

from __future__ import annotations

import math
import shutil
import time
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings
from bellcrank.fem.results import finite
from bellcrank.machines.library.catalogue import entry_files, read_summary
from bellcrank.machines.library.files import write_entry
from bellcrank.part import PartSpec
from bellcrank.search import read_settings, run_chains
from bellcrank.search.choice import select_design
from bellcrank.storage.files import make_folder
from bellcrank.storage.locking import LOCK, locked
from bellcrank.workflows import reopen_design, start_design
from bellcrank.workflows.design import accepted_candidates
from bellcrank.workflows.library_measurement import measure
from bellcrank.workflows.refinement import refine_selection, refinement_data
from bellcrank.workflows.specification import item_data

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from bellcrank.machines.library.catalogue import Summary
    from bellcrank.machines.library.entry import Entry
    from bellcrank.machines.library.tasks import EntryTask, MakeSettings
    from bellcrank.model import Problem
    from bellcrank.search import Progress, SearchSettings, Selection
    from bellcrank.storage import RunFolder

SEARCHES = "searches"
"""Folder of the searches within the folder of the entries."""
EQUAL = 1e-6
"""Difference of efficiencies below which two designs are equally good."""


@dataclass(frozen=True, slots=True)
class TaskOutcome:
    """Outcome of one task.

    Parameters
    ----------
    task, number, total
        The task, its number, and the number of tasks.
    entry
        The entry; None if none was written.
    note
        ``made``, ``made in place of NAME``, ``exists``, or the reason why there is none.
    seconds
        Duration.
    """

    task: EntryTask
    number: int
    total: int
    entry: Entry | None
    note: str
    seconds: float


def make(
    settings: MakeSettings,
    folder: Path,
    *,
    workers: int | None = None,
    again: bool = False,
    report: Callable[[EntryTask, Progress], None] = lambda _task, _progress: None,
    stop: threading.Event | None = None,
) -> Iterator[TaskOutcome]:
    """Make the entries that do not exist yet.

    Parameters
    ----------
    settings
        Entries to make.
    folder
        Folder of the entries. Its subfolder ``searches`` holds unfinished searches.
    workers
        Number of chains that run at the same time; by default all cores. The results do not
        depend on it.
    again
        Whether to search again for existing entries, and to replace them by more efficient
        ones; with other steps, chains or another seed.
    report
        Called with the progress of a search, from the thread of the search.
    stop
        Event that stops the run; the state is kept.

    Raises
    ------
    StorageError
        If the folder cannot be written, or another process makes entries in it.
    InvalidSettings
        If a search was started with other settings.
    InvalidFile
        If an existing entry is damaged.
    """
    make_folder(folder)
    with locked(folder / LOCK, wait=False):
        for number, task in enumerate(settings.tasks):
            start = time.monotonic()
            path = folder / SEARCHES / task.name
            old = _best_existing(folder, task)
            entry, note = None, "exists"
            if old is None or again:
                try:
                    found = _search(task, settings, path, workers, report, stop)
                    if found is None:
                        return  # stopped
                    entry, note = _entry(task, *found, old)
                except _NoUsableDesign as error:
                    note = str(error)
            if entry is not None:
                write_entry(entry, folder)
                if old is not None:
                    (folder / f"{old.name}.json").unlink()
            if not again:
                _remove(path)
            total = len(settings.tasks)
            yield TaskOutcome(task, number, total, entry, note, time.monotonic() - start)
        # With `again`, searches are removed at the end: a resumed run must not repeat those that
        # found nothing better.
        for task in settings.tasks:
            _remove(folder / SEARCHES / task.name)


def _best_existing(folder: Path, task: EntryTask) -> Summary | None:
    """Return the most efficient entry of a task in a folder, if any."""
    paths = [path for path in entry_files(folder) if path.stem.rpartition("-")[0] == task.name]
    return max(map(read_summary, paths), key=_rank, default=None)


def _rank(summary: Summary) -> float:
    return summary.efficiency if math.isfinite(summary.efficiency) else -math.inf


def _entry(
    task: EntryTask, found: Selection, notes: dict[str, Any], old: Summary | None
) -> tuple[Entry | None, str]:
    """Measure a design; also return a note. None if the existing entry is better."""
    try:
        entry = measure(found.design, task.direction, task.columns, task.kind, notes=notes)
    except InvalidSettings as error:
        raise _NoUsableDesign(str(error)) from None
    if old is not None and not entry.efficiency > _rank(old) + EQUAL:
        return None, f"none better than {old.name}"
    return entry, "made" if old is None else f"made in place of {old.name}"


def _remove(path: Path) -> None:
    """Remove a search, and the folder of searches if it is empty."""
    if path.exists():
        shutil.rmtree(path)
    if path.parent.exists() and not any(path.parent.iterdir()):
        path.parent.rmdir()


class _NoUsableDesign(Exception):
    """No design of a search can become an entry."""


def _search(
    task: EntryTask,
    settings: MakeSettings,
    path: Path,
    workers: int | None,
    report: Callable[[EntryTask, Progress], None],
    stop: threading.Event | None,
) -> tuple[Selection, dict[str, Any]] | None:
    """Search, and select a design with its provenance; None if the search was stopped."""
    problem = task.problem()
    run = _run(problem, settings.search_settings(), path)
    search = read_settings(run.settings)
    progress = partial(report, task)
    if not run_chains(run, search, workers=workers, progress=progress, stop=stop):
        return None
    return _select(problem, run, search, workers, stop)


def _run(problem: Problem, settings: SearchSettings, path: Path) -> RunFolder:
    """Start or reopen a search."""
    if not (path / "run.json").exists():
        if path.exists():  # killed before its description was written
            shutil.rmtree(path)
        make_folder(path.parent)
        return start_design(problem, settings, path)
    run = reopen_design(path)
    started = replace(settings, before_refinement=problem.is_specified)
    if read_settings(run.settings) != started or run.problem.hash != problem.hash:
        raise InvalidSettings(
            f"{path}: the search was started with other settings; use those, or remove the folder"
        )
    return run


def _select(
    problem: Problem,
    run: RunFolder,
    settings: SearchSettings,
    workers: int | None,
    stop: threading.Event | None,
) -> tuple[Selection, dict[str, Any]] | None:
    """Select, clean and refine the best design of a search.

    Also return its provenance. None if the refinement was stopped.
    """
    candidates, _, _ = accepted_candidates(run, settings)
    limit = PartSpec().registered_material.strain_limit
    try:
        chosen = select_design(problem, candidates, settings, limit)
    except InvalidSettings as error:
        raise _NoUsableDesign(str(error)) from None
    chosen, refinement = refine_selection(chosen, PartSpec(), workers=workers, stop=stop)
    if stop is not None and stop.is_set():
        return None
    assert chosen.verification is not None
    if chosen.verification.fault is not None:
        raise _NoUsableDesign(f"no design without a fault: {chosen.verification.fault}")
    missed = [] if refinement is None else [each for each in refinement.after.sheet if not each.met]
    if missed:
        names = ", ".join(each.item.name for each in missed)
        raise _NoUsableDesign(f"no design without a fault: misses {names} in the sheet")
    notes = {
        "kind": "machine",
        "settings": settings.to_dict(),
        "chain": chosen.found.chain,
        "step": chosen.found.step,
        "efficiency_before_cleaning": finite(chosen.efficiency_before),
        "refused": chosen.refused,
    }
    if refinement is not None:
        after = refinement.after
        models = {"frames, 8 elements": after.items}
        if after.sheet:
            models["sheet"] = after.sheet
        notes["refinement"] = refinement_data(refinement)
        notes["items"] = item_data(chosen.design.problem, PartSpec(), models)
    # Its items are those of the kind, and its figures are measured.
    alone = replace(chosen.design, problem=replace(chosen.design.problem, specification=None))
    return replace(chosen, design=alone), notes
