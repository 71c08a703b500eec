"""Worker processes for the page, with limits on time and on the number of waiting calls."""

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
from typing import TYPE_CHECKING, ParamSpec, TypeVar

from bellcrank.errors import RunFailed
from bellcrank.web import quick_calls

if TYPE_CHECKING:
    from collections.abc import Callable
    from multiprocessing.connection import Connection

P = ParamSpec("P")
T = TypeVar("T")


ENDS = "the server has ended"


class Busy(RunFailed):
    """The limit of waiting calls is reached."""


class ServerEnds(RunFailed):
    """The server ends before a computation."""


class Stopped(RunFailed):
    """A computation was stopped on request."""


class TimeLimitExceeded(RunFailed):
    """A computation was ended by its time limit or by the operating system."""


def limited(seconds: int, function: Callable[[], T]) -> T:
    """Call a function and end the process if it takes longer, on systems with alarm signals.

    Compiled code cannot be interrupted in another way.
    """
    if not hasattr(signal, "alarm"):
        return function()
    signal.alarm(seconds)
    try:
        return function()
    finally:
        signal.alarm(0)


def _initialize(niceness: int, lifeline: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the server stops its processes itself
    if hasattr(os, "nice"):
        os.nice(niceness)
    with contextlib.suppress(OSError):  # the server has ended meanwhile
        lifeline.send(os.getpid())
    threading.Thread(target=_exit_on_close, args=(lifeline,), daemon=True).start()


def _exit_on_close(lifeline: Connection) -> None:
    """End this process when the server closes its end of a pipe or ends in any way.

    An executor ends its processes from a thread, which a signal may interrupt; the operating
    system always closes the pipe.
    """
    with contextlib.suppress(EOFError, OSError):
        lifeline.recv_bytes()
    os._exit(0)


class Pool:
    """A process that is started at the first call and replaced when it dies.

    Calls are carried out one after the other.

    Parameters
    ----------
    seconds
        Time limit of a call; 0 for none.
    waiting
        Largest number of accepted calls, including the running one.
    niceness
        Niceness of the process.
    recycle
        Number of calls after which the process is replaced to release its memory.
    stoppable
        Whether the process is ended when its call is cancelled. Compiled code cannot be
        interrupted in another way.

    Attributes
    ----------
    running
        Key and name of the running call; empty for none and for one without a name.
    """

    def __init__(
        self,
        seconds: int,
        waiting: int,
        niceness: int = 0,
        recycle: int | None = None,
        *,
        stoppable: bool = False,
    ) -> None:
        self.seconds, self.most = seconds, waiting
        self._niceness, self._recycle, self._stoppable = niceness, recycle, stoppable
        self._taken = 0
        self.running = ("", "")
        self._ended = False
        self._turn = asyncio.Lock()
        self._executor: ProcessPoolExecutor | None = None
        self._lifeline: Connection | None = None

    async def prepare(self) -> None:
        """Start the process and load or compile the kernels.

        Compilation may take minutes on a slow machine. A process that dies meanwhile is replaced
        once; kernels that it had compiled stay in the cache.
        """
        for _ in range(2):
            executor = self._started()
            with contextlib.suppress(BrokenProcessPool):
                await asyncio.wrap_future(executor.submit(quick_calls.load_kernels))
                return
            self._drop(executor)
        raise RunFailed("the solver does not start: its process ends at once; is memory short?")

    async def call(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Call a function of a module in the process; errors are those of `call_named`."""
        return await self.call_named("", "", partial(function, *args, **kwargs))

    async def call_named(self, key: str, name: str, function: Callable[[], T]) -> T:
        """Call a function of a module in the process; `running` has its key and name meanwhile.

        Raises
        ------
        Busy
            If too many calls are waiting.
        TimeLimitExceeded
            If the call was ended.
        ServerEnds
            If the server ends.
        """
        if self._ended:
            raise ServerEnds(ENDS)
        if self._taken >= self.most:
            raise Busy("the server is busy with other requests; try again in a moment")
        self._taken += 1
        try:
            async with self._turn:
                self.running = key, name
                try:
                    return await self._call(function)
                finally:
                    self.running = "", ""
        finally:
            self._taken -= 1

    async def _call(self, function: Callable[[], T]) -> T:
        if self._ended:
            raise ServerEnds(ENDS)
        executor = self._started()
        try:
            return await asyncio.wrap_future(executor.submit(limited, self.seconds, function))
        except (BrokenProcessPool, asyncio.CancelledError) as error:
            if self._ended:
                raise ServerEnds(ENDS) from None
            if isinstance(error, asyncio.CancelledError):
                if self._stoppable:
                    self._kill()
                raise
            self._drop(executor)
            raise TimeLimitExceeded(
                f"this took more than {self.seconds} s or too much memory and was ended; "
                "try something smaller"
            ) from None

    def _started(self) -> ProcessPoolExecutor:
        if self._executor is None:
            context = multiprocessing.get_context("spawn")
            theirs, self._lifeline = context.Pipe()
            self._executor = ProcessPoolExecutor(
                1,
                mp_context=context,
                initializer=_initialize,
                initargs=(self._niceness, theirs),
                max_tasks_per_child=self._recycle,
            )
        return self._executor

    def _drop(self, executor: ProcessPoolExecutor) -> None:
        """Discard a process that has died; the next call starts a new one."""
        if self._executor is executor:
            self._close()

    def _kill(self) -> None:
        """End the process; the next call starts a new one."""
        assert self._lifeline is not None
        latest = 0
        while self._lifeline.poll():
            latest = self._lifeline.recv()  # a process that was replaced has ended
        self._close()
        if latest:
            with contextlib.suppress(OSError):
                os.kill(latest, signal.SIGTERM)

    def end(self) -> None:
        """End the process, the running and waiting calls, and accept no more calls."""
        self._ended = True
        self._close()

    def _close(self) -> None:
        if self._lifeline is not None:
            self._lifeline.close()
            self._lifeline = None
        if self._executor is not None:
            self._executor.shutdown(wait=False, cancel_futures=True)
            self._executor = None


@dataclass(frozen=True, slots=True)
class Pools:
    """The processes of a server.

    Parameters
    ----------
    quick
        Calls for live editing.
    thorough
        Calls for motions and sensitivities, a fraction of a second each.
    files
        Calls for files, movies, print times and frames, seconds to a minute each.
    checks
        Calls for finite elements of the outline and for tolerances, minutes each.
    solids
        Calls for finite elements of the body, up to an hour each.
    """

    quick: Pool
    thorough: Pool
    files: Pool
    checks: Pool
    solids: Pool

    async def prepare(self) -> None:
        """Start the pools of fast calls and load or compile the kernels."""
        await self.quick.prepare()
        await self.thorough.prepare()

    def end(self) -> None:
        """End all processes."""
        for pool in (self.quick, self.thorough, self.files, self.checks, self.solids):
            pool.end()


def make_pools() -> Pools:
    """Return the pools of a server, without starting processes."""
    return Pools(
        quick=Pool(seconds=120, waiting=64),
        thorough=Pool(seconds=120, waiting=32, niceness=2),
        files=Pool(seconds=1800, waiting=12, niceness=3, recycle=40, stoppable=True),
        checks=Pool(seconds=1800, waiting=12, niceness=5, recycle=40, stoppable=True),
        solids=Pool(seconds=7200, waiting=12, niceness=5, recycle=40, stoppable=True),
    )
