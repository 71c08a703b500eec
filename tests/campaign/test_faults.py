"""A campaign survives kills, full disks and cut links, and ends with the same bytes.

``faults`` has the long form.
"""

from __future__ import annotations

import errno
import os
import random
import signal
from typing import TYPE_CHECKING
from unittest import mock

import pytest

from bellcrank.campaign import Store, complete
from bellcrank.errors import StorageError

from . import faults
from .helpers import everything
from .processes import campaign, process, segment_count, wait_until

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from bellcrank.campaign import Spec

pytestmark = pytest.mark.slow

Reference = tuple["Path", dict[str, "bytes | str"]]


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Reference:
    return faults.reference(tmp_path_factory.mktemp("reference"), 3000)


def test_kills_of_workers_and_drivers_change_nothing(tmp_path: Path, short: Reference) -> None:
    tally = faults.kill_at_random(tmp_path, *short, 4, random.Random(4))
    assert tally.kills == 4


@pytest.mark.parametrize(
    ("engine", "number"), [("serial", signal.SIGTERM), ("processes", signal.SIGINT)]
)
def test_a_campaign_stops_on_request_and_says_how_to_go_on(
    tmp_path: Path, short: Reference, engine: str, number: signal.Signals
) -> None:
    spec, expected = short
    folder, log = tmp_path / "store", tmp_path / "log"
    with process(campaign("run", spec, "--out", folder, "--engine", engine), log) as running:
        wait_until(lambda: segment_count(folder) >= 2, running)
        os.killpg(running.pid, number)
        assert running.wait(60) == 130, log.read_text()
    said = log.read_text()
    assert "Traceback" not in said
    assert f"bellcrank campaign resume {folder}" in said
    assert 2 <= segment_count(folder) < 72
    assert complete(Store.open(folder), "serial")
    assert everything(folder) == expected


@pytest.fixture
def full_after() -> Iterator[list[int]]:
    """Let the disk be full from some call of fsync on; the number is to be set."""
    left = [10**9]
    real = os.fsync

    def fsync(descriptor: int) -> None:
        left[0] -= 1
        if left[0] < 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(descriptor)

    with mock.patch.object(os, "fsync", fsync):
        yield left


@pytest.mark.parametrize("calls", [0, 2, 5, 9, 27, 29])
def test_a_full_disk_is_said_and_nothing_is_lost(
    tmp_path: Path, spec: Spec, tabled: Path, full_after: list[int], calls: int
) -> None:
    full_after[0] = calls
    folder = tmp_path / "store"
    with pytest.raises(StorageError, match="No space left on device"):
        complete(Store.create(folder, spec), "serial")
    full_after[0] = 10**9
    assert complete(Store.create(folder, spec), "serial")
    assert everything(folder) == everything(tabled)


def test_a_small_disk_changes_nothing_once_there_is_room(tmp_path: Path, short: Reference) -> None:
    try:
        assert faults.fill_disk(tmp_path, *short, "serial", 300) >= 1
    except OSError as error:
        pytest.skip(str(error))


def test_a_cut_link_changes_nothing(tmp_path: Path, short: Reference) -> None:
    try:
        with faults.two_machines():
            pass
    except OSError as error:
        pytest.skip(f"no two network namespaces here: {error}")
    faults.cut_off_worker(tmp_path, *short)
