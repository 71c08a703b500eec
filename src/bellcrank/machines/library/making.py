"""Making entries: a search for each task, the best of what it found measured and written.

Each entry is written once, whole, when all of it is known; searches are run folders, which go on
where a kill left them. So a making that is stopped, however, and begun again ends with the same
entries.
"""

from __future__ import annotations

import math
import shutil
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings
from bellcrank.machines.library.files import write_entry
from bellcrank.machines.library.kinds import kinds
from bellcrank.machines.library.measuring import LEAST_STIFFNESS, measure
from bellcrank.machines.library.summary import entry_files, read_index, read_summary, write_index
from bellcrank.mechanics import Response, Status
from bellcrank.runs.files import make_folder
from bellcrank.search import read_settings, run_chains, select
from bellcrank.workflows import reopen_design, start_design
from bellcrank.workflows.design import accepted_candidates, judge_for

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.machines.library.entry import Entry
    from bellcrank.machines.library.orders import Order, Task
    from bellcrank.model import Design, Problem
    from bellcrank.runs import RunFolder
    from bellcrank.search import Candidate, Progress, Responder, SearchSettings

WORK = "searches"
"""Folder of the searches, in that of the entries."""


@dataclass(frozen=True, slots=True)
class Made:
    """What became of one task.

    Parameters
    ----------
    task, number, total
        Which, and of how many.
    entry
        None if it was there already, or none was found.
    note
        ``made``, ``was there``, or why there is none.
    seconds
        That it took.
    """

    task: Task
    number: int
    total: int
    entry: Entry | None
    note: str
    seconds: float


def make(
    order: Order,
    folder: Path,
    *,
    workers: int | None = None,
    tell: Callable[[Task, Progress], None] = lambda _task, _progress: None,
    stop: threading.Event | None = None,
) -> Iterator[Made]:
    """Make the entries of an order that are not there yet, and the index of the folder.

    Parameters
    ----------
    folder
        Of the entries; the searches are in a folder ``searches`` of it as long as they are needed.
    workers
        Chains that run at the same time; all cores by default. Changes nothing in the results.
    tell
        Called with the progress of a search, from its own thread.
    stop
        Set it to end after the steps at hand; what is done is kept.

    Raises
    ------
    StorageError
        If the folder cannot be written.
    InvalidSettings
        If a search was begun with other settings.
    """
    make_folder(folder)
    there = {path.stem.rpartition("-")[0] for path in entry_files(folder)}
    for number, task in enumerate(order.tasks):
        start = time.monotonic()
        place = folder / WORK / task.name
        entry, note = None, "was there"
        if task.name not in there:
            try:
                entry = _make(task, order, place, workers, tell, stop)
                note = "made"
            except _NoneFound as none:
                note = str(none)
            if entry is not None:
                write_entry(entry, folder)
            elif note == "made":
                return  # stopped
        _forget(place)
        _refresh_index(folder)
        yield Made(task, number, len(order.tasks), entry, note, time.monotonic() - start)


def _forget(place: Path) -> None:
    """Remove a search that is not needed any more, and the folder of searches with the last."""
    if place.exists():
        shutil.rmtree(place)
    if place.parent.exists() and not any(place.parent.iterdir()):
        place.parent.rmdir()


def _refresh_index(folder: Path) -> None:
    """Write the index of a folder if it does not fit the entries."""
    files = entry_files(folder)
    if files and read_index(folder) is None:
        write_index(folder, [read_summary(path) for path in files])


class _NoneFound(Exception):
    """No design of a search can be an entry."""


def _make(
    task: Task,
    order: Order,
    place: Path,
    workers: int | None,
    tell: Callable[[Task, Progress], None],
    stop: threading.Event | None,
) -> Entry | None:
    """Search, choose and measure; None if it was stopped."""
    settings = order.settings(kinds[task.kind])
    runs = []
    for name, (problem, chains) in task.starts(order.chains).items():
        own = replace(settings, chains=chains)
        runs.append(_run_of(problem, own, place / name))
        if not run_chains(
            runs[-1], own, workers=workers, tell=lambda progress: tell(task, progress), stop=stop
        ):
            return None
    design, notes = _best(task.problem(), runs, settings)
    return measure(design, task.direction, task.columns, task.kind, notes=notes)


def _run_of(problem: Problem, settings: SearchSettings, place: Path) -> RunFolder:
    """Begin a search, or go on with it."""
    if not (place / "run.json").exists():
        if place.exists():  # killed before it was described
            shutil.rmtree(place)
        make_folder(place.parent)
        return start_design(problem, settings, place)
    run = reopen_design(place)
    if read_settings(run.settings) != settings or run.problem.hash != problem.hash:
        raise InvalidSettings(
            f"{place}: was begun with other settings; go on with those, or remove it"
        )
    return run


def _best(
    problem: Problem, runs: Sequence[RunFolder], settings: SearchSettings
) -> tuple[Design, dict[str, Any]]:
    """Choose and clean the design of a task's searches, and say how it came about."""
    candidates: list[Candidate] = []
    chains: list[dict[str, Any]] = []
    for run in runs:
        found, _, best = accepted_candidates(run, read_settings(run.settings))
        candidates += [replace(each, chain=each.chain + len(chains)) for each in found]
        chains += [
            {"begun_with": run.path.name, "best": value if math.isfinite(value) else None}
            for value in best
        ]
    judge = Resisting(judge_for(problem, settings))
    try:
        chosen = select(problem, candidates, settings.objective, judge)
    except InvalidSettings as error:
        raise _NoneFound(str(error)) from None
    notes = {
        "kind": "machine",
        "settings": settings.to_dict(),
        "chains": chains,
        "chain": chosen.found.chain,
        "step": chosen.found.step,
        "efficiency_before_cleaning": chosen.efficiency_before,
        "refused": chosen.refused,
    }
    return chosen.design, notes


class Resisting:
    """Who judges designs, and refuses those that merely follow their input.

    A bar that hangs between the ports moves down as far as it is pushed, resists nothing, and is
    of no use to anybody.

    Parameters
    ----------
    judge
        Who knows the goals.
    """

    def __init__(self, judge: Responder) -> None:
        self.judge = judge
        self.problem = judge.problem

    def respond(self, mask: NDArray[np.bool_], largest_increment: float = 1.0) -> Response:
        """Response of a design; forbidden if nothing resists its input."""
        response = self.judge.respond(mask, largest_increment)
        stiffness = 2.0 * response.energy / self.problem.input.amount**2
        if response.status is Status.CONVERGED and not stiffness > LEAST_STIFFNESS:
            return replace(response, status=Status.FORBIDDEN)
        return response

    def __getattr__(self, name: str) -> Any:
        """Leave all else to the judge."""
        return getattr(self.judge, name)
