"""Warm processes that compute for the page, with a limit on time and on what waits."""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from bellcrank.errors import RunFailed
from bellcrank.web import solving

if TYPE_CHECKING:
    from collections.abc import Callable
    from multiprocessing.connection import Connection

P = ParamSpec("P")
T = TypeVar("T")


class Busy(RunFailed):
    """So much is waiting already that no more is taken."""


class TookTooLong(RunFailed):
    """A computation was ended, by its limit or by the system."""


def limited(seconds: int, function: Callable[[], T]) -> T:
    """Call a function; where the system knows alarms, end the process if it takes longer.

    Compiled code listens to nothing gentler.
    """
    if not hasattr(signal, "alarm"):
        return function()
    signal.alarm(seconds)
    try:
        return function()
    finally:
        signal.alarm(0)


def _begin(niceness: int, leash: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the server stops its processes itself
    if hasattr(os, "nice"):
        os.nice(niceness)
    threading.Thread(target=_end_with, args=(leash,), daemon=True).start()


def _end_with(leash: Connection) -> None:
    """End this process when the server lets go of its end of a pipe, or dies in whatever way.

    An executor tells its processes to end from a thread, which a signal may cut short; the
    system closes a pipe always.
    """
    with contextlib.suppress(EOFError, OSError):
        leash.recv_bytes()
    os._exit(0)


class Pool:
    """Processes that are started when first needed and replaced when they die.

    Parameters
    ----------
    processes
        How many.
    seconds
        That a call may take; 0 for as long as it wants.
    waiting
        Calls that are taken at once, running ones included.
    niceness
        How far behind others they stand for the processor.
    recycle
        Calls after which a process is replaced, so that what it has gathered is given back.
    """

    def __init__(
        self,
        processes: int,
        seconds: int,
        waiting: int,
        niceness: int = 0,
        recycle: int | None = None,
    ) -> None:
        self.processes, self.seconds, self.most = processes, seconds, waiting
        self._niceness, self._recycle = niceness, recycle
        self._taken = 0
        self._executor: ProcessPoolExecutor | None = None
        self._leash: Connection | None = None

    async def warm(self) -> None:
        """Start the processes, and compile or load what they need.

        Compiling may take minutes on a slow machine. A process that dies over it is replaced
        once: what it had compiled is kept.
        """
        for _ in range(2):
            executor = self._started()
            tasks = [executor.submit(solving.warm) for _ in range(self.processes)]
            with contextlib.suppress(BrokenProcessPool):
                await asyncio.gather(*map(asyncio.wrap_future, tasks))
                return
            self._drop(executor)
        raise RunFailed("the solver does not start: its processes end at once; is memory short?")

    async def call(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Call a function of a module in one of the processes.

        Raises
        ------
        Busy
            If too much is waiting.
        TookTooLong
            If it had to be ended.
        """
        if self._taken >= self.most:
            raise Busy("the server is busy with other requests; try again in a moment")
        self._taken += 1
        try:
            executor = self._started()
            submitted = executor.submit(limited, self.seconds, partial(function, *args, **kwargs))
            return await asyncio.wrap_future(submitted)
        except BrokenProcessPool:
            self._drop(executor)
            raise TookTooLong(
                f"this took more than {self.seconds} s or too much memory and was ended; "
                "try something smaller"
            ) from None
        finally:
            self._taken -= 1

    def _started(self) -> ProcessPoolExecutor:
        if self._executor is None:
            context = multiprocessing.get_context("spawn")
            theirs, self._leash = context.Pipe(duplex=False)
            self._executor = ProcessPoolExecutor(
                self.processes,
                mp_context=context,
                initializer=_begin,
                initargs=(self._niceness, theirs),
                max_tasks_per_child=self._recycle,
            )
        return self._executor

    def _drop(self, executor: ProcessPoolExecutor) -> None:
        """Forget processes of which one has died, so that the next call starts others."""
        if self._executor is executor:
            self.close()

    def close(self) -> None:
        """End the processes, also those that are at work; what waits is dropped."""
        if self._leash is not None:
            self._leash.close()
            self._leash = None
        if self._executor is not None:
            self._executor.shutdown(wait=False, cancel_futures=True)
            self._executor = None


@dataclass(frozen=True, slots=True)
class Pools:
    """The processes of a server.

    Parameters
    ----------
    quick
        For what a person waits for with the hand on the mouse.
    thorough
        For motions and sensitivities, a fraction of a second each.
    slow
        For files, movies and finite elements.
    """

    quick: Pool
    thorough: Pool
    slow: Pool

    async def warm(self) -> None:
        """Start what must answer at once, and compile or load the kernels."""
        await self.quick.warm()
        await self.thorough.warm()

    def close(self) -> None:
        """End all processes."""
        for pool in (self.quick, self.thorough, self.slow):
            pool.close()


def make_pools() -> Pools:
    """Return the pools of a server; nothing is started yet."""
    return Pools(
        quick=Pool(1, seconds=120, waiting=64),
        thorough=Pool(1, seconds=120, waiting=32, niceness=2),
        slow=Pool(1, seconds=600, waiting=12, niceness=5, recycle=40),
    )


def plain_error(error: BaseException) -> dict[str, Any]:
    """Return what a page is told about an error: the sentence, and what it is about.

    Examples
    --------
    >>> plain_error(ValueError("task: output.nodes: node 5 is also in input.nodes"))
    {'message': 'output.nodes: node 5 is also in input.nodes', 'key': 'output.nodes'}
    """
    message = str(error).splitlines()[0] if str(error) else type(error).__name__
    message = (
        message.removeprefix("task: ").removeprefix("the file: ").removeprefix("the machine: ")
    )
    head = message.partition(":")[0]
    named = head.replace(".", "").replace("_", "").replace("[", "").replace("]", "").isalnum()
    return {"message": message, "key": head if named and " " not in head else ""}
