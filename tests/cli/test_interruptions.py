"""A job resumes after Ctrl-C, a kill or a full disk, and ends with the same bits."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import json
import os
import random
import resource
import signal
import subprocess
import sys
import termios
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
    refusal,
    table,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from .helpers import Outcome

GATED = f"""
import os
from bellcrank.cli import main, stopping
from bellcrank.search import chain_process, parallel

stopping.EXIT_TIMEOUT = 30.0  # however busy the machine is, the complete blocks are stored
parallel.SEGMENT_STEPS = {BLOCK}
advance = chain_process.advance_chain

def advance_at_the_gate(*words):
    os.read(0, 1)
    return advance(*words)

chain_process.advance_chain = advance_at_the_gate
main()
"""
"""The command, whose chains wait for a byte before each block, or for the end of input."""

GATED_END = """
import os, sys
from bellcrank.cli import main
from bellcrank.workflows import design

def compare(*words, **options):
    print("comparing", file=sys.stderr, flush=True)
    while os.read(0, 1):
        pass

design.conclude = compare
main()
"""
"""The command, which waits for the end of input when it compares the best designs."""

DEADLINE = 60.0


def wait_until(happened: Callable[[], bool], job: subprocess.Popen[bytes]) -> None:
    """Return as soon as something has happened; fail if it never can."""
    end = time.monotonic() + DEADLINE
    while not happened():
        assert job.poll() is None or happened(), "the job ended early"
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.001)


def segments(folder: Path) -> int:
    return len(list(folder.glob("segments/*/*.parquet")))


@contextlib.contextmanager
def job(folder: Path, *words: object, program: str = GATED) -> Iterator[subprocess.Popen[bytes]]:
    """Run `bellcrank design` at the gate, in a process group of its own; end it afterwards."""
    command = [sys.executable, "-c", program, "design", *map(str, words)]
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


def waiting(running: subprocess.Popen[bytes]) -> int:
    """Return the number of bytes that no chain has read yet."""
    assert running.stdin is not None
    count = bytearray(4)
    fcntl.ioctl(running.stdin, termios.FIONREAD, count)
    return int.from_bytes(count, sys.byteorder)


def let_through(running: subprocess.Popen[bytes], blocks: int) -> None:
    assert running.stdin is not None
    running.stdin.write(b"." * blocks)
    running.stdin.flush()


def open_gate(running: subprocess.Popen[bytes]) -> None:
    assert running.stdin is not None
    running.stdin.close()


# Ctrl-C and SIGTERM.


@pytest.mark.parametrize(
    "number",
    [signal.SIGTERM, pytest.param(signal.SIGINT, marks=pytest.mark.slow)],
    ids=["sigterm", "ctrl-c"],
)
def test_a_search_stops_in_the_middle_of_a_block_and_resumes_to_the_same_end(
    tmp_path: Path, whole: Path, number: signal.Signals
) -> None:
    folder, log = tmp_path / "run", tmp_path / "log"
    with job(folder, PROBLEM, *SETTINGS, "--out", folder, "--workers", 2) as running:
        let_through(running, 3)
        wait_until(lambda: segments(folder) == 3, running)
        # Both chains wait for ever in their next block.
        os.killpg(running.pid, number)
        assert running.wait(DEADLINE) == 130
    said = log.read_text()
    assert f"bellcrank design --resume {folder}" in said
    assert "Traceback" not in said
    assert 3 <= segments(folder) < BLOCKS
    outcome = call("design", "--resume", folder)
    assert outcome.code == 0, outcome.err
    assert_same_run(folder, whole)


FRAMES = f"""
from bellcrank.cli import main
from bellcrank.search import parallel

parallel.SEGMENT_STEPS = {BLOCK}
main()
"""
"""The command, whose chains of frames run in processes and are stored after each block."""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL], ids=["sigterm", "kill"])
def test_a_search_of_frames_stops_with_its_processes_and_resumes_to_the_same_end(
    tmp_path: Path, number: signal.Signals
) -> None:
    folder, whole = tmp_path / "run", tmp_path / "whole"
    words = ("scaling-8", "--steps", 3000, "--goal", "mass <= 0.9")
    with job(folder, *words, "--out", folder, "--workers", 2, program=FRAMES) as running:
        wait_until(lambda: segments(folder) >= 2, running)
        os.kill(running.pid, number)
        assert running.wait(DEADLINE) == (130 if number == signal.SIGTERM else -number)
        left = ["pgrep", "-g", str(running.pid)]
        end = time.monotonic() + DEADLINE
        while subprocess.run(left, check=False, capture_output=True).stdout:
            assert time.monotonic() < end, "a process of a chain is left"
            time.sleep(0.05)
    assert call("design", "--resume", folder, "--workers", 2).code in {0, 3}
    assert call("design", *words, "--out", whole, "--workers", 1).code in {0, 3}
    found, expected = table(folder), table(whole)
    assert all(found[name] == column for name, column in expected.items())
    assert design_of(folder) == design_of(whole)


@pytest.mark.slow
def test_complete_blocks_that_are_not_stored_yet_survive_a_stop(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    rare = GATED.replace(f"SEGMENT_STEPS = {BLOCK}", f"SEGMENT_STEPS = {100 * BLOCK}")
    words = (PROBLEM, *SETTINGS, "--out", folder, "--workers", 1)
    with job(folder, *words, program=rare) as running:
        let_through(running, 2)
        wait_until(lambda: waiting(running) == 0, running)
        os.killpg(running.pid, signal.SIGTERM)
        assert running.wait(DEADLINE) == 130
    assert json.loads((folder / "run.json").read_text())["status"] == "stopped"
    assert segments(folder) == 1


@pytest.mark.slow
def test_a_stop_while_the_best_designs_are_compared_ends_the_process(
    tmp_path: Path, whole: Path
) -> None:
    folder, log = tmp_path / "run", tmp_path / "log"
    words = (PROBLEM, *SETTINGS, "--out", folder, "--workers", 2)
    with job(folder, *words, program=GATED_END) as running:
        wait_until(lambda: segments(folder) == 2 and b"comparing" in log.read_bytes(), running)
        os.killpg(running.pid, signal.SIGTERM)
        assert running.wait(DEADLINE) == 130
    assert f"bellcrank design --resume {folder}" in log.read_text()
    assert call("design", "--resume", folder).code == 0
    assert_same_run(folder, whole)


@pytest.mark.slow
def test_a_second_ctrl_c_ends_the_process_at_once(tmp_path: Path, whole: Path) -> None:
    folder, log = tmp_path / "run", tmp_path / "log"
    with job(folder, PROBLEM, *SETTINGS, "--out", folder, "--workers", 2) as running:
        let_through(running, 3)
        wait_until(lambda: segments(folder) == 3, running)
        os.killpg(running.pid, signal.SIGINT)
        wait_until(lambda: b"Stopping" in log.read_bytes(), running)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(running.pid, signal.SIGINT)
        assert running.wait(DEADLINE) == 130
    assert "Traceback" not in log.read_text()
    assert segments(folder) >= 3
    assert call("design", "--resume", folder).code == 0
    assert_same_run(folder, whole)


# Two runs in one folder, and names of folders.


def test_a_second_run_in_the_same_folder_names_the_process_that_works_there(
    tmp_path: Path,
) -> None:
    folder = tmp_path / "run"
    with job(folder, PROBLEM, *SETTINGS, "--out", folder) as running:
        let_through(running, 1)
        wait_until(lambda: segments(folder) == 1, running)
        for words in ((PROBLEM, "--out", folder), ("--resume", folder)):
            line = refusal("design", *words, code=1, folder=folder)
            assert f"{folder}: process {running.pid} is working in this folder" in line
            assert "--out" in line


def test_a_second_design_of_the_same_name_goes_into_a_numbered_folder(here: Path) -> None:
    words = ("design", PROBLEM, "--steps", "20", "--chains", "1", "--search", "paper")
    # So short a search may end without a design that works (exit code 3).
    assert call(*words).code in {0, 3}
    outcome = call(*words, "--goal", "mass <= 0.99")
    assert outcome.code in {0, 3}, outcome.err
    assert f"{PROBLEM}-2/" in outcome.err
    assert f"{PROBLEM}-2/" in outcome.out
    assert (here / f"{PROBLEM}-2" / "design.json").exists()


@pytest.mark.parametrize("command", ["export", "validate", "evaluate"])
def test_an_unfinished_run_is_refused_with_the_command_that_finishes_it(
    here: Path, half: Path, command: str
) -> None:
    half.rename(here / PROBLEM)
    words = (command, PROBLEM, "part.stl") if command == "export" else (command, PROBLEM)
    line = refusal(*words)
    assert f"bellcrank design --resume {PROBLEM}" in line


# kill -9.


@pytest.mark.slow
def test_a_job_killed_again_and_again_ends_the_same(tmp_path: Path, whole: Path) -> None:
    folder = tmp_path / "run"
    words: tuple[object, ...] = (PROBLEM, *SETTINGS, "--out", folder)
    chance = random.Random(20)
    for _ in range(3):
        before = segments(folder)
        with job(folder, *words, "--workers", 2) as running:
            blocks = chance.randint(1, 3)
            let_through(running, blocks)
            seen = before + chance.randint(0, blocks)
            wait_until(lambda seen=seen: seen <= segments(folder) and has_begun(folder), running)
            os.killpg(running.pid, signal.SIGKILL)
            assert running.wait(DEADLINE) == -signal.SIGKILL
        assert not (folder / "history.parquet").exists()
        assert segments(folder) >= seen
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


# Two calls for each file: its content and its name. The description; six segments; ...
@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.parametrize("workers", [1, 3])
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
    assert 0 < segments(half) < BLOCKS
    assert call("design", "--resume", half, "--workers", 3).code == 0
    assert_same_run(half, whole)
