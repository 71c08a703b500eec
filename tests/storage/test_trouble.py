"""Full disks, folders in use or without permission, damaged files: one clear error each."""

from __future__ import annotations

import contextlib
import errno
import itertools
import json
import os
import subprocess
from typing import TYPE_CHECKING, Any
from unittest import mock

import pytest

from bellcrank.errors import CorruptRun, InvalidFile, InvalidSettings, OutputExists, StorageError
from bellcrank.storage import RunFolder

from .helpers import SETTINGS, assert_holds, files, fill, proposals

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from bellcrank.model import Problem


# Full disk and closed folders.


@contextlib.contextmanager
def full_from(instant: int) -> Iterator[None]:
    """Let the disk be full from the call of that number on; deleting stays possible."""
    count = itertools.count()

    def refuse(real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **options: Any) -> Any:
            if next(count) >= instant:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return real(*args, **options)

        return call

    with contextlib.ExitStack() as stack:
        for name in ("mkdir", "fsync", "link", "replace", "open"):
            stack.enter_context(mock.patch.object(os, name, refuse(getattr(os, name))))
        yield


# Making the folder and syncing it, the temporary file, its content, its name.
@pytest.mark.parametrize("instant", range(6))
def test_a_full_disk_at_any_instant_is_one_error_and_touches_nothing(
    run: RunFolder, instant: int
) -> None:
    fill(run, 20, chains=1)
    before = files(run.path)
    with full_from(instant), pytest.raises(StorageError) as caught:
        run.append(1, 0, proposals(run.problem, 1, 0), {"step": 10, "chain": 1})
    assert f"{run.path}/segments/001" in str(caught.value)
    assert "No space left on device" in str(caught.value)
    assert files(run.path) == before
    fill(run)
    assert_holds(run)


def test_a_full_disk_while_finishing_keeps_the_segments(run: RunFolder) -> None:
    fill(run)
    before = files(run.path)
    for instant in range(3):
        with full_from(instant), pytest.raises(StorageError, match="No space left"):
            run.finish()
        assert files(run.path) == before
    run.finish()
    assert_holds(run)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(folder)]
    try:
        subprocess.run(mount, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"mounting a small disk is not permitted here: {error}")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.slow
def test_a_disk_that_is_really_full_is_one_error_and_the_run_goes_on_later(
    small_disk: Path, problem: Problem
) -> None:
    run = RunFolder.create(small_disk / "run", problem, SETTINGS)
    with pytest.raises(StorageError, match="No space left on device"):
        fill(run, 10_000)
    step, state = run.progress(0)
    assert state == {"step": step, "chain": 0}
    assert_holds(run, step, chains=1)
    before = files(run.path)
    for kilobytes in itertools.count(256, 16):
        subprocess.run(["mount", "-o", f"remount,size={kilobytes}k", str(small_disk)], check=True)
        try:
            run.finish()
        except StorageError as error:
            message = str(error)
            assert files(run.path) == before
        else:
            break
    assert f"{run.path}/history.parquet: cannot be written (No space left on device)" in message
    assert kilobytes > 256
    assert_holds(run, step, chains=1)
    assert RunFolder.open(run.path).status == "finished"


def test_a_folder_that_cannot_be_made_is_one_error(tmp_path: Path, problem: Problem) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(StorageError, match=r"file/run: cannot be written \(Not a directory\)"):
        RunFolder.create(tmp_path / "file" / "run", problem, SETTINGS)
    with pytest.raises(OutputExists, match="file: is a file; choose another folder"):
        RunFolder.create(tmp_path / "file", problem, SETTINGS)
    assert (tmp_path / "file").read_text() == "in the way"


def test_a_folder_that_may_not_be_written_is_one_error(
    run: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    def closed(*args: object, **options: object) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(os, "open", closed)
    with pytest.raises(StorageError, match=r"\(Permission denied\); make the folder writable"):
        run.append(0, 0, proposals(run.problem, 0, 0), {})


# Folders that are taken.


def test_a_folder_with_a_run_is_not_written_over(run: RunFolder, problem: Problem) -> None:
    fill(run)
    before = files(run.path)
    with pytest.raises(OutputExists) as caught:
        RunFolder.create(run.path, problem, SETTINGS)
    assert str(caught.value).startswith(f"{run.path}: exists already")
    assert "--out" in str(caught.value)
    assert f"--resume {run.path}" in str(caught.value)
    assert files(run.path) == before


def test_a_folder_with_other_things_is_not_written_into(tmp_path: Path, problem: Problem) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(
        OutputExists, match=r"it holds thesis.tex\); choose another folder"
    ) as caught:
        RunFolder.create(tmp_path, problem, SETTINGS)
    assert "--resume" not in str(caught.value)


def test_an_empty_folder_is_used(tmp_path: Path, problem: Problem) -> None:
    RunFolder.create(tmp_path, problem, SETTINGS)
    assert RunFolder.open(tmp_path).settings == SETTINGS


# Runs that are not what they should be.


def test_a_missing_folder_and_one_without_a_run_are_told_apart(tmp_path: Path) -> None:
    with pytest.raises(InvalidFile, match="nowhere: no such folder"):
        RunFolder.open(tmp_path / "nowhere")
    with pytest.raises(InvalidFile, match=r"not the folder of a run: it has no run.json"):
        RunFolder.open(tmp_path)


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        ("{", CorruptRun, "not valid JSON"),
        ("[]", InvalidFile, "expected schema 'bellcrank/run/1', got None"),
        ('{"schema": "bellcrank/run/9"}', InvalidFile, "got 'bellcrank/run/9'"),
        ('{"schema": "bellcrank/run/1"}', CorruptRun, "key 'provenance' is missing"),
        (b"\xff\xfe", InvalidFile, "expected UTF-8 text"),
    ],
)
def test_a_damaged_description_is_named(
    run: RunFolder, text: str | bytes, error: type[Exception], message: str
) -> None:
    (run.path / "run.json").write_bytes(text.encode() if isinstance(text, str) else text)
    with pytest.raises(error, match=message) as caught:
        RunFolder.open(run.path)
    assert str(caught.value).startswith(f"{run.path}/run.json: ")


def change(run: RunFolder, key: str, value: object) -> None:
    path = run.path / "run.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {key: value}))


def test_settings_changed_by_hand_are_refused(run: RunFolder) -> None:
    change(run, "settings", SETTINGS | {"hot": 0.08})
    with pytest.raises(CorruptRun, match="was changed after the run had started"):
        RunFolder.open(run.path)


def test_an_unknown_status_is_refused(run: RunFolder) -> None:
    change(run, "status", "paused")
    with pytest.raises(CorruptRun, match="status: expected one of running, stopped, finished"):
        RunFolder.open(run.path)


def test_segments_of_another_run_are_refused(
    run: RunFolder, problem: Problem, tmp_path: Path
) -> None:
    other = RunFolder.create(tmp_path / "other", problem, SETTINGS | {"seed": 4})
    fill(other)
    (other.path / "segments").rename(run.path / "segments")
    with pytest.raises(CorruptRun, match=r"00000000.parquet: belongs to another run"):
        run.progress(0)


# Shards and histories that are damaged.


def segment(run: RunFolder, first_step: int, chain: int = 0) -> Path:
    return run.path / "segments" / f"{chain:03d}" / f"{first_step:08d}.parquet"


def damage(path: Path, how: str) -> None:
    data = bytearray(path.read_bytes())
    if how == "flipped":
        data[300] ^= 0x10
    elif how == "other state":
        data = data.replace(b'"chain": 0', b'"chain": 2')
    path.write_bytes({"empty": b"", "truncated": data[:-100]}.get(how, data))


@pytest.mark.parametrize("how", ["empty", "truncated", "other state"])
def test_a_damaged_segment_is_named_and_can_be_replaced(run: RunFolder, how: str) -> None:
    fill(run)
    damage(segment(run, 20), how)
    before = files(run.path)
    for attempt in (lambda: run.progress(0), lambda: run.read(0), run.finish):
        with pytest.raises(CorruptRun, match=r"00000020.parquet: damaged .* delete the damaged"):
            attempt()
    assert files(run.path) == before
    segment(run, 20).unlink()
    segment(run, 30).unlink()
    fill(run)
    assert_holds(run)


def test_a_single_flipped_bit_is_noticed_before_the_segments_are_deleted(run: RunFolder) -> None:
    fill(run)
    damage(segment(run, 10), "flipped")
    before = files(run.path)
    for attempt in (lambda: run.read(0), run.finish):
        with pytest.raises(CorruptRun, match=r"00000010.parquet: damaged"):
            attempt()
    assert files(run.path) == before


def test_a_missing_segment_is_named(run: RunFolder) -> None:
    fill(run)
    segment(run, 20).unlink()
    with pytest.raises(CorruptRun, match=r"00000020.parquet: missing, .*00000030.parquet exists"):
        run.progress(0)


@pytest.mark.parametrize("chain", [0, 1])
def test_a_segment_under_a_wrong_name_is_refused(run: RunFolder, chain: int) -> None:
    fill(run)
    segment(run, 30, 0).replace(segment(run, 20, chain))
    with pytest.raises(CorruptRun, match="steps 30 to 39 of run 000"):
        run.progress(chain)


def test_rows_that_do_not_follow_on_the_stored_ones_are_refused(run: RunFolder) -> None:
    fill(run, 20)
    with pytest.raises(CorruptRun, match="rows from step 30 do not follow the 20 stored"):
        run.append(0, 30, proposals(run.problem, 0, 30), {})


@pytest.mark.parametrize("how", ["empty", "truncated", "flipped", "other state"])
def test_a_damaged_history_is_named(run: RunFolder, how: str) -> None:
    fill(run)
    run.finish()
    damage(run.path / "history.parquet", how)
    with pytest.raises(CorruptRun, match=r"history.parquet: damaged .* if the folder segments/"):
        RunFolder.open(run.path).read(0)


def test_a_finished_run_takes_nothing_more(run: RunFolder) -> None:
    fill(run)
    run.finish()
    with pytest.raises(CorruptRun, match="is finished; nothing can be added"):
        run.append(0, 40, proposals(run.problem, 0, 40), {})


def test_chain_numbers_that_the_history_cannot_hold_are_refused(run: RunFolder) -> None:
    for chain in (-1, 2**15):
        with pytest.raises(InvalidSettings, match="chain: expected 0 to 32767"):
            run.append(chain, 0, proposals(run.problem, 0, 0), {})
