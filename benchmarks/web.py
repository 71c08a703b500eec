"""Response times of the page with one user, and with twenty users and eight searches.

``python -m benchmarks.web`` starts a server and prints a table. The measurements in a browser
require Chromium and playwright and are skipped without them.
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
CHROMIUM = ("--no-sandbox", "--enable-unsafe-swiftshader")
"""Arguments of Chromium, which draws in space by software. With ``--use-angle=swiftshader`` it
emulates a graphics processor for the whole page, which takes most of the time of a frame."""
"""Options of Chromium with which it draws a view in space without a graphics processor; pages in
the plane are slower with them."""
START_LIMIT = 120.0
"""Longest time until all searches have started, in seconds."""
RARELY = 5
"""Number of messages of a search that has hardly run."""
PAUSE = 0.5
"""Time between two edits of a session, in seconds."""


@contextlib.contextmanager
def running_server() -> Iterator[tuple[str, int]]:
    """Start a server; yield its address and the number of its process."""
    with TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "bellcrank", "serve", "--port", "0", "--folder", folder]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
            assert process.stderr is not None
            address = re.search(r"http://\S+?(?=/)", process.stderr.readline())
            assert address is not None
            try:
                while not httpx.get(f"{address[0]}/api/about").json()["ready"]:
                    time.sleep(0.2)
                yield address[0], process.pid
            finally:
                os.kill(process.pid, signal.SIGTERM)
                process.wait(60)


def megabytes(pid: int) -> float:
    """Return the proportional set size of a process and its descendants, in megabytes."""
    children = Path(f"/proc/{pid}/task/{pid}/children")
    own = re.search(r"^Pss:\s+(\d+)", Path(f"/proc/{pid}/smaps_rollup").read_text(), re.MULTILINE)
    total = int(own[1]) / 1024 if own else 0.0
    for child in children.read_text().split():
        with contextlib.suppress(OSError):
            total += megabytes(int(child))
    return total


def quantiles(seconds: list[float]) -> str:
    """Return median, 95th percentile, maximum and number of times as text, in milliseconds."""
    ordered = sorted(1e3 * each for each in seconds)
    high = ordered[min(len(ordered) - 1, int(0.95 * len(ordered)))]
    return f"{statistics.median(ordered):7.1f} {high:7.1f} {ordered[-1]:7.1f}   ({len(ordered)})"


def flips(design: dict[str, Any], seed: int) -> Iterator[str]:
    """Yield masks of a design; each differs from the last by one flipped beam."""
    bits = bytearray.fromhex(design["mask"])
    beams = design["problem"]["designable"]
    for k in range(10**6):
        beam = beams[(17 * k + 29 * seed) % len(beams)]
        bits[beam // 8] ^= 128 >> (beam % 8)
        yield bits.hex()


async def edit(
    address: str, design: dict[str, Any], seed: int, count: int, pause: float
) -> list[float]:
    """Edit a design with a pause after each flip; return the response times in seconds."""
    times = []
    masks = flips(design, seed)
    async with websockets.connect(f"{address.replace('http', 'ws')}/api/edit") as socket:
        await socket.send(
            json.dumps({"id": 0, "problem": design["problem"], "mask": design["mask"]})
        )
        await socket.recv()
        for number in range(count):
            start = time.perf_counter()
            await socket.send(json.dumps({"id": number, "mask": next(masks)}))
            await socket.recv()
            times.append(time.perf_counter() - start)
            await asyncio.sleep(pause)
    return times


async def under_load(address: str, pid: int, design: dict[str, Any], seconds: float) -> None:
    """Print the response times of many sessions that edit while searches are queued and run.

    The searches are those of the crane with its specification. Their messages are counted from the
    first one with a design to the end of the measurement.
    """
    async with httpx.AsyncClient(base_url=address, timeout=60) as client:
        task = (await client.get("/api/tasks/straight-crane")).json()
        for k in range(SEARCHES):
            owner = "a" if k < SEARCHES - 2 else "bc"[k - SEARCHES + 2]
            body = {
                "title": f"{owner}{k}", "session": owner, "task": task, "steps": 8000, "chains": 2,
                "seed": k,
            }  # fmt: skip
            (await client.post("/api/runs", json=body)).raise_for_status()
        list_times: list[float] = []
        peak = megabytes(pid)
        order: list[str] = []
        rates: list[float] = []

        async def poll() -> None:
            nonlocal peak
            while True:
                start = time.perf_counter()
                runs = (await client.get("/api/runs")).json()
                list_times.append(time.perf_counter() - start)
                for run in reversed(runs):
                    if run["status"] != "queued" and run["title"] not in order:
                        order.append(run["title"])
                peak = max(peak, megabytes(pid))
                await asyncio.sleep(0.5)

        async def listen(name: str) -> None:
            arrivals: list[float] = []
            live = f"{address.replace('http', 'ws')}/api/runs/{name}/live"
            try:
                async with websockets.connect(live) as socket:
                    async for text in socket:
                        message = json.loads(text)
                        if message["run"]["status"] == "running" and message["chains"]:
                            arrivals.append(time.perf_counter())
            finally:
                if len(arrivals) > RARELY:
                    rates.append((len(arrivals) - 1) / (arrivals[-1] - arrivals[0]))

        names = [run["id"] for run in (await client.get("/api/runs")).json()]
        tasks = [asyncio.create_task(poll()), *(asyncio.create_task(listen(n)) for n in names)]
        start = time.perf_counter()
        count = int(seconds / PAUSE)
        times = await asyncio.gather(
            *(edit(address, design, k, count, PAUSE) for k in range(SESSIONS))
        )
        for listener in tasks[1:]:
            listener.cancel()
        await asyncio.gather(*tasks[1:], return_exceptions=True)
        while len(order) < SEARCHES and time.perf_counter() - start < START_LIMIT:
            await asyncio.sleep(0.5)
        tasks[0].cancel()
        print(f"edit, {SESSIONS} sessions, {SEARCHES} searches   {quantiles(sum(times, []))}")  # noqa: RUF017
        print(f"list of searches under load         {quantiles(list_times)}")
        print(
            f"messages of each running search     {', '.join(f'{r:.1f}' for r in rates)} per second"
        )
        print(f"order in which searches started     {' '.join(order)}")
        print(f"largest memory of all processes     {peak:.0f} MB")


def in_browser(address: str) -> None:
    """Measure the page in a browser: paint, size, edits and the animation."""
    chromium = shutil.which("chromium")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        chromium = None
    if chromium is None:
        print("measurements in a browser           skipped: Chromium or playwright is missing")
        return
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=CHROMIUM)
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        received = 0

        def add_size(response: Any) -> None:
            nonlocal received
            received += int(response.headers.get("content-length", 0))

        page.on("response", add_size)
        paints = []
        for _ in range(5):
            page.goto("about:blank")
            page.goto(address)
            page.locator("svg.canvas path.dot").first.wait_for(state="attached")
            drawn = page.evaluate("performance.now()")
            page.wait_for_timeout(300)  # the paint entry is added after the paint
            paints.append((page.evaluate(FIRST_PAINT), drawn))
        first, drawn = (statistics.median(each) for each in zip(*paints, strict=True))
        print(f"first paint, problem drawn          {first:.0f} ms, {drawn:.0f} ms")
        print(f"size of the page                    {received / 5000:.0f} kB")
        section = page.locator(".step.domain h2 button")
        section.click()
        page.get_by_label("Start from").select_option("straight-crane")
        print(f"click to moved lattice, crane       {quantiles(clicks(page))}")
        page.locator(".tools label", has_text="Supports").click()
        page.get_by_label("Start from").select_option("example")
        for label, size in (("Width", "212"), ("Height", "182")):
            page.get_by_label(label, exact=True).fill(size)
            page.keyboard.press("Tab")
            page.wait_for_timeout(500)
        struts = page.locator(".step.domain .summary").inner_text().split(", ")[1]
        print(f"click to moved lattice, {struts:12s}{quantiles(clicks(page))}")
        open_crane(page, address)
        session = page.context.new_cdp_session(page)
        session.send("Performance.enable", {"timeDomain": "threadTicks"})
        before = thread_time(session)
        frames, rate = page.evaluate(COUNT_FRAMES)
        frame_time = 1e3 * (thread_time(session) - before) / frames
        print(f"animation of the crane              {rate:.0f} frames per second")
        print(f"time per frame of the page's thread {frame_time:.1f} ms")
        page.close()
        in_space(browser, address)
        browser.close()


def in_space(browser: Any, address: str) -> None:
    """Measure the view in space of the crane, which is extruded."""
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    open_crane(page, address)
    received = []
    page.on("response", lambda found: received.append(found.headers.get("content-length", 0)))
    page.locator(".transport label", has_text="3D").click()
    page.locator("canvas").wait_for()
    page.wait_for_timeout(2000)
    print(f"size of the view in space           {sum(map(int, received)) / 1000:.0f} kB more")
    rate = page.evaluate(COUNT_FRAMES)[1]
    print(f"animation in space, no GPU          {rate:.0f} frames per second")


def open_crane(page: Any, address: str) -> None:
    """Open a design, and wait until it moves."""
    page.goto(f"{address}/#/design/builtin/machine-crane")
    page.locator('.player[data-ready="yes"]').wait_for()
    page.wait_for_timeout(500)


def clicks(page: Any) -> list[float]:
    """Return the times from clicks on struts to the drawing of the moved lattice, in seconds."""
    page.wait_for_timeout(1000)
    page.locator(".tools label", has_text="By hand").click()
    page.locator(".readout .latency").wait_for()
    page.wait_for_timeout(1500)
    page.evaluate(RECORD_CLICKS)
    box = page.locator("svg.canvas").bounding_box()
    for k in range(60):
        page.mouse.click(
            box["x"] + box["width"] * (0.38 + 0.004 * k),
            box["y"] + box["height"] * (0.3 + 0.006 * k),
        )
        page.wait_for_timeout(120)
    times: list[float] = page.evaluate("window.responseTimes")
    return [each / 1e3 for each in times]


def thread_time(session: Any) -> float:
    """Return the processor time of the main thread of the page, in seconds."""
    metrics = session.send("Performance.getMetrics")["metrics"]
    return float(next(each["value"] for each in metrics if each["name"] == "TaskDuration"))


FIRST_PAINT = "performance.getEntriesByName('first-contentful-paint')[0].startTime"
RECORD_CLICKS = """() => {
  window.responseTimes = [];
  if (window.isRecording) return;
  window.isRecording = true;
  let begin = 0;
  document.addEventListener("pointerdown", () => { begin = performance.now(); }, true);
  document.addEventListener("bellcrank-response", () => requestAnimationFrame(() =>
    setTimeout(() => window.responseTimes.push(performance.now() - begin))));
}"""
COUNT_FRAMES = """() => new Promise((done) => {
  const times = [];
  const step = (now) => {
    times.push(now);
    if (times.length < 240) requestAnimationFrame(step);
    else done([times.length, (1000 * (times.length - 1)) / (times.at(-1) - times[0])]);
  };
  requestAnimationFrame(step);
})"""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--seconds", type=float, default=20.0, help="duration of the edits of all sessions"
    )
    seconds = parser.parse_args().seconds
    print(f"{os.cpu_count()} processors, initial load average {os.getloadavg()[0]:.1f}")
    print("                                     median     95 %     max  (number), ms")
    with running_server() as (address, pid):
        design = httpx.get(f"{address}/api/gallery/builtin/human-crane").json()
        times = asyncio.run(edit(address, design, 0, 300, 0.01))
        print(f"edit of the crane, no other load    {quantiles(times)}")
        print(f"memory of all processes             {megabytes(pid):.0f} MB before the load")
        in_browser(address)
        asyncio.run(under_load(address, pid, design, seconds))


if __name__ == "__main__":
    main()
