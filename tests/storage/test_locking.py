"""Lock files exclude other processes and end with their holder."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from typing import TYPE_CHECKING

import pytest

from bellcrank.errors import StorageError
from bellcrank.storage.locking import lock_holder, locked

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
    """Return another process that holds a lock."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(path)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    return process


def test_the_lock_of_another_process_is_refused_until_that_is_killed(
    tmp_path: Path,
) -> None:
    path = tmp_path / ".lock"
    process = holder(path)
    try:
        number = f"process {process.pid}"
        assert lock_holder(path) == number
        with pytest.raises(StorageError, match=f"{number} .*--out"), locked(path, wait=False):
            pass
    finally:
        process.send_signal(signal.SIGKILL)
        process.communicate()
    assert path.exists()
    assert lock_holder(path) is None
    with locked(path, wait=False):
        pass
    assert list(tmp_path.iterdir()) == []


def test_waiting_threads_get_the_lock_one_at_a_time(tmp_path: Path) -> None:
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


def test_an_error_inside_releases_the_lock(tmp_path: Path) -> None:
    path = tmp_path / ".lock"
    with pytest.raises(KeyError), locked(path, wait=False):
        raise KeyError
    with locked(path, wait=False):
        pass


def test_a_missing_folder_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(StorageError, match="cannot be written"), locked(tmp_path / "no" / ".lock"):
        pass
