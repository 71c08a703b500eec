"""Completion of a campaign: submit the runs that are not done until all are."""

from __future__ import annotations

import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from bellcrank.campaign.compaction import compact
from bellcrank.campaign.engines import EngineOptions, Outcome, WorkerDied, engines
from bellcrank.campaign.status import StatusReader
from bellcrank.campaign.work import check_tasks
from bellcrank.errors import BellcrankError, ClusterError, InvalidSettings, RunFailed, StorageError

if TYPE_CHECKING:
    from collections.abc import Callable

    from bellcrank.campaign.engines import Engine
    from bellcrank.campaign.spec import Run
    from bellcrank.campaign.status import Status
    from bellcrank.campaign.store import Store

MAX_DEATHS = 4
"""Workers that may die during a run without a new segment, before the run fails."""
COLLECT_TIMEOUT = 0.1
"""Seconds to wait for the end of a run before requests to stop are checked."""
STATUS_INTERVAL = 2.0
"""Seconds between two reports of the status."""
STOP_TIMEOUT = 1.0
"""Seconds in which runs can end their segment after a request to stop."""


@dataclass(frozen=True, slots=True)
class Shard:
    """One of several equal parts of the runs of a campaign.

    Parameters
    ----------
    index
        Number of the part, from 1 to `count`.
    count
        Number of parts.

    Raises
    ------
    InvalidSettings

    Examples
    --------
    >>> [number for number in range(7) if Shard.parse("2/3").holds(number)]
    [1, 4]
    """

    index: int = 1
    count: int = 1

    @classmethod
    def parse(cls, text: str) -> Shard:
        """Read ``i/N``."""
        index, _, count = text.partition("/")
        with suppress(ValueError):
            shard = cls(int(index), int(count))
            if 1 <= shard.index <= shard.count:
                return shard
        raise InvalidSettings(f"shard: expected i/N with 1 <= i <= N, like 3/100, got {text!r}")

    def holds(self, number: int) -> bool:
        """Whether the run of that number belongs to this part."""
        return number % self.count == self.index - 1


@dataclass(slots=True)
class _Progress:
    """State of the completion of a campaign."""

    reader: StatusReader
    engine: Engine
    waiting: deque[Run]
    running: dict[int, Run] = field(default_factory=dict)
    deaths: dict[int, tuple[int, int]] = field(default_factory=dict)
    failures: list[tuple[Run, BaseException]] = field(default_factory=list)

    def submit(self) -> None:
        """Submit as many runs as the engine can compute."""
        room = self.engine.capacity() - len(self.running)
        for _ in range(min(room, len(self.waiting))):
            run = self.waiting.popleft()
            self.running[run.number] = run
            self.engine.submit(run.number)

    def record(self, outcome: Outcome) -> None:
        """Record the end of an attempt.

        Raises
        ------
        StorageError, ClusterError
            Errors that would occur in every other run too.
        """
        run = self.running.pop(outcome.number)
        error = outcome.error
        if isinstance(error, (StorageError, ClusterError)):
            raise error
        if isinstance(error, WorkerDied):
            steps = self.reader.steps_of(run)
            before, count = self.deaths.get(run.number, (-1, 0))
            count = count + 1 if steps == before else 1
            self.deaths[run.number] = (steps, count)
            if count < MAX_DEATHS:
                self.waiting.append(run)
                return
            error = WorkerDied(f"{count} workers died during this run; the last: {error}")
        if error is not None:
            self.failures.append((run, error))


def complete(
    store: Store,
    engine: str = "processes",
    options: EngineOptions | None = None,
    *,
    shard: Shard | None = None,
    compacting: bool = True,
    report: Callable[[Status], None] = lambda _status: None,
    announce: Callable[[str], None] = lambda _note: None,
    stop: threading.Event | None = None,
) -> bool:
    """Compute the remaining runs of a campaign, or of a part of it.

    Parameters
    ----------
    store
        Store of the campaign.
    engine
        Name in the registry of engines.
    options
        Options of the engine.
    shard
        Part of the runs to compute; all by default.
    compacting
        Whether to make the table when all runs of the campaign are done.
    report
        Called regularly with the status of the campaign.
    announce
        Called with the note of the engine, such as the address of a dashboard.
    stop
        Event that requests a stop. Segments that are not complete after `STOP_TIMEOUT` are
        discarded; complete ones are stored.

    Returns
    -------
    bool
        Whether all runs of this part are done.

    Raises
    ------
    ClusterError
        If machines cannot be reached or do not fit; nothing is then computed.
    StorageError
        If the store cannot be written.
    CorruptRun
        If it is damaged.
    RunFailed
        If runs failed; all others are completed before.
    """
    enter = engines[engine]
    part = shard or Shard()
    stop = stop or threading.Event()
    reader = StatusReader(store)
    report(reader.read())
    waiting = deque(run for run in reader.pending() if part.holds(run.number))
    if waiting:
        check_tasks(store.spec)
        with enter(store, options or EngineOptions()) as entered:
            if entered.note:
                announce(entered.note)
            _compute(_Progress(reader, entered, waiting), report, stop)
    status = reader.read()
    report(status)
    if status.done and compacting and not stop.is_set():
        compact(store)
    return not any(part.holds(run.number) for run in reader.pending())


def _compute(progress: _Progress, report: Callable[[Status], None], stop: threading.Event) -> None:
    """Submit runs and record their ends, until all have ended or `stop` is set."""
    reported = time.monotonic()
    while (progress.running or progress.waiting) and not stop.is_set():
        progress.submit()
        for outcome in progress.engine.collect(COLLECT_TIMEOUT):
            progress.record(outcome)
        if time.monotonic() - reported > STATUS_INTERVAL:
            report(progress.reader.read())
            reported = time.monotonic()
    if progress.running:
        progress.engine.request_stop()
        end = time.monotonic() + STOP_TIMEOUT
        while progress.running and time.monotonic() < end:
            for outcome in progress.engine.collect(COLLECT_TIMEOUT):
                progress.record(outcome)
    if progress.failures:
        raise _failed(progress.failures)


def _failed(failures: list[tuple[Run, BaseException]]) -> BellcrankError:
    """Return one error for all runs that failed."""
    run, error = failures[0]
    what = str(error) if isinstance(error, BellcrankError) else repr(error)
    others = f"; {len(failures) - 1} more runs failed" if len(failures) > 1 else ""
    return RunFailed(f"run {run.id} (task {run.task.name!r}, seed {run.seed}): {what}{others}")
