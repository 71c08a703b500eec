"""A job goes on after Ctrl-C, a kill or a full disk, to the same end to the last bit."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING
from unittest import mock

import pytest

from bellcrank import __version__
from bellcrank.provenance import provenance
from bellcrank.search import BLOCK, parallel

from .helpers import (
    BLOCKS,
    OTHER_VERSION,
    PROBLEM,
    SETTINGS,
    assert_same_run,
    call,
    design_of,
    failing_from,
    files,
    table,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from .helpers import Outcome

GATED = f"""
import os
from bellcrank.cli import main
from bellcrank.search import parallel

parallel.SEGMENT_STEPS = {BLOCK}
advance = parallel.advance_chain

def advance_at_the_gate(*words):
    os.read(0, 1)
    return advance(*words)

parallel.advance_chain = advance_at_the_gate
main()
"""
"""The command, whose chains wait for a byte before each block, or for the end of input."""

DEADLINE = 60.0


def wait_until(happened: Callable[[], bool], job: subprocess.Popen[bytes]) -> None:
    """Return as soon as something has happened; fail if it never can."""
    end = time.monotonic() + DEADLINE
    while not happened():
        assert job.poll() is None or happened(), "the job ended early"
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.001)


def shards(folder: Path) -> int:
    return len(list(folder.glob("segments/*/*.parquet")))


@contextlib.contextmanager
def job(folder: Path, *words: object) -> Iterator[subprocess.Popen[bytes]]:
    """Run `bellcrank design` at the gate, in a process group of its own; end it afterwards."""
    command = [sys.executable, "-c", GATED, "design", *map(str, words)]
    log = folder.with_name("log")
    with (
        log.open("wb") as told,
        subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=told, stderr=told, start_new_session=True
        ) as started,
    ):
        try:
            yield started
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(started.pid, signal.SIGKILL)


def let_through(running: subprocess.Popen[bytes], blocks: int) -> None:
    assert running.stdin is not None
    running.stdin.write(b"." * blocks)
    running.stdin.flush()


def open_gate(running: subprocess.Popen[bytes]) -> None:
    assert running.stdin is not None
    running.stdin.close()


# Ctrl-C.


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["ctrl-c", "kill"])
def test_a_search_stops_on_request_says_how_to_go_on_and_ends_the_same(
    tmp_path: Path, whole: Path, number: signal.Signals
) -> None:
    folder, log = tmp_path / "run", tmp_path / "log"
    with job(folder, PROBLEM, *SETTINGS, "--out", folder, "--workers", 2) as running:
        let_through(running, 3)
        wait_until(lambda: shards(folder) == 3, running)
        os.killpg(running.pid, number)
        wait_until(lambda: b"Stopping" in log.read_bytes(), running)
        open_gate(running)
        assert running.wait(DEADLINE) == 130
    said = log.read_text()
    assert said.startswith("Stopping after the steps at hand ...\n")
    assert f"bellcrank design --resume {folder}" in said
    assert "Traceback" not in said
    assert json.loads((folder / "run.json").read_text())["status"] == "stopped"
    assert 3 <= shards(folder) < BLOCKS
    outcome = call("design", "--resume", folder)
    assert outcome.code == 0, outcome.err
    assert_same_run(folder, whole)


def test_a_second_ctrl_c_insists_and_what_was_done_is_kept_even_then(
    tmp_path: Path, whole: Path
) -> None:
    folder, log = tmp_path / "run", tmp_path / "log"
    with job(folder, PROBLEM, *SETTINGS, "--out", folder, "--workers", 2) as running:
        let_through(running, 3)
        wait_until(lambda: shards(folder) == 3, running)
        os.killpg(running.pid, signal.SIGINT)
        wait_until(lambda: b"Stopping" in log.read_bytes(), running)
        os.killpg(running.pid, signal.SIGINT)
        open_gate(running)
        assert running.wait(DEADLINE) == 130
    assert "Traceback" not in log.read_text()
    assert shards(folder) >= 3
    assert call("design", "--resume", folder).code == 0
    assert_same_run(folder, whole)


# kill -9.


def test_a_job_killed_again_and_again_ends_the_same(tmp_path: Path, whole: Path) -> None:
    folder = tmp_path / "run"
    words: tuple[object, ...] = (PROBLEM, *SETTINGS, "--out", folder)
    chance = random.Random(20)
    for _ in range(3):
        before = shards(folder)
        with job(folder, *words, "--workers", 2) as running:
            blocks = chance.randint(1, 3)
            let_through(running, blocks)
            seen = before + chance.randint(0, blocks)
            wait_until(lambda seen=seen: seen <= shards(folder) and has_begun(folder), running)
            os.killpg(running.pid, signal.SIGKILL)
            assert running.wait(DEADLINE) == -signal.SIGKILL
        assert not (folder / "history.parquet").exists()
        assert shards(folder) >= seen
        words = ("--resume", folder)
    for last in ("motion.png", "design.json", "history.parquet"):
        with job(folder, *words, "--workers", 2) as running:
            open_gate(running)
            wait_until(lambda last=last: (folder / last).exists(), running)
            os.killpg(running.pid, signal.SIGKILL)
            running.wait(DEADLINE)
    assert call("design", *words).code == 0
    assert_same_run(folder, whole)


def has_begun(folder: Path) -> bool:
    return (folder / "run.json").exists()


# A full disk.


def go_on(folder: Path) -> None:
    """Resume the run in a folder; begin it if even that was impossible before."""
    words = ("--resume", folder) if has_begun(folder) else (PROBLEM, *SETTINGS, "--out", folder)
    outcome = call("design", *words)
    assert outcome.code == 0, outcome.err


def assert_failed(outcome: Outcome, message: str) -> None:
    """Check that a job ended with one line."""
    assert outcome.code == 1
    assert outcome.out == ""
    assert outcome.complaints.startswith("error: ")
    assert message in outcome.complaints
    assert outcome.complaints.count("\n") == 1


# Two calls for each file: its content and its name. The description; six shards; ...
@pytest.mark.parametrize("instant", [0, 2, 7, 14])
def test_a_job_goes_on_after_a_full_disk(tmp_path: Path, whole: Path, instant: int) -> None:
    folder = tmp_path / "run"
    with (
        mock.patch.object(parallel, "SEGMENT_STEPS", 2 * BLOCK),
        failing_from("fsync", instant, errno.ENOSPC),
    ):
        outcome = call("design", PROBLEM, *SETTINGS, "--out", folder)
    assert_failed(outcome, "(No space left on device)")
    assert not (folder / "history.parquet").exists()
    assert not [name for name in files(folder) if "/." in f"/{name}"]
    go_on(folder)
    assert_same_run(folder, whole)


@contextlib.contextmanager
def no_file_larger_than(size: int) -> Iterator[None]:
    """Let the system itself refuse to write more than so many bytes into a file."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("name", ["run.json", "history.parquet", "efficiency.png"])
def test_a_job_goes_on_where_the_system_refused_to_write(
    tmp_path: Path, whole: Path, name: str
) -> None:
    folder = tmp_path / "run"
    with no_file_larger_than((whole / name).stat().st_size // 2):
        outcome = call("design", PROBLEM, *SETTINGS, "--out", folder)
    assert_failed(outcome, "(File too large)")
    assert not (folder / name).exists()
    go_on(folder)
    assert_same_run(folder, whole)


def test_results_survive_a_full_disk_while_they_are_written_again(copy: Path, whole: Path) -> None:
    with failing_from("fsync", 0, errno.ENOSPC):
        outcome = call("design", "--resume", copy)
    assert_failed(outcome, "(No space left on device)")
    assert table(copy) == table(whole)
    assert design_of(copy) == design_of(whole)
    go_on(copy)
    assert_same_run(copy, whole)


# Not interrupted at all.


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_the_number_of_workers_changes_nothing(tmp_path: Path, whole: Path, workers: int) -> None:
    folder = tmp_path / "run"
    outcome = call("design", PROBLEM, *SETTINGS, "--out", folder, "--workers", workers)
    assert outcome.code == 0, outcome.err
    assert_same_run(folder, whole)


def test_another_seed_changes_the_search(tmp_path: Path, whole: Path) -> None:
    folder = tmp_path / "run"
    words = ("--steps", "1500", "--chains", "2", "--seed", "6")
    assert call("design", PROBLEM, *words, "--out", folder).code == 0
    assert table(folder)["mask"] != table(whole)["mask"]


def test_resuming_a_finished_job_gives_the_same_again(copy: Path, whole: Path) -> None:
    outcome = call("design", "--resume", copy)
    assert outcome.code == 0, outcome.err
    assert outcome.complaints == ""
    assert "efficiency" in outcome.out
    assert_same_run(copy, whole)


def test_a_job_resumed_with_another_version_says_so(copy: Path, whole: Path) -> None:
    def of_tomorrow(**more: object) -> dict[str, object]:
        return provenance(**more) | {"version": "9.9"}

    with mock.patch("bellcrank.provenance.provenance", of_tomorrow):
        outcome = call("design", "--resume", copy)
    assert outcome.code == 0
    assert outcome.err.startswith(f"{OTHER_VERSION}{__version__}")
    assert outcome.err.count("\n") == 1
    assert_same_run(copy, whole)


def test_a_half_done_job_is_resumed_to_the_same_end(half: Path, whole: Path) -> None:
    assert 0 < shards(half) < BLOCKS
    assert call("design", "--resume", half, "--workers", 3).code == 0
    assert_same_run(half, whole)
