"""Functions that are computed in processes of their own.

Functions in Python hold the interpreter lock most of the time, so that threads do not speed them
up. A process sends values to its parent while it computes them.
"""

from __future__ import annotations

import importlib
import json
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import traceback
from collections import deque
from typing import TYPE_CHECKING, Any, BinaryIO

from bellcrank import errors
from bellcrank.errors import BellcrankError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

PROGRAM = """
import json, sys
sys.path[:] = json.loads(sys.argv[1])
from bellcrank.processes import main
main(*sys.argv[2:])
"""
"""Program of the process. It does not import the main module of its parent."""
POLL_INTERVAL = 0.05
"""Time between two checks whether to stop, s."""
PARENT_INTERVAL = 0.5
"""Time between two checks whether the parent is alive, s."""
SINGLE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


def default_workers() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class FunctionProcess:
    """A function that is computed in a process, which sends values.

    Parameters
    ----------
    module, function
        Names of a module and of a function in it. Its first argument is a function that sends a
        value.
    arguments
        Its other arguments, which can be pickled, as the values can.

    Examples
    --------
    >>> list(FunctionProcess("bellcrank.processes", "send_all", ["first", 2]))
    ['first', 2]
    """

    def __init__(self, module: str, function: str, *arguments: object) -> None:
        self._process = subprocess.Popen(
            [
                sys.executable,
                "-c",
                PROGRAM,
                json.dumps(sys.path),
                str(os.getpid()),
                module,
                function,
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **SINGLE_THREAD},
        )
        assert self._process.stdin is not None
        try:
            with self._process.stdin as stream:
                pickle.dump(arguments, stream)
        except BrokenPipeError:
            pass  # reported by the end of the process

    def __iter__(self) -> Iterator[Any]:
        """Yield the values that the process sends.

        Raises
        ------
        BellcrankError
            The error of the process.
        RuntimeError
            If the process ended early.
        """
        assert self._process.stdout is not None
        with self._process.stdout as stream:
            while True:
                try:
                    message = pickle.load(stream)
                except (EOFError, pickle.UnpicklingError, ValueError, OSError):
                    code = self._process.wait()
                    raise RuntimeError(f"a process ended with status {code}") from None
                if message is None:
                    self._process.wait()
                    return
                kind, content = message
                if kind is not None:
                    self._process.wait()
                    raise _error(kind, content)
                yield content

    def kill(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()


class FunctionProcesses:
    """Functions that are computed in processes, several at a time, each followed by a thread.

    Parameters
    ----------
    module, function
        Names of a module and of a function in it, as in `FunctionProcess`.
    jobs
        The arguments of each computation.
    receive
        Called with the number of a computation and each value that it sends, from threads.

    Examples
    --------
    >>> import threading
    >>> found = {}
    >>> jobs = [(["first"],), (["second"],)]
    >>> own = FunctionProcesses("bellcrank.processes", "send_all", jobs, found.__setitem__)
    >>> own.run(2, threading.Event())
    >>> sorted(found.items())
    [(0, 'first'), (1, 'second')]
    """

    def __init__(
        self,
        module: str,
        function: str,
        jobs: Sequence[tuple[object, ...]],
        receive: Callable[[int, Any], None],
    ) -> None:
        self._program = module, function
        self._jobs, self._receive = jobs, receive
        self._errors: list[BaseException] = []
        self._waiting = deque(range(len(jobs)))
        self._running: list[FunctionProcess] = []
        self._lock = threading.Lock()
        self._stopped = False

    def run(self, workers: int, stop: threading.Event) -> None:
        """Compute all, or until the event is set; raise the first error.

        Parameters
        ----------
        workers
            Number of processes at a time.
        stop
            Event that ends all processes.
        """
        threads = [threading.Thread(target=self._work, daemon=True) for _ in range(workers)]
        for thread in threads:
            thread.start()
        try:
            for thread in threads:
                while thread.is_alive() and not stop.is_set():
                    thread.join(POLL_INTERVAL)
        finally:
            self._stop()
        if self._errors:
            raise self._errors[0]

    def _work(self) -> None:
        while True:
            with self._lock:
                if self._stopped or not self._waiting:
                    return
                number = self._waiting.popleft()
                process = FunctionProcess(*self._program, *self._jobs[number])
                self._running.append(process)
            try:
                for value in process:
                    self._receive(number, value)
            except BaseException as error:  # raised again by `run`
                if not self._stopped:
                    self._errors.append(error)
                self._stop()
                return

    def _stop(self) -> None:
        with self._lock:
            self._stopped = True
            for process in self._running:
                process.kill()


def send_all(send: Any, values: list[Any]) -> None:
    """Send values one by one."""
    for value in values:
        send(value)


def _error(name: str, message: str) -> Exception:
    """Return the error of a process."""
    kind = getattr(errors, name, None)
    if isinstance(kind, type) and issubclass(kind, BellcrankError):
        return kind(message)
    return RuntimeError(f"{name}: {message}")


def main(parent: str, module: str, function: str) -> None:
    """Compute a function, and write the values that it sends to standard output.

    The process ends soon after its parent, even if that is killed.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends this process
    threading.Thread(target=_end_with, args=(int(parent),), daemon=True).start()
    stream = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    try:
        arguments = pickle.load(sys.stdin.buffer)
        computed = getattr(importlib.import_module(module), function)
        computed(lambda value: _write(stream, (None, value)), *arguments)
        _write(stream, None)
    except (BrokenPipeError, KeyboardInterrupt):
        os._exit(1)  # the parent has ended
    except Exception as error:
        if not isinstance(error, BellcrankError):
            traceback.print_exc()
        _write(stream, (type(error).__name__, str(error)))


def _end_with(parent: int) -> None:
    """End this process when its parent has ended."""
    while os.getppid() == parent:
        time.sleep(PARENT_INTERVAL)
    os._exit(1)


def _write(stream: BinaryIO, message: object) -> None:
    pickle.dump(message, stream)
    stream.flush()
