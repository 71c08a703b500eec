"""Engine that computes one run after another in this process."""

from __future__ import annotations

import queue
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING

from bellcrank.campaign.engines.base import Engine, EngineOptions, Outcome, engines
from bellcrank.campaign.work import allow_work, request_stop, work
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bellcrank.campaign.store import Store


class SerialEngine:
    """Computes one run at a time in a thread, so that the main thread can react to signals.

    Parameters
    ----------
    store_path
        Folder of the campaign.

    Attributes
    ----------
    busy
        Whether a run is being computed.
    """

    note: str | None = None

    def __init__(self, store_path: str) -> None:
        self._path = store_path
        self._ended: queue.SimpleQueue[Outcome] = queue.SimpleQueue()
        self.busy = False

    def capacity(self) -> int:
        """Return 1."""
        return 1

    def submit(self, number: int) -> None:
        """Start to compute a run."""

        def run() -> None:
            try:
                work(self._path, number)
            except BaseException as error:  # reported as the outcome
                self._ended.put(Outcome(number, error))
            else:
                self._ended.put(Outcome(number, None))

        self.busy = True
        threading.Thread(target=run, daemon=True).start()

    def collect(self, timeout: float) -> list[Outcome]:
        """Return the attempts that have ended."""
        try:
            outcome = self._ended.get(timeout=timeout)
        except queue.Empty:
            return []
        self.busy = False
        return [outcome]

    def request_stop(self) -> None:
        """Let the run end after the current segment."""
        request_stop(self._path)


@engines.register("serial")
@contextmanager
def serial(store: Store, options: EngineOptions) -> Iterator[Engine]:
    """Compute one run after another in this process.

    Raises
    ------
    InvalidSettings
        If more than one worker is requested.
    """
    if options.workers not in (None, 1):
        raise InvalidSettings(f"workers: engine 'serial' has one worker; got {options.workers}")
    path = str(store.path)
    allow_work(path)
    engine = SerialEngine(path)
    try:
        yield engine
    finally:
        if engine.busy:
            request_stop(path)
        else:
            allow_work(path)
