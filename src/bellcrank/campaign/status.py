"""Status of a campaign, read from its folder."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING

from bellcrank.campaign.compaction import read_parts
from bellcrank.errors import CorruptRun
from bellcrank.storage.segments import foreign

if TYPE_CHECKING:
    from bellcrank.campaign.spec import Run, Spec
    from bellcrank.campaign.store import Store
    from bellcrank.storage.segments import Segment


@dataclass(frozen=True, slots=True)
class TaskStatus:
    """Status of a task.

    Parameters
    ----------
    name
        Name of the task.
    runs, runs_begun, runs_done
        Numbers of all its runs, of those with stored steps, and of those that have ended.
    steps, steps_done
        Maximum number of steps of all runs, and number of stored steps.
    best, best_seed
        Highest efficiency of an accepted design so far and its seed; None at the start.
    median
        Median over the started runs of their highest efficiencies.
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
    """Status of a campaign.

    Parameters
    ----------
    name
        Name of the campaign.
    compacted
        Whether the rows are in the table.
    tasks
        Status of each task, in the order of the spec.
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
        """Maximum number of steps of all runs."""
        return sum(task.steps for task in self.tasks)

    @property
    def steps_done(self) -> int:
        """Number of stored steps."""
        return sum(task.steps_done for task in self.tasks)

    @property
    def done(self) -> bool:
        """Whether all runs have ended."""
        return self.runs == self.runs_done


class StatusReader:
    """Reads the status of a store repeatedly, each time only the new files. Changes nothing.

    Parameters
    ----------
    store
        Store to read.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._last: dict[str, Segment] = {}
        self._compacted = False

    def read(self) -> Status:
        """Return the current status.

        Raises
        ------
        CorruptRun
            If a file is damaged, missing or foreign.
        """
        try:
            self._update()
        except (CorruptRun, FileNotFoundError):
            if not self._store.compacted:  # otherwise the segments were deleted meanwhile
                raise
            self._update()
        return status_of(self._store.spec, self._last, compacted=self._compacted)

    def pending(self) -> list[Run]:
        """Return the runs that had not ended at the last `read`, in order."""
        ended = {run for run, segment in self._last.items() if segment.done}
        return [run for run in self._store.spec.runs() if run.id not in ended]

    def steps_of(self, run: Run) -> int:
        """Return a number that grows with the stored steps of a run."""
        files = self._store.segments.listed(run.id)
        return files[-1][0] + 1 if files else 0

    def _update(self) -> None:
        if self._compacted:
            return
        if self._store.compacted:
            parts = read_parts(self._store)
            self._last = {segment.run: segment for part in parts for segment in part.segments}
            self._compacted = True
            return
        files = self._store.segments
        known = {run.id for run in self._store.spec.runs()}
        for run in files.runs():
            if run not in known:
                raise foreign(files.folder_of(run))
            last = self._last.get(run)
            if last is not None and last.done:
                continue
            listed = files.listed(run)
            if listed and (last is None or last.first_step != listed[-1][0]):
                self._last[run] = files.read(run, listed[-1][1], thorough=False)


def status_of(spec: Spec, last: dict[str, Segment], *, compacted: bool) -> Status:
    """Return the status that follows from the last segments of the runs."""
    tasks = []
    number = 0
    for task in spec.tasks:
        runs = [spec.run(k) for k in range(number, number + task.run_count)]
        number += task.run_count
        begun = [(run, last[run.id]) for run in runs if run.id in last]
        efficiencies = [(segment.best or 0.0, -run.seed) for run, segment in begun]
        best, seed = max(efficiencies, default=(None, None))
        tasks.append(
            TaskStatus(
                name=task.name,
                runs=task.run_count,
                runs_begun=len(begun),
                runs_done=sum(segment.done for _, segment in begun),
                steps=task.run_count * int(task.settings["steps"]),
                steps_done=sum(segment.last_step + 1 for _, segment in begun),
                best=best,
                best_seed=None if seed is None else -seed,
                median=median(value for value, _ in efficiencies) if efficiencies else None,
            )
        )
    return Status(spec.name, compacted, tasks)
