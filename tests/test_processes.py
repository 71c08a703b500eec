"""Functions that are computed in processes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.processes import FunctionProcess, FunctionProcesses

if TYPE_CHECKING:
    from collections.abc import Callable


def send_then_fail(send: Callable[[object], None], error: Exception) -> None:
    send(np.arange(3))
    raise error


def send_then_wait(send: Callable[[object], None]) -> None:
    send("waiting")
    time.sleep(60.0)


def test_values_come_before_the_error_of_the_process() -> None:
    process = FunctionProcess(__name__, "send_then_fail", InvalidSettings("steps: too few"))
    values = iter(process)
    assert next(values).tolist() == [0, 1, 2]
    with pytest.raises(InvalidSettings, match="steps: too few"):
        next(values)


def test_an_error_that_is_no_error_of_bellcrank_keeps_its_name() -> None:
    values = iter(FunctionProcess(__name__, "send_then_fail", ZeroDivisionError("by zero")))
    next(values)
    with pytest.raises(RuntimeError, match="ZeroDivisionError: by zero"):
        next(values)


def test_a_killed_process_ends_at_once() -> None:
    process = FunctionProcess(__name__, "send_then_wait")
    values = iter(process)
    assert next(values) == "waiting"
    start = time.monotonic()
    process.kill()
    with pytest.raises(RuntimeError, match="ended with status"):
        next(values)
    assert time.monotonic() - start < 30.0


def send_own_number(send: Callable[[object], None]) -> None:
    send(os.getpid())
    time.sleep(60.0)


PARENT = """
import time
from bellcrank.processes import FunctionProcess
print(next(iter(FunctionProcess("tests.test_processes", "send_own_number"))), flush=True)
time.sleep(60.0)
"""


def is_running(process: int) -> bool:
    """Whether a process exists and is not a zombie."""
    try:
        status = Path(f"/proc/{process}/stat").read_text(encoding="utf-8")
    except FileNotFoundError:
        return False
    return status.rpartition(")")[2].split()[0] != "Z"


def test_a_process_ends_when_its_parent_is_killed() -> None:
    parent = subprocess.Popen([sys.executable, "-c", PARENT], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    number = int(parent.stdout.readline())
    assert is_running(number)
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    parent.stdout.close()
    end = time.monotonic() + 20.0
    while is_running(number) and time.monotonic() < end:
        time.sleep(0.1)
    assert not is_running(number)


def send_or_fail(send: Callable[[object], None], number: int) -> None:
    if number < 0:
        raise InvalidSettings(f"{number}: negative")
    for part in range(3):
        send((number, part))


def test_several_processes_send_to_one_receiver() -> None:
    found: list[tuple[int, object]] = []
    jobs = [(number,) for number in range(4)]
    FunctionProcesses(__name__, "send_or_fail", jobs, lambda *sent: found.append(sent)).run(
        2, threading.Event()
    )
    assert sorted(found) == [(job, (job, part)) for job in range(4) for part in range(3)]


def test_the_error_of_one_process_is_raised_and_ends_all() -> None:
    jobs = [(0,), (-1,), (2,)]
    own = FunctionProcesses(__name__, "send_or_fail", jobs, lambda _job, _value: None)
    with pytest.raises(InvalidSettings, match="-1: negative"):
        own.run(2, threading.Event())


def test_processes_end_when_the_event_is_set() -> None:
    stop = threading.Event()
    jobs: list[tuple[object, ...]] = [(), ()]
    own = FunctionProcesses(__name__, "send_then_wait", jobs, lambda _job, _value: stop.set())
    start = time.monotonic()
    own.run(2, stop)
    assert time.monotonic() - start < 30.0
