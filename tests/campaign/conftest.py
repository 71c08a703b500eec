"""Fixtures: finished campaigns."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

import pytest

from bellcrank.campaign import Store, complete, read_spec

from .helpers import write_spec

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.campaign import Spec


@pytest.fixture(scope="session")
def spec(tmp_path_factory: pytest.TempPathFactory) -> Spec:
    return read_spec(write_spec(tmp_path_factory.mktemp("spec")))


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory, spec: Spec) -> Path:
    """Folder of a finished campaign, still in segments. Not to be changed."""
    store = Store.create(tmp_path_factory.mktemp("finished") / "store", spec)
    assert complete(store, "serial", compacting=False)
    return store.path


@pytest.fixture(scope="session")
def tabled(tmp_path_factory: pytest.TempPathFactory, finished: Path) -> Path:
    """Folder of the same campaign, compacted. Not to be changed."""
    folder = tmp_path_factory.mktemp("tabled") / "store"
    shutil.copytree(finished, folder, symlinks=True)
    assert complete(Store.open(folder), "serial")
    return folder


@pytest.fixture
def segments(tmp_path: Path, finished: Path) -> Store:
    """A copy of the finished campaign in segments, to be changed at will."""
    return Store.open(shutil.copytree(finished, tmp_path / "segments", symlinks=True))


@pytest.fixture
def table(tmp_path: Path, tabled: Path) -> Store:
    """A copy of the compacted campaign, to be changed at will."""
    return Store.open(shutil.copytree(tabled, tmp_path / "table", symlinks=True))
