"""One run after the other in this process: for job arrays, and wherever Dask is not."""

from __future__ import annotations

import queue
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TYPE_CHECKING

from bellcrank.campaign.engines.base import Engine, EngineOptions, Outcome, engines
from bellcrank.campaign.work import allow_work, request_stop, work
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bellcrank.campaign.store import Store


class SerialEngine:
    """A thread that does one run at a time, so that the main one can listen to signals."""

    note: str | None = None

    def __init__(self, store_path: str, pool: ThreadPoolExecutor) -> None:
        self._path = store_path
        self._pool = pool
        self._ended: queue.SimpleQueue[Outcome] = queue.SimpleQueue()

    def capacity(self) -> int:
        """Return one: the next run is taken when this one has ended."""
        return 1

    def submit(self, number: int) -> None:
        """Take a run in hand."""
        future = self._pool.submit(work, self._path, number)
        future.add_done_callback(lambda done: self._ended.put(Outcome(number, done.exception())))

    def collect(self, timeout: float) -> list[Outcome]:
        """Return the attempts that ended since."""
        try:
            return [self._ended.get(timeout=timeout)]
        except queue.Empty:
            return []

    def request_stop(self) -> None:
        """Let the run end after the segment at hand."""
        request_stop(self._path)


@engines.register("serial")
@contextmanager
def serial(store: Store, options: EngineOptions) -> Iterator[Engine]:
    """Compute in this process, without any engine.

    Raises
    ------
    InvalidSettings
        If more than one worker is asked for.
    """
    if options.workers not in (None, 1):
        raise InvalidSettings(f"workers: the serial engine is one; got {options.workers}")
    path = str(store.path)
    allow_work(path)
    pool = ThreadPoolExecutor(1)
    try:
        yield SerialEngine(path, pool)
    except BaseException:
        # Whoever insists does not wait for the segment at hand.
        request_stop(path)
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    pool.shutdown()
    allow_work(path)
