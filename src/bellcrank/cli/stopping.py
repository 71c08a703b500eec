"""Requests to stop: Ctrl-C and SIGTERM."""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING

from bellcrank.cli.app import INTERRUPTED
from bellcrank.cli.console import notes

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)
EXIT_TIMEOUT = 1.2
"""Seconds after a request to stop within which a job that can be resumed ends."""


class StopRequest(threading.Event):
    """Set when the user asks the command to stop.

    Attributes
    ----------
    hint
        Line to print when the process ends, which names the command that resumes the job. Before
        it is set there is nothing to store, and a resumable job ends at once.
    """

    def __init__(self) -> None:
        super().__init__()
        self.hint: str | None = None

    def exit(self) -> None:
        """Print the hint and end the process at once, while its threads are still computing."""
        notes.print(self.hint or "Stopped.")
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(INTERRUPTED)


@contextmanager
def stopping_on_interrupt(*, resumable: bool = False) -> Iterator[StopRequest]:
    """Turn the first Ctrl-C or SIGTERM into a request to stop; the second one interrupts.

    Python runs signal handlers between two instructions of the main thread, thus not while a
    compiled function is running there. A thread that the interpreter wakes up at once ends a
    resumable job after `EXIT_TIMEOUT` at the latest.

    Parameters
    ----------
    resumable
        Whether the job loses nothing that matters if the process is killed.
    """
    stop = StopRequest()

    def request(number: int, _frame: FrameType | None) -> None:
        if resumable:
            return  # the thread does the rest
        if stop.is_set():
            raise KeyboardInterrupt
        stop.set()
        notes.print("Stopping after the current steps ...")
        signal.signal(number, signal.default_int_handler)

    before = {number: signal.signal(number, request) for number in SIGNALS}
    try:
        if resumable:
            with _watched(stop):
                yield stop
        else:
            yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def _watched(stop: StopRequest) -> Iterator[None]:
    """End the process soon after the first signal and at once after the second."""
    reader, writer = socket.socketpair()
    writer.setblocking(False)  # required by `set_wakeup_fd`
    ended = threading.Event()

    def watch() -> None:
        if not _signalled(reader):
            return
        notes.print("Stopping ...")
        stop.set()
        reader.settimeout(0.1 if stop.hint is None else EXIT_TIMEOUT)
        try:
            insists = _signalled(reader)
        except TimeoutError:
            insists = True
        if insists and not ended.is_set():
            stop.exit()

    before = signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        signal.set_wakeup_fd(before)
        writer.close()
        thread.join()
        reader.close()


def _signalled(reader: socket.socket) -> bool:
    """Wait for a signal of interest; return False once the other end is closed."""
    while data := reader.recv(1):
        if data[0] in SIGNALS:
            return True
    return False
