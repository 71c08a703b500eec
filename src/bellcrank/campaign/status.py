"""How a campaign stands, read from its folder and nothing else."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING

from bellcrank.campaign.compaction import read_parts
from bellcrank.campaign.layout import foreign, run_folders, segment_files
from bellcrank.errors import CorruptRun

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bellcrank.campaign.segments import Segment
    from bellcrank.campaign.spec import Run, Spec
    from bellcrank.campaign.store import Store


@dataclass(frozen=True, slots=True)
class TaskStatus:
    """How one task stands.

    Parameters
    ----------
    name
        Of the task.
    runs, runs_begun, runs_done
        All of its runs, those with anything stored, and those that have ended.
    steps, steps_done
        Steps that all runs make at most, and those stored.
    best, best_seed
        Highest efficiency of an accepted design so far, and the seed that found it; None at
        the start.
    median
        Of the highest efficiencies of the runs begun: what one run may hope for.
    """

    name: str
    runs: int
    runs_begun: int
    runs_done: int
    steps: int
    steps_done: int
    best: float | None
    best_seed: int | None
    median: float | None


@dataclass(frozen=True, slots=True)
class Status:
    """How a campaign stands.

    Parameters
    ----------
    name
        Of the campaign.
    compacted
        Whether the rows are in the table.
    tasks
        In the order of the spec.
    """

    name: str
    compacted: bool
    tasks: list[TaskStatus]

    @property
    def runs(self) -> int:
        """Number of runs."""
        return sum(task.runs for task in self.tasks)

    @property
    def runs_done(self) -> int:
        """Number of runs that have ended."""
        return sum(task.runs_done for task in self.tasks)

    @property
    def steps(self) -> int:
        """Steps that all runs make at most."""
        return sum(task.steps for task in self.tasks)

    @property
    def steps_done(self) -> int:
        """Steps stored."""
        return sum(task.steps_done for task in self.tasks)

    @property
    def done(self) -> bool:
        """Whether all runs have ended."""
        return self.runs == self.runs_done


class Watcher:
    """Looks at a store again and again, and reads only what is new. Changes nothing.

    Parameters
    ----------
    store
        To look at.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._last: dict[str, Segment] = {}
        self._seen: dict[str, int] = {}
        self._compacted = False

    def look(self) -> Status:
        """Return how the campaign stands now.

        Raises
        ------
        CorruptRun
            If a file is damaged, missing or not the campaign's own.
        """
        try:
            self._read()
        except (CorruptRun, FileNotFoundError):
            if not self._store.compacted:  # or the segments went while we were reading them
                raise
            self._read()
        return status_of(self._store.spec, self._last, compacted=self._compacted)

    def pending(self) -> list[Run]:
        """Return the runs that had not ended when we looked last, in order."""
        ended = {run for run, segment in self._last.items() if segment.done}
        return [run for run in self._store.spec.runs() if run.id not in ended]

    def steps_of(self, run: Run) -> int:
        """Return the steps of a run that are stored now, as its file names tell."""
        files = segment_files(self._store.folder_of(run))
        return files[-1][0] + 1 if files else 0

    def _read(self) -> None:
        if self._compacted:
            return
        if self._store.compacted:
            parts = read_parts(self._store)
            self._last = {segment.run: segment for part in parts for segment in part.segments}
            self._compacted = True
            return
        runs = {run.id: run for run in self._store.spec.runs()}
        for folder in run_folders(self._store.path):
            run = runs.get(folder.name)
            if run is None:
                raise foreign(folder)
            if run.id in self._last and self._last[run.id].done:
                continue
            files = segment_files(folder)
            if files and self._seen.get(run.id) != files[-1][0]:
                segment = self._store.last_segment(run)
                if segment is not None:
                    self._last[run.id] = segment
                    self._seen[run.id] = segment.first_step


def status_of(spec: Spec, last: dict[str, Segment], *, compacted: bool) -> Status:
    """Count what the last segments of the runs say."""
    tasks = []
    number = 0
    for task in spec.tasks:
        runs = [spec.run(k) for k in range(number, number + task.run_count)]
        number += task.run_count
        begun = [(run, last[run.id]) for run in runs if run.id in last]
        best = max(begun, key=lambda pair: (pair[1].best, -pair[0].seed), default=None)
        tasks.append(
            TaskStatus(
                name=task.name,
                runs=task.run_count,
                runs_begun=len(begun),
                runs_done=_count(segment.done for _, segment in begun),
                steps=task.run_count * int(task.settings["steps"]),
                steps_done=sum(segment.last_step + 1 for _, segment in begun),
                best=best[1].best if best else None,
                best_seed=best[0].seed if best else None,
                median=median(segment.best for _, segment in begun) if begun else None,
            )
        )
    return Status(spec.name, compacted, tasks)


def _count(flags: Iterable[bool]) -> int:
    return sum(map(int, flags))
