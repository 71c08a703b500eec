"""Results that the server keeps."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from bellcrank.web.results import Results


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
