"""Results that the server keeps."""

from __future__ import annotations

import asyncio
import os
import time
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

from bellcrank.web import share_file
from bellcrank.web.pools import Stopped
from bellcrank.web.results import Results, StoredResults
from bellcrank.web.share_file import ShareFile

if TYPE_CHECKING:
    from pathlib import Path


def test_a_result_is_computed_once_and_a_failure_again() -> None:
    calls: list[str] = []

    async def compute() -> dict[str, Any]:
        calls.append("computed")
        await asyncio.sleep(0.01)
        if len(calls) == 1:
            raise ValueError("the first time")
        return {"mass": 17.0}

    async def run() -> None:
        results = Results()
        with pytest.raises(ValueError, match="the first time"):
            await results.get("crane", compute)
        both = await asyncio.gather(results.get("crane", compute), results.get("crane", compute))
        assert both == [{"mass": 17.0}] * 2
        assert len(calls) == 2

    asyncio.run(run())


def test_a_client_that_leaves_does_not_end_a_computation_of_another() -> None:
    async def compute() -> dict[str, Any]:
        await asyncio.sleep(0.05)
        return {"mass": 17.0}

    async def run() -> None:
        results = Results()
        first = asyncio.create_task(results.get("crane", compute))
        second = asyncio.create_task(results.get("crane", compute))
        await asyncio.sleep(0.01)
        first.cancel()
        assert await second == {"mass": 17.0}

    asyncio.run(run())


def test_a_computation_that_is_stopped_ends_for_all_who_wait_and_can_begin_again() -> None:
    calls: list[str] = []

    async def compute() -> dict[str, Any]:
        calls.append("begun")
        await asyncio.sleep(60.0 if len(calls) == 1 else 0.0)
        return {"mass": 17.0}

    async def run() -> None:
        results = Results()
        both = [asyncio.create_task(results.get("crane", compute)) for _ in range(2)]
        await asyncio.sleep(0.01)
        assert results.stop("crane")
        assert not results.stop("crane")
        for each in await asyncio.gather(*both, return_exceptions=True):
            assert isinstance(each, Stopped)
        assert await results.get("crane", compute) == {"mass": 17.0}

    asyncio.run(run())


def test_the_result_that_was_not_used_for_the_longest_time_is_dropped() -> None:
    calls: list[str] = []

    async def run() -> None:
        results = Results(most=2)
        for name in ("one", "two", "one", "three", "one", "two"):

            async def compute(name: str = name) -> dict[str, Any]:
                calls.append(name)
                return {}

            await results.get(name, compute)

    asyncio.run(run())
    assert calls == ["one", "two", "three", "two"]


def test_a_stored_result_outlasts_the_server(tmp_path: Path) -> None:
    calls: list[str] = []

    async def compute(_share: Path) -> dict[str, Any]:
        calls.append("computed")
        return {"stress": 0.5}

    async def run() -> None:
        first = StoredResults(tmp_path / "results")
        assert first.state("crane") is None
        assert await first.get("crane", compute) == {"stress": 0.5}
        second = StoredResults(tmp_path / "results")
        assert second.state("crane") == {"result": {"stress": 0.5}}
        assert second.state("crane", running=True) is None
        assert await second.get("crane", compute) == {"stress": 0.5}
        assert len(calls) == 1

    asyncio.run(run())


def test_the_time_left_follows_from_what_is_done_after_the_first_share(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mesh of 200 s comes first; each tenth then takes 10 s."""
    clock = iter([0.0, 0.0, 200.0, 210.0, 240.0])
    monkeypatch.setattr(share_file, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    path, found = tmp_path / "solid.share", []
    write = ShareFile(str(path))
    for share in (0.1, 0.2, 0.205, 0.5):
        write(share)
        found.append(path.read_text())
    assert found == [
        "0.100 200.0 nan", "0.200 210.0 80.0", "0.200 210.0 80.0", "0.500 240.0 50.0"
    ]  # fmt: skip


def test_the_share_of_a_computation_is_0_when_it_begins(tmp_path: Path) -> None:
    """Without a share, it waits for others."""
    path = tmp_path / "crane.share"
    write = ShareFile(str(path))
    assert float(path.read_text().split()[0]) == 0.0
    write(0.5)
    assert float(path.read_text().split()[0]) == 0.5


@pytest.mark.parametrize(
    ("written", "left"),
    [("0.250 60.0 180.0", 170), ("0.900 60.0 6.0", None), ("0.000 0.1 nan", None)],
)
def test_a_running_computation_has_the_share_and_times(
    tmp_path: Path, written: str, left: int | None
) -> None:
    """Of the time left, 10 s have passed; it is not known at first, nor when it has passed."""

    async def run() -> None:
        results, go_on = StoredResults(tmp_path / "results"), asyncio.Event()

        async def compute(share: Path) -> dict[str, Any]:
            share.write_text(written)
            before = time.time() - 10.0
            os.utime(share, (before, before))
            await go_on.wait()
            return {"stress": 0.5}

        task = asyncio.create_task(results.get("crane", compute))
        for _ in range(3):
            await asyncio.sleep(0)
        share, seconds, _ = map(float, written.split())
        found = results.state("crane")
        assert found is not None
        assert found["share"] == share
        assert found["seconds"] == pytest.approx(seconds + 10.0, abs=1.0)
        assert found["left"] == (None if left is None else pytest.approx(left, abs=1))
        go_on.set()
        await task
        assert results.state("crane") == {"result": {"stress": 0.5}}
        assert not list((tmp_path / "results").glob("*.share"))

    asyncio.run(run())


def test_damaged_and_old_files_are_not_used(tmp_path: Path) -> None:
    calls: list[str] = []

    async def compute(_share: Path) -> dict[str, Any]:
        calls.append("computed")
        return {"number": len(calls)}

    async def run() -> None:
        results = StoredResults(tmp_path, most=2)
        await results.get("one", compute)
        (file,) = tmp_path.glob("*.json")
        file.write_text("{")
        again = StoredResults(tmp_path, most=2)
        assert again.state("one") is None
        assert await again.get("one", compute) == {"number": 2}
        for name in ("two", "three"):
            await again.get(name, compute)
        assert len(list(tmp_path.glob("*.json"))) == 2

    asyncio.run(run())


def test_a_failure_is_not_stored(tmp_path: Path) -> None:
    async def fail(_share: Path) -> dict[str, Any]:
        raise ValueError("no mesh")

    async def run() -> None:
        results = StoredResults(tmp_path)
        with pytest.raises(ValueError, match="no mesh"):
            await results.get("crane", fail)
        assert results.state("crane") is None

    asyncio.run(run())
