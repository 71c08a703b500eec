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
from bellcrank.search import Verdict, read_settings, run_chains, select
from bellcrank.storage.files import make_folder
from bellcrank.storage.layout import LOCK
from bellcrank.storage.locking import locked
from bellcrank.workflows import reopen_design, start_design
from bellcrank.workflows.design import accepted_candidates, verification_evaluator

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.machines.library.entry import Entry
    from bellcrank.machines.library.orders import Order, Task
    from bellcrank.machines.library.summary import Summary
    from bellcrank.model import Problem
    from bellcrank.search import Candidate, Evaluator, Progress, SearchSettings, Selection
    from bellcrank.storage import RunFolder

WORK = "searches"
"""Folder of the searches, in that of the entries."""
SAME = 1e-6
"""Efficiencies that differ by less are of designs that are as good as each other."""


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
        ``made``, ``made in place of NAME``, ``was there``, or why there is none.
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
    again: bool = False,
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
    again
        Whether to search anew for what is there too, and to put what is more efficient in its
        place; with other steps, chains or another seed.
    tell
        Called with the progress of a search, from its own thread.
    stop
        Set it to end after the steps at hand; what is done is kept.

    Raises
    ------
    StorageError
        If the folder cannot be written, or another process makes entries in it.
    InvalidSettings
        If a search was begun with other settings.
    InvalidFile
        If an entry that is there is damaged.
    """
    make_folder(folder)
    with locked(folder / LOCK, f"{folder}: another process makes entries there; let it end"):
        for number, task in enumerate(order.tasks):
            start = time.monotonic()
            place = folder / WORK / task.name
            old = _best_there(folder, task)
            entry, note = None, "was there"
            if old is None or again:
                try:
                    found = _search(task, order, place, workers, tell, stop)
                    if found is None:
                        return  # stopped
                    entry, note = _entry(task, *found, old)
                except _NoneFound as none:
                    note = str(none)
            if entry is not None:
                write_entry(entry, folder)
                if old is not None:
                    (folder / f"{old.name}.json").unlink()
            if not again:
                _forget(place)
            _refresh_index(folder)
            yield Made(task, number, len(order.tasks), entry, note, time.monotonic() - start)
        # Kept so long: who is stopped need not search again for what was not better.
        for task in order.tasks:
            _forget(folder / WORK / task.name)


def _best_there(folder: Path, task: Task) -> Summary | None:
    """Return the most efficient entry of a task that is in a folder, if any."""
    paths = [path for path in entry_files(folder) if path.stem.rpartition("-")[0] == task.name]
    return max(map(read_summary, paths), key=_rank, default=None)


def _rank(known: Summary) -> float:
    return known.efficiency if math.isfinite(known.efficiency) else -math.inf


def _entry(
    task: Task, found: Selection, notes: dict[str, Any], old: Summary | None
) -> tuple[Entry | None, str]:
    """Measure what was found, if it is better than what is there; also return a note."""
    if old is not None and not found.efficiency_after > _rank(old) + SAME:
        return None, f"none better than {old.name}"
    entry = measure(found.design, task.direction, task.columns, task.kind, notes=notes)
    return entry, "made" if old is None else f"made in place of {old.name}"


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


def _search(
    task: Task,
    order: Order,
    place: Path,
    workers: int | None,
    tell: Callable[[Task, Progress], None],
    stop: threading.Event | None,
) -> tuple[Selection, dict[str, Any]] | None:
    """Search and choose, and say how the design came about; None if it was stopped."""
    settings = order.settings(kinds[task.kind])
    runs = []
    for name, (problem, chains) in task.starts(order.chains).items():
        own = replace(settings, chains=chains)
        runs.append(_run_of(problem, own, place / name))
        if not run_chains(
            runs[-1], own, workers=workers, tell=lambda progress: tell(task, progress), stop=stop
        ):
            return None
    return _best(task.problem(), runs, settings)


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
) -> tuple[Selection, dict[str, Any]]:
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
    judge = Resisting(verification_evaluator(problem, settings))
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
    return chosen, notes


class Resisting:
    """Who judges designs, and refuses those that merely follow their input.

    A bar that hangs between the ports moves down as far as it is pushed, resists nothing, and is
    of no use to anybody.

    Parameters
    ----------
    judge
        Who knows the goals.
    """

    def __init__(self, judge: Evaluator) -> None:
        self.judge = judge
        self.problem = judge.problem

    def evaluate(
        self, mask: NDArray[np.bool_], largest_increment: float = 1.0, **start: Any
    ) -> Response:
        """Return the response of a design; its status is FORBIDDEN if nothing resists its input."""
        response = self.judge.evaluate(mask, largest_increment, **start)
        if start.get("warm_start"):
            return response
        stiffness = 2.0 * response.energy / self.problem.input.amount**2
        if response.status is Status.CONVERGED and not stiffness > LEAST_STIFFNESS:
            return replace(response, status=Verdict.FORBIDDEN)
        return response

    def __getattr__(self, name: str) -> Any:
        """Leave all else to the judge."""
        return getattr(self.judge, name)
