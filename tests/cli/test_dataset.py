"""`bellcrank dataset`: what it says, what it leaves, and what it refuses."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

import pytest

from bellcrank.surrogate.dataset import read_dataset

from .helpers import PROBLEM, call, refusal

if TYPE_CHECKING:
    from pathlib import Path

SETTINGS = ("--runs", "2", "--steps", "250", "--seed", "5", "--workers", "1")


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a small dataset. Not to be changed."""
    folder = tmp_path_factory.mktemp("dataset") / "data"
    outcome = call("dataset", "build", PROBLEM, *SETTINGS, "--out", folder)
    assert outcome.code == 0, outcome.err
    lines = outcome.out.splitlines()
    assert lines[0].startswith("500 designs of scaling-8 (219 beams) from 2 runs; 0 without")
    assert "of 250 held out for tests" in lines[2]
    assert lines[3] == f"written to {folder}/"
    return folder


def test_the_same_command_goes_on_and_leaves_the_same_bytes(built: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(built, tmp_path / "again", symlinks=True)
    outcome = call("dataset", "build", PROBLEM, *SETTINGS, "--out", folder)
    assert outcome.code == 0
    assert (folder / "dataset.parquet").read_bytes() == (built / "dataset.parquet").read_bytes()
    words = ("dataset", "build", PROBLEM, *SETTINGS, "--steps", "300", "--out", folder)
    assert "another spec" in refusal(*words, folder=folder)


def test_a_sample_of_the_runs_can_be_stored(built: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(built, tmp_path / "sample", symlinks=True)
    words = ("dataset", "build", PROBLEM, *SETTINGS, "--every", "10", "--out", folder)
    assert call(*words).out.startswith("50 designs of scaling-8 (219 beams) from 2 runs")
    assert set(read_dataset(folder).step % 10) == {0}


def test_info_says_what_is_in_it(built: Path) -> None:
    told = call("dataset", "info", built, "--json").data
    data = read_dataset(built)
    assert told["problem"] == "scaling-8"
    assert (told["designs"], told["runs"], told["held_out"]) == (len(data), 2, 250)
    assert told["accepted"] == int(data.accepted.sum())
    assert told["efficiency"]["least"] == data.efficiency.min()
    assert told["efficiency"]["most"] == data.efficiency.max()
    assert "half of them from" in call("dataset", "info", built / "dataset.parquet").out


def test_invalid_input_is_refused_in_one_line(here: Path) -> None:
    (here / "text").write_text("text")
    assert "no such file" in refusal("dataset", "info", "absent.parquet")
    assert "not a Parquet file" in refusal("dataset", "info", "text")
    assert "runs: expected at least 1" in refusal("dataset", "build", PROBLEM, "--runs", 0)
    assert "workers: expected at least 1" in refusal("dataset", "build", PROBLEM, "--workers", 0)
    assert "every: expected at least 1" in refusal("dataset", "build", PROBLEM, "--every", 0)
    words = ("dataset", "build", PROBLEM, "--set", "unloaded_beams=prune_dead_ends")
    assert "unloaded_beams" in refusal(*words)
    assert "expected KEY=VALUE" in refusal("dataset", "build", PROBLEM, "--set", "x")
    assert list(here.iterdir()) == [here / "text"]
