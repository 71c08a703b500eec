"""Who searches when: sessions take turns, and a long search makes room for those that wait."""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import threading
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings
from bellcrank.search import default_workers
from bellcrank.web.jobs import ALIVE
from bellcrank.web.limits import WAITING
from bellcrank.web.searching import run_search

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.process import BaseProcess

    from bellcrank.web.jobs import Job, Jobs

SLICE = 45.0
"""Seconds after which a search makes room, if others wait."""
PATIENCE = 20.0
"""Seconds that a search is given to keep what it has done when the server ends."""


@dataclass(slots=True, eq=False)
class Running:
    """A search in its process."""

    job: Job
    process: BaseProcess
    pipe: Connection
    since: float
    wanted: str = ""
    """``pause``, ``stop`` or, to be taken up again later, ``yield``."""

    def ask(self, wanted: str) -> None:
        """Ask it to end."""
        if self.wanted in {"pause", "stop"} and wanted == "yield":
            return
        self.wanted = wanted
        with contextlib.suppress(OSError, BrokenPipeError):
            self.pipe.send("stop" if wanted == "stop" else "pause")


class Scheduler:
    """Runs jobs in processes, as many at once as there is room.

    Parameters
    ----------
    jobs
        All there are; those that were queued or running when a server ended go on.
    slots
        Searches at the same time.
    """

    def __init__(self, jobs: Jobs, slots: int | None = None) -> None:
        self.jobs = jobs
        self.slots = slots or default_workers()
        self.running: dict[str, Running] = {}
        self.queue: list[Job] = sorted(
            (job for job in jobs if job.record.status in ALIVE), key=lambda job: job.record.created
        )
        self._served: dict[str, float] = {}
        self._closing = False
        self._loop: asyncio.AbstractEventLoop | None = None

    def open(self) -> None:
        """Begin to run what is queued; call it from the event loop."""
        self._loop = asyncio.get_running_loop()
        for job in self.queue:
            job.update(status="queued")
        self._fill()

    async def close(self) -> None:
        """Let running searches keep what is done; the next server goes on with them."""
        self._closing = True
        for each in self.running.values():
            each.ask("yield")
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
            If it is there already, is done, or too many wait.
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
        """Let a search rest, or take it out of the queue."""
        if job in self.queue:
            self.queue.remove(job)
            job.update(status="paused")
        elif job.name in self.running:
            self.running[job.name].ask("pause")
        else:
            raise InvalidSettings("this search is not running")

    def stop(self, job: Job) -> None:
        """End a search, and take the best it has found."""
        if job.name in self.running:
            self.running[job.name].ask("stop")
        elif (job.path / "run" / "run.json").exists():
            # A resting search has a design to choose too: it is begun again for that alone.
            if job in self.queue:
                self.queue.remove(job)
            self._start(job, "stop")
        elif job in self.queue:
            self.queue.remove(job)
            job.update(status="paused")
        else:
            raise InvalidSettings("this search has not begun")

    def place(self, job: Job) -> int:
        """Return how many searches go before one that waits."""
        return self._order().index(job) if job in self.queue else 0

    def _order(self) -> list[Job]:
        """Return the queue in the order in which it will be served if nothing else comes."""
        waiting, served = list(self.queue), dict(self._served)
        order: list[Job] = []
        for turn in range(len(waiting)):
            job = min(
                waiting,
                key=lambda each: (served.get(each.record.session, 0.0), self.queue.index(each)),
            )
            waiting.remove(job)
            served[job.record.session] = time.monotonic() + turn
            order.append(job)
        return order

    def _fill(self) -> None:
        """Start what there is room for; ask long searches for room."""
        while self.queue and len(self.running) < self.slots and not self._closing:
            job = self._order()[0]
            self.queue.remove(job)
            self._start(job)
        for job in self.queue:
            job.changed += 1  # its place may be another now

    def _start(self, job: Job, wanted: str = "") -> None:
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe()
        rivals = len(self.running) + len(self.queue)
        workers = max(1, default_workers() // (1 + min(rivals, self.slots - 1)))
        process = context.Process(
            target=run_search, args=(str(job.path), workers, there), daemon=True
        )
        process.start()
        there.close()
        each = Running(job, process, here, time.monotonic())
        self.running[job.name] = each
        self._served[job.record.session] = time.monotonic()
        job.update(status="running")
        if wanted:
            each.ask(wanted)
        threading.Thread(target=self._listen, args=(each,), daemon=True).start()

    def _listen(self, each: Running) -> None:
        """Pass on what a process tells, from a thread of its own, until it ends."""
        assert self._loop is not None
        last: dict[str, Any] = {"kind": "failed", "message": "the search ended without a word"}
        while True:
            try:
                message = each.pipe.recv()
            except (EOFError, OSError):
                break
            if message["kind"] == "progress":
                self._loop.call_soon_threadsafe(self._hear, each, message)
            else:
                last = message
        each.process.join()
        with contextlib.suppress(RuntimeError):  # the server has ended meanwhile
            self._loop.call_soon_threadsafe(self._ended, each, last)

    def _hear(self, each: Running, message: dict[str, Any]) -> None:
        each.job.hear(message)
        if self.queue and time.monotonic() - each.since > SLICE and not each.wanted:
            each.ask("yield")

    def _ended(self, each: Running, last: dict[str, Any]) -> None:
        job = each.job
        self.running.pop(job.name, None)
        each.pipe.close()
        if not job.path.exists():
            self._fill()
            return
        done = job.told.get("done", job.record.done)
        if last["kind"] == "failed":
            job.update(status="failed", message=last["message"], done=done)
        elif last["kind"] == "paused":
            resumes = each.wanted == "yield"
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
            job.update(status=last["kind"], efficiency=last.get("efficiency"), done=done)
        self._fill()
