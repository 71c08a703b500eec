"""Scheduling of searches: sessions alternate, and a long search is suspended while others wait."""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import threading
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings
from bellcrank.processes import default_workers
from bellcrank.web.jobs import UNFINISHED
from bellcrank.web.limits import WAITING
from bellcrank.web.search_process import run_search

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.process import BaseProcess

    from bellcrank.web.jobs import Job, Jobs

SLICE = 45.0
"""Seconds after which a search is suspended if others wait."""
PATIENCE = 20.0
"""Seconds that a search has to store its state when the server ends."""


@dataclass(slots=True, eq=False)
class Running:
    """A search and its process."""

    job: Job
    process: BaseProcess
    pipe: Connection
    since: float
    request: str = ""
    """``pause``, ``stop`` or ``yield`` (suspend and queue again)."""

    def send(self, request: str) -> None:
        """Send a request to end."""
        if self.request in {"pause", "stop"} and request == "yield":
            return
        self.request = request
        with contextlib.suppress(OSError, BrokenPipeError):
            self.pipe.send("stop" if request == "stop" else "pause")


class Scheduler:
    """Runs jobs in processes, up to a number at the same time.

    Parameters
    ----------
    jobs
        All jobs; those that were queued or running when a server ended are resumed.
    slots
        Number of searches at the same time.
    """

    def __init__(self, jobs: Jobs, slots: int | None = None) -> None:
        self.jobs = jobs
        self.slots = slots or default_workers()
        self.running: dict[str, Running] = {}
        self.queue: list[Job] = sorted(
            (job for job in jobs if job.record.status in UNFINISHED),
            key=lambda job: job.record.created,
        )
        self._started_at: dict[str, float] = {}
        self._closing = False
        self._loop: asyncio.AbstractEventLoop | None = None

    def open(self) -> None:
        """Start the queued jobs; call this in the event loop."""
        self._loop = asyncio.get_running_loop()
        for job in self.queue:
            job.update(status="queued")
        self._fill()

    async def close(self) -> None:
        """Suspend the running searches; the next server resumes them."""
        self._closing = True
        for each in self.running.values():
            each.send("yield")
        deadline = time.monotonic() + PATIENCE
        while self.running and time.monotonic() < deadline:
            await asyncio.sleep(0.05)
        for each in self.running.values():
            each.process.terminate()

    def add(self, job: Job) -> None:
        """Queue a job.

        Raises
        ------
        InvalidSettings
            If the job is queued, running or finished, or too many jobs wait.
        """
        if job.name in self.running or job in self.queue:
            raise InvalidSettings("this search is queued or running already")
        if job.record.status == "finished":
            raise InvalidSettings("this search has made all its steps")
        if len(self.queue) + len(self.running) >= WAITING:
            raise InvalidSettings(f"{WAITING} searches are waiting already; wait for one to end")
        self.queue.append(job)
        job.update(status="queued", message="")
        self._fill()

    def pause(self, job: Job) -> None:
        """Pause a search, or remove it from the queue."""
        if job in self.queue:
            self.queue.remove(job)
            job.update(status="paused")
        elif job.name in self.running:
            self.running[job.name].send("pause")
        else:
            raise InvalidSettings("this search is not running")

    def stop(self, job: Job) -> None:
        """Stop a search and choose its best design."""
        if job.name in self.running:
            self.running[job.name].send("stop")
        elif (job.path / "run" / "run.json").exists():
            # A paused search is started again only to choose its best design.
            if job in self.queue:
                self.queue.remove(job)
            self._start(job, "stop")
        elif job in self.queue:
            self.queue.remove(job)
            job.update(status="paused")
        else:
            raise InvalidSettings("this search has not started")

    def position(self, job: Job) -> int:
        """Return the number of searches that start before a waiting one."""
        return self._order().index(job) if job in self.queue else 0

    def _order(self) -> list[Job]:
        """Return the queue in the order in which its jobs will start."""
        waiting, started_at = list(self.queue), dict(self._started_at)
        order: list[Job] = []
        for turn in range(len(waiting)):
            job = min(
                waiting,
                key=lambda each: (started_at.get(each.record.session, 0.0), self.queue.index(each)),
            )
            waiting.remove(job)
            started_at[job.record.session] = time.monotonic() + turn
            order.append(job)
        return order

    def _fill(self) -> None:
        """Start jobs while there are free slots."""
        while self.queue and len(self.running) < self.slots and not self._closing:
            job = self._order()[0]
            self.queue.remove(job)
            self._start(job)
        for job in self.queue:
            job.changed += 1  # its position may have changed

    def _start(self, job: Job, request: str = "") -> None:
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe()
        others = len(self.running) + len(self.queue)
        workers = max(1, default_workers() // (1 + min(others, self.slots - 1)))
        process = context.Process(
            target=run_search, args=(str(job.path), workers, there), daemon=True
        )
        process.start()
        there.close()
        each = Running(job, process, here, time.monotonic())
        self.running[job.name] = each
        self._started_at[job.record.session] = time.monotonic()
        job.update(status="running")
        if request:
            each.send(request)
        threading.Thread(target=self._listen, args=(each,), daemon=True).start()

    def _listen(self, each: Running) -> None:
        """Forward the messages of a process until it ends; runs in a thread."""
        assert self._loop is not None
        last: dict[str, Any] = {
            "kind": "failed",
            "message": "the process of the search ended unexpectedly",
        }
        while True:
            try:
                message = each.pipe.recv()
            except (EOFError, OSError):
                break
            if message["kind"] == "progress":
                self._loop.call_soon_threadsafe(self._receive, each, message)
            else:
                last = message
        each.process.join()
        with contextlib.suppress(RuntimeError):  # the server has ended meanwhile
            self._loop.call_soon_threadsafe(self._ended, each, last)

    def _receive(self, each: Running, message: dict[str, Any]) -> None:
        each.job.receive(message)
        # A refinement begins anew each time, so that it is not suspended.
        is_search = message["refined"] is None
        if is_search and self.queue and time.monotonic() - each.since > SLICE and not each.request:
            each.send("yield")

    def _ended(self, each: Running, last: dict[str, Any]) -> None:
        job = each.job
        self.running.pop(job.name, None)
        each.pipe.close()
        if not job.path.exists():
            self._fill()
            return
        done = job.progress.get("done", job.record.done)
        if last["kind"] == "failed":
            job.update(status="failed", message=last["message"], done=done)
        elif last["kind"] == "paused":
            resumes = each.request == "yield"
            best = job.best()
            job.update(
                status="queued" if resumes else "paused",
                done=done,
                message=last.get("message", ""),
                efficiency=job.record.efficiency if best is None else best,
            )
            if resumes and not self._closing:
                self.queue.append(job)
        else:
            job.update(
                status=last["kind"],
                efficiency=last.get("efficiency"),
                objective=last.get("objective", ""),
                met=last.get("met"),
                done=done,
                message=last.get("message", ""),
            )
        self._fill()
