"""Engine that computes runs in processes of this machine, which end with this one."""

from __future__ import annotations

import contextlib
import json
import queue
import subprocess
import sys
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING

from bellcrank import errors
from bellcrank.campaign.engines.base import Engine, EngineOptions, Outcome, WorkerDied, engines
from bellcrank.campaign.engines.worker import STOP

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bellcrank.campaign.store import Store

START = """
import json, sys
sys.path[:] = json.loads(sys.argv[1])
from bellcrank.campaign.engines.worker import main
main(sys.argv[2])
"""
"""Program of a worker. It does not import the main module of this process."""


class Worker:
    """One worker process.

    Parameters
    ----------
    store_path
        Folder of the campaign.
    ended
        Queue that gets the outcome of each of its runs.
    """

    def __init__(self, store_path: str, ended: queue.SimpleQueue[Outcome]) -> None:
        self._number: int | None = None
        self._alive = True
        self._lock = threading.Lock()
        self._ended = ended
        self._process = subprocess.Popen(
            [sys.executable, "-c", START, json.dumps(sys.path), store_path],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
        )
        threading.Thread(target=self._listen, daemon=True).start()

    def submit(self, number: int) -> bool:
        """Start to compute a run; return False if the process is busy or has ended."""
        with self._lock:
            if self._number is not None or not self._alive:
                return False
            self._number = number
        self.send(str(number))
        return True

    def send(self, line: str) -> None:
        """Send a line to the process; without effect if it has ended."""
        assert self._process.stdin is not None
        with contextlib.suppress(OSError, ValueError):
            self._process.stdin.write(f"{line}\n")
            self._process.stdin.flush()

    def kill(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()

    def _listen(self) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as replies:
            for line in replies:
                with self._lock:
                    self._number = None
                self._ended.put(_outcome(json.loads(line)))
        code = self._process.wait()
        with self._lock:
            self._alive = False
            number = self._number
        if number is not None:
            error = WorkerDied(f"worker process {self._process.pid} ended with status {code}")
            self._ended.put(Outcome(number, error))


def _outcome(reply: dict[str, str | int]) -> Outcome:
    """Rebuild the outcome of a run from the reply of a worker."""
    number, name = int(reply["number"]), reply.get("error")
    if name is None:
        return Outcome(number, None)
    kind = getattr(errors, str(name), None)
    if isinstance(kind, type) and issubclass(kind, errors.BellcrankError):
        return Outcome(number, kind(reply["message"]))
    return Outcome(number, RuntimeError(f"{name}: {reply['message']}"))


class ProcessEngine:
    """Computes each run in one of several processes.

    Parameters
    ----------
    store_path
        Folder of the campaign.
    count
        Number of processes; each is started when it is needed first.
    """

    note: str | None = None

    def __init__(self, store_path: str, count: int) -> None:
        self._path = store_path
        self._count = count
        self._workers: list[Worker] = []
        self._ended: queue.SimpleQueue[Outcome] = queue.SimpleQueue()

    def capacity(self) -> int:
        """Return the number of processes."""
        return self._count

    def submit(self, number: int) -> None:
        """Start to compute a run, in an idle process or a new one."""
        if not any(worker.submit(number) for worker in self._workers):
            worker = Worker(self._path, self._ended)
            self._workers.append(worker)
            worker.submit(number)

    def collect(self, timeout: float) -> list[Outcome]:
        """Return the attempts that have ended."""
        outcomes: list[Outcome] = []
        with contextlib.suppress(queue.Empty):
            outcomes.append(self._ended.get(timeout=timeout))
            while True:
                outcomes.append(self._ended.get_nowait())
        return outcomes

    def request_stop(self) -> None:
        """Let all runs end after the current segment."""
        for worker in self._workers:
            worker.send(STOP)

    def close(self) -> None:
        """End all processes."""
        for worker in self._workers:
            worker.kill()


@engines.register("processes")
@contextmanager
def processes(store: Store, options: EngineOptions) -> Iterator[Engine]:
    """Compute in processes of this machine."""
    from bellcrank.processes import default_workers

    engine = ProcessEngine(str(store.path), options.workers or default_workers())
    try:
        yield engine
    finally:
        engine.close()
