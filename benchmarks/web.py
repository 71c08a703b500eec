"""How quickly the page answers: alone, and with twenty others and eight searches.

``python -m benchmarks.web`` starts a server of its own and prints a table. What needs Chromium
and playwright is left out where they are missing.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import re
import shutil
import signal
import statistics
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import httpx2 as httpx
import websockets

if TYPE_CHECKING:
    from collections.abc import Iterator

SESSIONS, SEARCHES = 20, 8
LONGEST = 120.0
"""Seconds to wait until all searches have begun."""
PAUSE = 0.5
"""Seconds between two edits of a person."""


@contextlib.contextmanager
def serving() -> Iterator[tuple[str, int]]:
    """Yield address and process of a server."""
    with TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "bellcrank", "serve", "--port", "0", "--folder", folder]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
            assert process.stderr is not None
            found = re.search(r"http://\S+?(?=/)", process.stderr.readline())
            assert found is not None
            try:
                while not httpx.get(f"{found[0]}/api/about").json()["ready"]:
                    time.sleep(0.2)
                yield found[0], process.pid
            finally:
                os.kill(process.pid, signal.SIGTERM)
                process.wait(60)


def megabytes(pid: int) -> float:
    """Memory of a process and all it has started, what they share counted once."""
    children = Path(f"/proc/{pid}/task/{pid}/children")
    own = re.search(r"^Pss:\s+(\d+)", Path(f"/proc/{pid}/smaps_rollup").read_text(), re.MULTILINE)
    total = int(own[1]) / 1024 if own else 0.0
    for child in children.read_text().split():
        with contextlib.suppress(OSError):
            total += megabytes(int(child))
    return total


def quantiles(seconds: list[float]) -> str:
    """Median, 95th percentile and largest of some times, in milliseconds."""
    ordered = sorted(1e3 * each for each in seconds)
    last = ordered[min(len(ordered) - 1, int(0.95 * len(ordered)))]
    return f"{statistics.median(ordered):7.1f} {last:7.1f} {ordered[-1]:7.1f}   ({len(ordered)})"


def flips(design: dict[str, Any], seed: int) -> Iterator[str]:
    """Yield masks of a design with one beam after the other flipped."""
    bits = bytearray.fromhex(design["mask"])
    beams = design["problem"]["designable"]
    for k in range(10**6):
        beam = beams[(17 * k + 29 * seed) % len(beams)]
        bits[beam // 8] ^= 128 >> (beam % 8)
        yield bits.hex()


async def edit(
    address: str, design: dict[str, Any], seed: int, count: int, pause: float
) -> list[float]:
    """Flip beams as a person would, and return how long each answer took."""
    times = []
    masks = flips(design, seed)
    async with websockets.connect(f"{address.replace('http', 'ws')}/api/edit") as socket:
        await socket.send(
            json.dumps({"id": 0, "problem": design["problem"], "mask": design["mask"]})
        )
        await socket.recv()
        for number in range(count):
            begin = time.perf_counter()
            await socket.send(json.dumps({"id": number, "mask": next(masks)}))
            await socket.recv()
            times.append(time.perf_counter() - begin)
            await asyncio.sleep(pause)
    return times


async def crowd(address: str, pid: int, design: dict[str, Any], seconds: float) -> None:
    """Let many sessions edit and look while searches are queued, and say how they fare."""
    async with httpx.AsyncClient(base_url=address, timeout=60) as client:
        for k in range(SEARCHES):
            owner = "a" if k < SEARCHES - 2 else "bc"[k - SEARCHES + 2]
            body = {
                "title": f"{owner}{k}", "session": owner, "problem": design["problem"],
                "steps": 3000, "chains": 2, "seed": k,
            }  # fmt: skip
            (await client.post("/api/runs", json=body)).raise_for_status()
        loads: list[float] = []
        peak = megabytes(pid)
        order: list[str] = []
        news = 0

        async def look() -> None:
            nonlocal peak
            while True:
                begin = time.perf_counter()
                runs = (await client.get("/api/runs")).json()
                loads.append(time.perf_counter() - begin)
                for run in reversed(runs):
                    if run["status"] != "queued" and run["title"] not in order:
                        order.append(run["title"])
                peak = max(peak, megabytes(pid))
                await asyncio.sleep(0.5)

        async def listen() -> None:
            nonlocal news
            first = (await client.get("/api/runs")).json()[-1]["id"]
            async with websockets.connect(
                f"{address.replace('http', 'ws')}/api/runs/{first}/live"
            ) as socket:
                async for _ in socket:
                    news += 1

        others = [asyncio.create_task(look()), asyncio.create_task(listen())]
        begin = time.perf_counter()
        count = int(seconds / PAUSE)
        found = await asyncio.gather(
            *(edit(address, design, k, count, PAUSE) for k in range(SESSIONS))
        )
        passed = time.perf_counter() - begin
        while len(order) < SEARCHES and time.perf_counter() - begin < LONGEST:
            await asyncio.sleep(0.5)
        for task in others:
            task.cancel()
        print(f"edit, {SESSIONS} sessions, {SEARCHES} searches   {quantiles(sum(found, []))}")  # noqa: RUF017
        print(f"list of searches, meanwhile         {quantiles(loads)}")
        print(f"news of a search                    {news / passed:.1f} a second, while it ran")
        print(f"searches began in the order         {' '.join(order)}")
        print(f"memory of all processes             {peak:.0f} MB at most")


def in_browser(address: str) -> None:
    """Measure what a person sees."""
    chromium = shutil.which("chromium")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        chromium = None
    if chromium is None:
        print("Chromium or playwright is missing: nothing was measured in a browser")
        return
    with sync_playwright() as started:
        browser = started.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        weight = 0

        def weigh(response: Any) -> None:
            nonlocal weight
            weight += int(response.headers.get("content-length", 0))

        page.on("response", weigh)
        paints = []
        for _ in range(5):
            page.goto("about:blank")
            page.goto(address)
            page.locator("svg.canvas path.dot").first.wait_for(state="attached")
            drawn = page.evaluate("performance.now()")
            page.wait_for_timeout(300)  # the browser notes its paints a little later
            paints.append((page.evaluate(PAINTED), drawn))
        first, drawn = (statistics.median(each) for each in zip(*paints, strict=True))
        print(f"first paint, task drawn             {first:.0f} ms, {drawn:.0f} ms")
        print(f"all that is fetched                 {weight / 5000:.0f} kB")
        page.locator(".step.lattice h2 button").click()
        page.get_by_label("Start from").select_option("crane")
        page.wait_for_timeout(1000)
        page.locator(".tools label", has_text="By hand").click()
        page.locator(".readout .latency").wait_for()
        page.evaluate(WATCH)
        box = page.locator("svg.canvas").bounding_box()
        for k in range(60):
            page.mouse.click(
                box["x"] + box["width"] * (0.38 + 0.004 * k),
                box["y"] + box["height"] * (0.3 + 0.006 * k),
            )
            page.wait_for_timeout(120)
        found = [each / 1e3 for each in page.evaluate("window.answered")]
        print(f"click on a beam to moved lattice    {quantiles(found)}")
        page.goto(f"{address}/#/design/builtin/machine-crane")
        page.locator('.player[data-ready="yes"]').wait_for()
        page.wait_for_timeout(500)
        watch = page.context.new_cdp_session(page)
        watch.send("Performance.enable", {"timeDomain": "threadTicks"})
        before = used(watch)
        frames, rate = page.evaluate(PLAYED)
        work = 1e3 * (used(watch) - before) / frames
        print(f"playback of the crane               {rate:.0f} frames a second")
        print(f"processor time of a frame           {work:.1f} ms of the page's thread")
        browser.close()


def used(session: Any) -> float:
    """Processor time that the page's thread has used, in seconds."""
    metrics = session.send("Performance.getMetrics")["metrics"]
    return float(next(each["value"] for each in metrics if each["name"] == "TaskDuration"))


PAINTED = "performance.getEntriesByName('first-contentful-paint')[0].startTime"
WATCH = """() => {
  window.answered = [];
  let begin = 0;
  document.addEventListener("pointerdown", () => { begin = performance.now(); }, true);
  document.addEventListener("bellcrank-response", () => requestAnimationFrame(() =>
    setTimeout(() => window.answered.push(performance.now() - begin))));
}"""
PLAYED = """() => new Promise((done) => {
  const times = [];
  const step = (now) => {
    times.push(now);
    if (times.length < 240) requestAnimationFrame(step);
    else done([times.length, (1000 * (times.length - 1)) / (times.at(-1) - times[0])]);
  };
  requestAnimationFrame(step);
})"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0, help="that the crowd lasts")
    seconds = parser.parse_args().seconds
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f} before")
    print("                                     median     95 %     all  (number), ms")
    with serving() as (address, pid):
        design = httpx.get(f"{address}/api/gallery/builtin/human-crane").json()
        alone = asyncio.run(edit(address, design, 0, 300, 0.01))
        print(f"edit of the crane, server alone     {quantiles(alone)}")
        print(f"memory of all processes             {megabytes(pid):.0f} MB, idle")
        in_browser(address)
        asyncio.run(crowd(address, pid, design, seconds))


if __name__ == "__main__":
    main()
