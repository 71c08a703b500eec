"""What several tests of the command line share."""

from __future__ import annotations

import errno
import shutil
from typing import TYPE_CHECKING
from unittest import mock

import pytest

from bellcrank.search import BLOCK, parallel

from .helpers import LIFT, PROBLEM, SETTINGS, SMALL, call, failing_from, write

if TYPE_CHECKING:
    from pathlib import Path

    from .helpers import Outcome


@pytest.fixture(scope="session")
def first_run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Outcome]:
    """The folder of a small job that nothing interrupted, and what the command said."""
    folder = tmp_path_factory.mktemp("finished") / "run"
    outcome = call("design", PROBLEM, *SETTINGS, "--out", folder)
    assert outcome.code == 0, outcome.err
    return folder, outcome


@pytest.fixture(scope="session", autouse=True)
def whole(first_run: tuple[Path, Outcome]) -> Path:
    """The folder of a finished job. Not to be changed; kernels are compiled from here on."""
    return first_run[0]


@pytest.fixture(scope="session")
def half_done(tmp_path_factory: pytest.TempPathFactory, whole: Path) -> Path:
    """The folder of a job that a full disk stopped with some shards of each chain stored."""
    folder = tmp_path_factory.mktemp("half") / "run"
    with (
        mock.patch.object(parallel, "SEGMENT_STEPS", BLOCK),
        # Two for the description, two for each shard: the chains end with one or more each.
        failing_from("fsync", 12, errno.ENOSPC),
    ):
        outcome = call("design", PROBLEM, *SETTINGS, "--out", folder, "--workers", 2)
    assert outcome.code == 1
    return folder


@pytest.fixture
def half(half_done: Path, tmp_path: Path) -> Path:
    """A copy of a half done job, to be changed at will."""
    return shutil.copytree(half_done, tmp_path / "half")


@pytest.fixture
def copy(whole: Path, tmp_path: Path) -> Path:
    """A copy of a finished job, to be changed at will."""
    return shutil.copytree(whole, tmp_path / "copy")


@pytest.fixture(autouse=True)
def here(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty current folder, in which no other test writes."""
    place = tmp_path_factory.mktemp("here")
    monkeypatch.chdir(place)
    return place


@pytest.fixture
def small(here: Path) -> str:
    """A file with a problem of eight beams, in the current folder."""
    return write(here / "small.json", SMALL).name


@pytest.fixture
def lift(here: Path) -> str:
    """A file with a problem as people write it, in the current folder."""
    return write(here / "lift.toml", LIFT).name
