"""Computation of one run, wherever it takes place.

Every engine calls `work`, which writes to the store and returns only a name.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.campaign.store import DESCRIPTION, Store
from bellcrank.errors import BellcrankError, InvalidSettings
from bellcrank.model import problem_from_dict
from bellcrank.storage import Proposals

if TYPE_CHECKING:
    from bellcrank.campaign.spec import Run, Spec

_stopping: set[str] = set()
"""Stores on which this process stops to work."""


def request_stop(store_path: str) -> None:
    """Let the runs of a store end in this process after the current segment."""
    _stopping.add(store_path)


def allow_work(store_path: str) -> None:
    """Revoke `request_stop`."""
    _stopping.discard(store_path)


def work(store_path: str, run_number: int) -> str:
    """Advance one run from its last segment to its end, or until `request_stop`.

    May be called several times at once, on any machine: the resulting store is the same.

    Parameters
    ----------
    store_path
        Folder of the campaign on this machine.
    run_number
        Number of the run in its campaign.

    Returns
    -------
    str
        Name of the run.

    Raises
    ------
    InvalidFile
        If there is no such store on this machine.
    StorageError, CorruptRun
        If the store cannot be written, or is damaged.
    """
    store = _store_at(store_path)
    run = store.spec.run(run_number)
    if not store.compacted:
        _advance(store, run)
    return run.id


def _advance(store: Store, run: Run) -> None:
    from bellcrank.search import (
        advance_chain,
        is_done,
        make_evaluator,
        read_settings,
        read_state,
        start_chain,
    )

    segments = store.segments.read_all(run.id, thorough=True)
    if segments and segments[-1].done:
        return
    settings = read_settings(run.settings)
    evaluator = make_evaluator(problem_from_dict(run.task.problem, f"run {run.id}"), settings)
    if segments:
        state = read_state(settings, segments[-1].state)
    else:
        state = start_chain(evaluator, settings, 0)
    done = False
    while not done and str(store.path) not in _stopping:
        first_step, parts = state.step, []
        while not done and state.step < first_step + store.spec.segment:
            state, proposals = advance_chain(evaluator, settings, 0, state)
            parts.append(proposals)
            done = is_done(state, settings)
        rows = Proposals(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
        store.append(run, first_step, rows, state.to_dict(), best=float(state.best), done=done)


@lru_cache(maxsize=4)
def _open(store_path: str, _stamp: tuple[int, int]) -> Store:
    return Store.open(store_path)


def _store_at(store_path: str) -> Store:
    """Open a store, again only if its description has changed."""
    try:
        file = (Path(store_path) / DESCRIPTION).stat()
    except OSError:
        return Store.open(store_path)  # raises the appropriate error
    return _open(store_path, (file.st_ino, file.st_mtime_ns))


def check_tasks(spec: Spec) -> None:
    """Check that every task can start, before any worker is started; compiles the kernels.

    Raises
    ------
    InvalidSettings
        If a task cannot start; the message names it.
    """
    from bellcrank.search import advance_chain, make_evaluator, read_settings, start_chain

    number = 0
    for task in spec.tasks:
        run = spec.run(number)
        number += task.run_count
        few = read_settings({**run.settings, "steps": 2})
        try:
            evaluator = make_evaluator(problem_from_dict(task.problem, f"task {task.name!r}"), few)
            advance_chain(evaluator, few, 0, start_chain(evaluator, few, 0))
        except BellcrankError as error:
            raise InvalidSettings(f"task {task.name!r}: {error}") from None


def describe_store(store_path: str) -> str | None:
    """Return the hash of the campaign that this machine finds in a folder, if any."""
    try:
        return Store.open(store_path).spec.hash
    except BellcrankError:
        return None
