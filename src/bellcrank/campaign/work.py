"""One run, wherever it is computed: the only place that knows how to search.

Every engine calls `work`. What it computes goes to the store; all it returns is a name.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.campaign.layout import DESCRIPTION
from bellcrank.campaign.store import Store
from bellcrank.errors import BellcrankError, InvalidSettings
from bellcrank.model import problem_from_dict
from bellcrank.storage import Proposals

if TYPE_CHECKING:
    from bellcrank.campaign.spec import Run, Spec

_stopping: set[str] = set()
"""Stores whose runs this process is to leave off."""


def request_stop(store_path: str) -> None:
    """Let the runs of a store end in this process after the segment at hand."""
    _stopping.add(store_path)


def allow_work(store_path: str) -> None:
    """Take back `request_stop`."""
    _stopping.discard(store_path)


def work(store_path: str, run_number: int) -> str:
    """Take up one run where its segments end, and advance it to its end.

    May be called by anybody, anywhere, several times at once: the store comes out the same.

    Parameters
    ----------
    store_path
        Folder of the campaign, as this machine sees it.
    run_number
        In its campaign.

    Returns
    -------
    str
        Id of the run.

    Raises
    ------
    InvalidFile
        If this machine sees no such store.
    StorageError, CorruptRun
        If the store cannot be written, or is damaged.
    """
    store = _store_at(store_path)
    run = store.spec.run(run_number)
    if not store.compacted:
        advance(store, run)
    return run.id


def advance(store: Store, run: Run) -> None:
    """Advance a run from its last segment to its end, or until `request_stop`."""
    from bellcrank.search import (
        advance_chain,
        is_done,
        make_evaluator,
        read_settings,
        read_state,
        start_chain,
    )

    segments = store.segments_of(run)
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
    """Open a store; only once in a process, unless its description is another one."""
    try:
        told = (Path(store_path) / DESCRIPTION).stat()
    except OSError:
        return Store.open(store_path)  # which says what is wrong
    return _open(store_path, (told.st_ino, told.st_mtime_ns))


def check_tasks(spec: Spec) -> None:
    """Refuse tasks that cannot start, before any machine is asked to; compiles the kernels.

    Raises
    ------
    InvalidSettings
        Naming the task.
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
    """Return the identity of the campaign that this machine sees in a folder, if any."""
    try:
        return Store.open(store_path).spec.hash
    except BellcrankError:
        return None
