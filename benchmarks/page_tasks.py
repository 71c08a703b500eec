"""All bundled tasks, stated on the page from an empty drawing, searched, checked and downloaded.

``python -m benchmarks.page_tasks`` starts a server, states each task in Chromium as a user does,
with clicks on the nodes and numbers typed into fields, and compares what the page makes of it with
the bundled task. Then it presses "Design it", waits for the result, checks it with finite elements,
compares it with another design and downloads all files. The record is written after each task.
"""

from __future__ import annotations

import argparse
import json
import shutil
import time
from pathlib import Path
from tempfile import gettempdir
from typing import TYPE_CHECKING, Any

import httpx2 as httpx
import numpy as np

from bellcrank.model.storage import write_text
from bellcrank.provenance import provenance
from bellcrank.task import bundled_tasks, find_task
from benchmarks.page_driving import State, state_task
from benchmarks.web import CHROMIUM, running_server

if TYPE_CHECKING:
    from bellcrank.task import Task

RECORD = Path(__file__).parents[1] / "docs" / "benchmarks" / "page-tasks.json"
RESULT = '[aria-label="Result"] .verdict'
"""The sentence on the part of a result."""
SPATIAL = ("straight-orthogonal",)
"""Tasks in space that are stated."""
SEARCH_LIMIT = 2400.0
"""Longest time of a search with its refinement, seconds."""
FIGURES = ("case", "output", "efficiency", "off_axis", "rotation_deg", "payload_N")
POSITION = 1e-6
"""Largest difference of nodes, lattice units."""


def planar_names() -> list[str]:
    """Return the names of the bundled tasks in the plane."""
    found = []
    for name in bundled_tasks():
        task = find_task(name)
        assert task is not None
        if task.problem.lattice.dimension == 2:
            found.append(name)
    return found


def same_task(built: dict[str, Any], task: Task) -> list[str]:
    """Return in what a task that was stated on the page differs from a bundled one."""
    from bellcrank.model import problem_from_dict
    from bellcrank.web.items import wanted_items

    problem, own = task.problem, problem_from_dict(built["problem"])
    if own.lattice.beam_count != problem.lattice.beam_count:
        return ["lattice"]
    faults = []
    if not np.allclose(own.lattice.positions, problem.lattice.positions, atol=POSITION):
        faults.append("nodes")
    if not np.array_equal(own.designable, problem.designable):
        faults.append("designable struts")
    for (name, case), (_, wanted) in zip(own.cases.items(), problem.cases.items(), strict=True):
        if set(case.supports.nodes) != set(wanted.supports.nodes):
            faults.append(f"supports of {name}")
        if set(case.input.nodes) != set(wanted.input.nodes):
            faults.append(f"input of {name}")
        if not np.isclose(case.input.amount, wanted.input.amount):
            faults.append(f"stroke of {name}")
        outputs = zip(case.outputs.values(), wanted.outputs.values(), strict=True)
        if any(set(one.nodes) != set(two.nodes) for one, two in outputs):
            faults.append(f"outputs of {name}")
    stated = {(each["label"], each["wanted"]) for each in built["items"]}
    items = {(each["label"], each["wanted"]) for each in wanted_items(problem, task.part)}
    if stated != items:
        faults.append(f"items {sorted(stated ^ items)}")
    return faults


def run_task(page: Any, address: str, name: str) -> dict[str, Any]:
    """State, search, check, compare and download one task; return what happened."""
    task = find_task(name)
    assert task is not None
    table = httpx.get(f"{address}/api/tasks/{name}").json()
    start = time.perf_counter()
    state = State(page, address)
    state_task(state, table)
    built = state.built()
    row: dict[str, Any] = {
        "task": name,
        "commit": provenance()["commit"],
        "stated_s": round(time.perf_counter() - start, 1),
        "clicks": state.clicks,
        "fields": state.fields,
        "differs": ["no problem"] if built["problem"] is None else same_task(built, task),
    }
    if row["differs"]:
        return row
    start = time.perf_counter()
    page.locator('[data-key="begin"]').click()
    page.wait_for_url("**/#/run/*")
    run = page.url.rsplit("/", 1)[1]
    own = page.url
    page.goto("about:blank")  # a browser without a graphics processor takes part of a core
    status = _ended(address, run)
    row |= {"search_s": round(time.perf_counter() - start, 1), "status": status}
    if status != "finished":
        row["message"] = httpx.get(f"{address}/api/runs/{run}").json()["message"]
        return row
    page.goto(own)
    return row | _result(page, address, run)


def _ended(address: str, run: str) -> str:
    end = time.monotonic() + SEARCH_LIMIT
    while time.monotonic() < end:
        status: str = httpx.get(f"{address}/api/runs/{run}", timeout=120).json()["status"]
        if status in {"finished", "failed", "stopped", "paused"}:
            return status
        time.sleep(2.0)
    return "too long"


def _result(page: Any, address: str, run: str) -> dict[str, Any]:
    """Check the result of a run on the page, compare and download it."""
    data = httpx.get(f"{address}/api/runs/{run}", timeout=120).json()
    body = {"problem": data["problem"], "mask": data["mask"], "part": data["part"]}
    page.wait_for_selector(f"{RESULT}:not(:empty)", timeout=300_000)
    row: dict[str, Any] = {}
    _until(lambda: "being computed" not in _verdict(page))  # in the 2D solid, at once
    row["verdict"] = _verdict(page)
    row["missed"] = page.locator('[aria-label="Result"] tr.missed').all_inner_texts()
    report = httpx.post(f"{address}/api/report", json=body, timeout=300).json()
    row["refined"] = "refinement" in data["provenance"]
    row["figures"] = [{key: each.get(key) for key in FIGURES} for each in report["figures"]]
    with page.expect_download(timeout=600_000) as download:
        page.locator('[data-file="zip"]').click()
    row["archive_kB"] = round(Path(download.value.path()).stat().st_size / 1024)
    page.select_option("#compare", "builtin/machine-crane")
    page.wait_for_selector(".pair .player[data-ready=yes]", timeout=300_000)
    page.wait_for_selector("table.part", timeout=300_000)
    row["compared"] = page.locator(".pair .stage").count() == 2
    return row


def _verdict(page: Any) -> str:
    return str(page.locator(RESULT).inner_text())


def _until(done: Any, seconds: float = 600.0) -> None:
    end = time.monotonic() + seconds
    while not done():
        if time.monotonic() > end:
            raise TimeoutError("the page did not answer")
        time.sleep(0.5)


def main() -> None:
    """State, search and check the tasks that are named, all by default."""
    from playwright.sync_api import sync_playwright

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="tasks; all in the plane, and one in space")
    parser.add_argument("--state-only", action="store_true", help="do not search")
    given = parser.parse_args()
    names = given.names or [*planar_names(), *SPATIAL]
    known = json.loads(RECORD.read_text())["tasks"] if RECORD.exists() else []
    rows = {row["task"]: row for row in known}
    with running_server() as (address, _), sync_playwright() as started:
        browser = started.chromium.launch(executable_path=shutil.which("chromium"), args=CHROMIUM)
        for name in names:
            page = browser.new_context(viewport={"width": 1440, "height": 1100}).new_page()
            page.goto(f"{address}/#/draw")
            try:
                if given.state_only:
                    task = find_task(name)
                    assert task is not None
                    state = State(page, address)
                    state_task(state, httpx.get(f"{address}/api/tasks/{name}").json())
                    built = state.built()
                    print(name, same_task(built, task) if built["problem"] else built["fault"])
                    continue
                row = run_task(page, address, name)
            except Exception as error:  # the record says what failed
                row = {"task": name, "error": f"{type(error).__name__}: {str(error)[:300]}"}
                page.screenshot(path=Path(gettempdir()) / f"{name}.png")
            finally:
                page.context.close()
            print(json.dumps(row), flush=True)
            rows[name] = row
            data = {"command": "python -m benchmarks.page_tasks", "tasks": list(rows.values())}
            write_text(
                RECORD,
                json.dumps({**data, "provenance": provenance()}, indent=1) + "\n",
                overwrite=True,
            )


if __name__ == "__main__":
    main()
