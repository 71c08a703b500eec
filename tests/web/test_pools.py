"""Processes of the page: calls one after the other, their limits, and how they are stopped."""

from __future__ import annotations

import asyncio
import contextlib
import os
import time
from functools import partial

import pytest

from bellcrank.web.pools import Busy, Pool, ServerEnds


async def _end_of(process: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        while True:
            os.kill(process, 0)
            await asyncio.sleep(0.05)


def test_a_cancelled_call_ends_its_process_and_leaves_those_that_wait() -> None:
    async def run() -> tuple[float, int, int]:
        pool = Pool(seconds=60, waiting=4, stoppable=True)
        try:
            first = await pool.call(os.getpid)
            stopped = asyncio.create_task(pool.call(time.sleep, 50.0))
            waiting = asyncio.create_task(pool.call(os.getpid))
            await asyncio.sleep(0.3)
            start = time.perf_counter()
            stopped.cancel()
            with pytest.raises(asyncio.CancelledError):
                await stopped
            second = await waiting
            await asyncio.wait_for(_end_of(first), 20.0)
            return time.perf_counter() - start, first, second
        finally:
            pool.end()

    seconds, first, second = asyncio.run(run())
    assert seconds < 30.0  # the call would take longer
    assert second != first


def test_a_cancelled_call_that_waits_leaves_the_one_that_runs() -> None:
    async def run() -> int:
        pool = Pool(seconds=60, waiting=4, stoppable=True)
        try:
            running = asyncio.create_task(pool.call(sum, range(1000)))
            waiting = asyncio.create_task(pool.call(os.getpid))
            await asyncio.sleep(0)
            waiting.cancel()
            return await running
        finally:
            pool.end()

    assert asyncio.run(run()) == 499500


def test_a_pool_has_the_key_and_name_of_the_call_that_runs() -> None:
    async def run() -> list[tuple[str, str]]:
        pool = Pool(seconds=60, waiting=4, stoppable=True)
        seen = [pool.running]
        try:
            first = asyncio.create_task(pool.call_named("1", "check", partial(time.sleep, 50.0)))
            second = asyncio.create_task(pool.call_named("2", "tolerance", os.getpid))
            await asyncio.sleep(0.1)
            seen.append(pool.running)
            first.cancel()
            with pytest.raises(asyncio.CancelledError):
                await first
            await asyncio.sleep(0)
            seen.append(pool.running)
            await second
            seen.append(pool.running)
        finally:
            pool.end()
        return seen

    assert asyncio.run(run()) == [("", ""), ("1", "check"), ("2", "tolerance"), ("", "")]


def test_a_pool_refuses_calls_that_are_too_many_and_all_when_it_has_ended() -> None:
    async def run() -> None:
        pool = Pool(seconds=60, waiting=1)
        running = asyncio.create_task(pool.call(time.sleep, 50.0))
        await asyncio.sleep(0)
        with pytest.raises(Busy, match="try again in a moment"):
            await pool.call(os.getpid)
        pool.end()
        with pytest.raises(ServerEnds):
            await running
        with pytest.raises(ServerEnds):
            await pool.call(os.getpid)

    asyncio.run(run())
