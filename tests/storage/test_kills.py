"""A run goes on after a kill at any instant, and nothing is lost or doubled."""

from __future__ import annotations

import contextlib
import itertools
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest import mock

import pytest

from bellcrank.errors import OutputExists
from bellcrank.storage import RunFolder

from .helpers import SETTINGS, assert_holds, files, fill, proposals

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from bellcrank.model import Problem

STEPS = 20
CALLS = ("mkdir", "fsync", "link", "replace", "unlink", "rmdir", "open")


class Killed(BaseException):
    """Stands for the end of the process."""


@contextlib.contextmanager
def killed_at(instant: int, *, before: bool) -> Iterator[list[str]]:
    """End the process around the call to the system of that number.

    A dead process does nothing any more: all later calls fail too, so that no clean-up
    that a real kill would prevent takes place.
    """
    calls: list[str] = []
    dead = False

    def around(name: str, real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **options: Any) -> Any:
            nonlocal dead
            if dead:
                raise Killed
            calls.append(name)
            dead = len(calls) > instant
            if dead and before:
                raise Killed
            result = real(*args, **options)
            if dead:
                raise Killed
            return result

        return call

    with contextlib.ExitStack() as stack:
        for name in CALLS:
            stack.enter_context(mock.patch.object(os, name, around(name, getattr(os, name))))
        yield calls


def whole_story(folder: Path, problem: Problem) -> None:
    """Begin or go on, to the end, as `bellcrank design` does."""
    try:
        run = RunFolder.create(folder, problem, SETTINGS)
    except OutputExists:
        run = RunFolder.open(folder)
        run.status = "running"
    fill(run, STEPS)
    run.finish()


@pytest.mark.slow
@pytest.mark.parametrize("before", [True, False], ids=["before", "after"])
def test_a_run_goes_on_after_a_kill_around_any_call_to_the_system(
    tmp_path: Path, problem: Problem, before: bool
) -> None:
    whole_story(tmp_path / "uninterrupted", problem)
    expected = RunFolder.open(tmp_path / "uninterrupted")
    seen: set[str] = set()
    for instant in itertools.count():
        folder = tmp_path / str(instant)
        try:
            with killed_at(instant, before=before) as calls:
                whole_story(folder, problem)
        except Killed:
            seen.add(calls[-1])
        else:
            break
        if (folder / "run.json").exists():
            assert_readable(folder, problem)
        whole_story(folder, problem)
        run = RunFolder.open(folder)
        assert_holds(run, STEPS)
        assert run.status == "finished"
        assert [run.progress(chain) for chain in (0, 1)] == [
            expected.progress(chain) for chain in (0, 1)
        ]
        assert list(files(folder)) == ["history.parquet", "run.json"]
    assert instant > 40
    assert seen == set(CALLS)


def assert_readable(folder: Path, problem: Problem) -> None:
    """Check that what a kill left can be read, and that reading changes nothing."""
    before = files(folder)
    run = RunFolder.open(folder)
    for chain in run.chains:
        steps = run.read(chain, ["step"])["step"].tolist()
        assert steps == list(range(len(steps)))
    assert files(folder) == before


WRITER = """
import sys
sys.path.insert(0, sys.argv[2])
from helpers import proposals
from bellcrank.storage import RunFolder
run = RunFolder.open(sys.argv[1])
step, _ = run.progress(0)
while True:
    run.append(0, step, proposals(run.problem, 0, step), {"step": step + 10, "chain": 0})
    step += 10
    print("stored", flush=True)
"""


def test_a_real_kill_loses_nothing_that_was_stored(run: RunFolder) -> None:
    command = [sys.executable, "-c", WRITER, str(run.path), str(Path(__file__).parent)]
    reached = 0
    for wait in (0.02, 0.083):
        with subprocess.Popen(command, stdout=subprocess.PIPE) as writer:
            assert writer.stdout is not None
            assert writer.stdout.readline() == b"stored\n"
            time.sleep(wait)
            writer.send_signal(signal.SIGKILL)
            assert writer.wait() == -signal.SIGKILL
        opened = RunFolder.open(run.path)
        step, state = opened.progress(0)
        assert step > reached
        assert state == {"step": step, "chain": 0}
        reached = step
        assert_holds(opened, step, chains=1)
    run.finish()
    assert_holds(run, reached, chains=1)


def test_the_first_of_two_writers_wins(run: RunFolder) -> None:
    other = RunFolder.open(run.path)
    run.append(0, 0, proposals(run.problem, 0, 0), {"step": 10, "chain": 0})
    with pytest.raises(OutputExists, match="another process"):
        other.append(0, 0, proposals(run.problem, 9, 0), {"step": 10, "chain": 0})
    assert_holds(run, 10, chains=1)


def test_the_first_writer_wins_even_if_both_looked_at_the_same_time(
    run: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = run.path / "segments" / "000" / "00000000.parquet"
    real = os.fsync

    def other_is_faster(descriptor: int) -> None:
        monkeypatch.setattr(os, "fsync", real)
        RunFolder.open(run.path).append(
            0, 0, proposals(run.problem, 0, 0), {"step": 10, "chain": 0}
        )

    monkeypatch.setattr(os, "fsync", other_is_faster)
    with pytest.raises(OutputExists, match="another process"):
        run.append(0, 0, proposals(run.problem, 9, 0), {"step": 10, "chain": 0})
    assert_holds(run, 10, chains=1)
    assert list(files(path.parent)) == [path.name]


def test_chains_can_be_written_by_several_threads(run: RunFolder) -> None:
    def work(chain: int) -> None:
        for step in range(0, 40, 10):
            rows = proposals(run.problem, chain, step)
            run.append(chain, step, rows, {"step": step + 10, "chain": chain})

    threads = [threading.Thread(target=work, args=(chain,)) for chain in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert_holds(run, chains=6)
    run.finish()
    assert_holds(run, chains=6)


def test_only_the_leftovers_of_writers_are_cleared_away(run: RunFolder) -> None:
    fill(run)
    folder = run.path / "segments" / "000"
    leftovers = [folder / ".00000040.parquet.5ad0c2e7", folder / ".00000010.parquet.00ff00ff"]
    strangers = [
        folder / "notes.txt", folder / ".00000040.parquet.swp", folder / "copy.parquet",
        run.path / ".hidden", run.path / "design.json", run.path / "segments" / "README",
        run.path / "segments" / "misc" / "00000000.parquet",
    ]  # fmt: skip
    (run.path / "segments" / "misc").mkdir()
    for path in (*leftovers, *strangers):
        path.write_bytes(b"half")
    assert run.progress(0)[0] == 40
    assert not any(path.exists() for path in leftovers)
    assert_holds(run)
    run.finish()
    assert_holds(run)
    assert all(path.read_bytes() == b"half" for path in strangers)
    assert not list(folder.glob("0*"))
