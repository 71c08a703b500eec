"""Driving a campaign: hand out the runs that are not done, until they are."""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from bellcrank.campaign.compaction import compact
from bellcrank.campaign.engines import EngineOptions, Outcome, WorkerDied, engines
from bellcrank.campaign.status import Watcher
from bellcrank.campaign.work import check_tasks
from bellcrank.errors import BellcrankError, ClusterError, InvalidSettings, RunFailed, StorageError

if TYPE_CHECKING:
    import threading
    from collections import deque
    from collections.abc import Callable

    from bellcrank.campaign.engines import Engine
    from bellcrank.campaign.spec import Run
    from bellcrank.campaign.status import Status
    from bellcrank.campaign.store import Store

MOST_DEATHS = 4
"""Workers that a run may kill without storing anything new, before it is given up."""
WAIT = 0.2
"""Seconds between two looks at what has ended."""
LOOK = 2.0
"""Seconds between two looks at the store."""


@dataclass(frozen=True, slots=True)
class Shard:
    """One of several equal parts of a campaign's runs.

    Parameters
    ----------
    index
        From 1 to `count`.
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
class _Drive:
    """One stretch of work on a campaign."""

    store: Store
    watcher: Watcher
    engine: Engine
    waiting: deque[Run]
    hand: dict[int, Run] = field(default_factory=dict)
    deaths: dict[int, tuple[int, int]] = field(default_factory=dict)
    failures: list[tuple[Run, BaseException]] = field(default_factory=list)

    def hand_out(self) -> None:
        """Let the engine have as many runs as it can use."""
        room = self.engine.capacity() - len(self.hand)
        for _ in range(min(room, len(self.waiting))):
            run = self.waiting.popleft()
            self.hand[run.number] = run
            self.engine.submit(run.number)

    def take_in(self, outcome: Outcome) -> None:
        """Note how an attempt ended.

        Raises
        ------
        StorageError, ClusterError
            What no other run would escape either.
        """
        run = self.hand.pop(outcome.number)
        error = outcome.error
        if isinstance(error, (StorageError, ClusterError)):
            raise error
        if isinstance(error, WorkerDied):
            steps = self.watcher.steps_of(run)
            before, count = self.deaths.get(run.number, (-1, 0))
            count = count + 1 if steps == before else 1
            self.deaths[run.number] = (steps, count)
            if count < MOST_DEATHS:
                self.waiting.append(run)
                return
            error = WorkerDied(f"{count} workers died at it in a row; the last: {error}")
        if error is not None:
            self.failures.append((run, error))


def complete(
    store: Store,
    engine: str = "local",
    options: EngineOptions | None = None,
    *,
    shard: Shard | None = None,
    compacting: bool = True,
    tell: Callable[[Status], None] = lambda _status: None,
    announce: Callable[[str], None] = lambda _note: None,
    stop: threading.Event | None = None,
) -> bool:
    """Compute what is left of a campaign, or of a part of it.

    Parameters
    ----------
    engine
        Name in the registry of engines.
    shard
        Part of the runs to compute; all by default.
    compacting
        Make the table when all runs of the campaign are done.
    tell
        Called now and then with how the campaign stands.
    announce
        Called with what the engine has to say, such as where its dashboard is.
    stop
        Set it to end after the segments at hand; what is done is kept.

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
        If runs could not be brought to their end, after all others were.
    """
    enter = engines[engine]
    part = shard or Shard()
    watcher = Watcher(store)
    tell(watcher.look())
    waiting = [run for run in watcher.pending() if part.holds(run.number)]
    if waiting:
        check_tasks(store.spec)
        with enter(store, options or EngineOptions()) as entered:
            if entered.note:
                announce(entered.note)
            _drive(store, watcher, entered, waiting, tell, stop)
    status = watcher.look()
    tell(status)
    if status.done and compacting and not (stop and stop.is_set()):
        compact(store)
    return not any(part.holds(run.number) for run in watcher.pending())


def _drive(
    store: Store,
    watcher: Watcher,
    engine: Engine,
    waiting: list[Run],
    tell: Callable[[Status], None],
    stop: threading.Event | None,
) -> None:
    """Hand out runs and take in how they end."""
    from collections import deque

    drive = _Drive(store, watcher, engine, deque(waiting))
    looked = time.monotonic()
    stopping = False
    while drive.hand or (drive.waiting and not stopping):
        if not stopping and stop is not None and stop.is_set():
            stopping = True
            engine.request_stop()
        if not stopping:
            drive.hand_out()
        for outcome in engine.collect(WAIT):
            drive.take_in(outcome)
        if time.monotonic() - looked > LOOK:
            tell(watcher.look())
            looked = time.monotonic()
    if drive.failures:
        raise _failed(drive.failures)


def _failed(failures: list[tuple[Run, BaseException]]) -> BellcrankError:
    """Make one error of all runs that failed."""
    run, error = failures[0]
    what = str(error) if isinstance(error, BellcrankError) else repr(error)
    others = f"; {len(failures) - 1} more runs failed" if len(failures) > 1 else ""
    return RunFailed(f"run {run.id} (task {run.task.name!r}, seed {run.seed}): {what}{others}")
