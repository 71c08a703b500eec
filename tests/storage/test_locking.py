"""Locks: one at a time, whoever dies."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from typing import TYPE_CHECKING

import pytest

from bellcrank.errors import StorageError
from bellcrank.storage.locking import locked

if TYPE_CHECKING:
    from pathlib import Path

HOLD = """
import sys, time
from pathlib import Path
from bellcrank.storage.locking import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def holder(path: Path) -> subprocess.Popen[str]:
    """Another process that holds a lock."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(path)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    return process


def test_what_another_process_holds_is_refused_until_it_is_killed(tmp_path: Path) -> None:
    path = tmp_path / ".lock"
    process = holder(path)
    try:
        with pytest.raises(StorageError, match="taken"), locked(path, "taken"):
            pass
    finally:
        process.send_signal(signal.SIGKILL)
        process.communicate()
    assert path.exists()
    with locked(path, "taken"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_many_that_wait_go_one_at_a_time(tmp_path: Path) -> None:
    path, inside, seen = tmp_path / ".lock", threading.Lock(), []

    def work(number: int) -> None:
        for _ in range(20):
            with locked(path):
                assert inside.acquire(blocking=False)
                seen.append(number)
                inside.release()

    threads = [threading.Thread(target=work, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(seen) == 80
    assert list(tmp_path.iterdir()) == []


def test_an_error_inside_lets_go(tmp_path: Path) -> None:
    path = tmp_path / ".lock"
    with pytest.raises(KeyError), locked(path, "taken"):
        raise KeyError
    with locked(path, "taken"):
        pass


def test_a_folder_that_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(StorageError, match="cannot be written"), locked(tmp_path / "no" / ".lock"):
        pass
