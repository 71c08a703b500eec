"""Commands, schedulers and workers in processes of their own, none of which outlives a test."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

DEADLINE = 120.0
QUICK = {
    "DASK_DISTRIBUTED__SCHEDULER__WORKER_TTL": "5s",
    "DASK_DISTRIBUTED__COMM__TIMEOUTS__TCP": "12s",
    "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "5s",
    "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "20",
}
"""Dask's patience, made short; its probes of a connection need 11 seconds at least."""


@contextlib.contextmanager
def process(
    command: Sequence[object], log: Path, within: Sequence[str] = (), **environment: str
) -> Iterator[subprocess.Popen[bytes]]:
    """Start a command in a session of its own; kill that session at the end."""
    with log.open("wb") as told:
        started = subprocess.Popen(
            [*within, sys.executable, *map(str, command)],
            stdin=subprocess.DEVNULL, stdout=told, stderr=told, start_new_session=True,
            env={**os.environ, **QUICK, **environment},
        )  # fmt: skip
    try:
        yield started
    finally:
        for pid in session(started.pid):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        started.wait(DEADLINE)


def campaign(*words: object) -> list[object]:
    """Return the command `bellcrank campaign` with these words."""
    return ["-m", "bellcrank", "campaign", *words]


def session(leader: int) -> list[int]:
    """Return the living processes of a session, its leader among them."""
    return [pid for pid, fields in _processes() if int(fields[3]) == leader]


def workers_of(leader: int) -> list[int]:
    """Return the worker processes of a command."""
    found = []
    for pid in session(leader):
        with contextlib.suppress(OSError):
            if b"engines.worker" in Path(f"/proc/{pid}/cmdline").read_bytes():
                found.append(pid)
    return found


def _processes() -> Iterator[tuple[int, list[str]]]:
    for path in Path("/proc").iterdir():
        if path.name.isdigit():
            with contextlib.suppress(OSError):
                fields = (path / "stat").read_text().rpartition(")")[2].split()
                if fields[0] != "Z":
                    yield int(path.name), fields


def wait_until(
    happened: Callable[[], object], running: subprocess.Popen[bytes] | None = None
) -> None:
    """Return as soon as something has happened; fail if it never does."""
    end = time.monotonic() + DEADLINE
    while not happened():
        ended = running is not None and running.poll() is not None
        assert not ended or happened(), "the process ended early"
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.01)


def segment_count(folder: Path) -> int:
    return len(list(folder.glob("segments/*/*.parquet")))


@contextlib.contextmanager
def scheduler(
    place: Path, host: str = "127.0.0.1", within: Sequence[str] = (), *more: str
) -> Iterator[str]:
    """Start a scheduler; yield its address."""
    log = place / "scheduler.log"
    command = ["-m", "dask", "scheduler", "--host", host, "--port", "0", "--no-dashboard", *more]
    with process(command, log, within) as running:
        pattern = re.compile(rf"Scheduler at: *(t\w\w://{re.escape(host)}:\d+)")
        wait_until(lambda: pattern.search(log.read_text()), running)
        match = pattern.search(log.read_text())
        assert match
        yield match[1]


@contextlib.contextmanager
def worker(
    place: Path, address: str, name: str, within: Sequence[str] = (), *more: str
) -> Iterator[subprocess.Popen[bytes]]:
    """Start a worker of one thread; yield its process once it is registered."""
    log = place / f"{name}.log"
    command = [
        "-m", "dask", "worker", address, "--nthreads", "1", "--no-nanny", "--name", name,
        "--no-dashboard", "--memory-limit", "0", "--local-directory", place, *more,
    ]  # fmt: skip
    with process(command, log, within) as running:
        wait_until(lambda: "Registered to" in log.read_text(), running)
        yield running
