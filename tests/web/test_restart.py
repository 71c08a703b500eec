"""Searches outlive the server that began them."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import uuid
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from bellcrank.model import find_problem, problem_to_dict

httpx = pytest.importorskip("httpx2")

from .conftest import wait_for  # noqa: E402

if TYPE_CHECKING:
    from collections.abc import Iterator
    from concurrent.futures import Future

pytestmark = pytest.mark.slow


MARK = "BELLCRANK_TEST_MARK"


@contextmanager
def serving(
    folder: Path,
    end: int = signal.SIGTERM,
    *,
    mark: str = "",
    warm: bool = True,
    messages: list[str] | None = None,
) -> Iterator[Any]:
    """Run `bellcrank serve` and yield who asks it.

    Parameters
    ----------
    mark
        In the environment of the server and of all that it starts.
    warm
        Wait until it can compute.
    messages
        List to which its later messages are added when it has ended.
    """
    command = [sys.executable, "-m", "bellcrank", "serve", "--port", "0", "--folder", str(folder)]
    environment = {**os.environ, MARK: mark}
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stderr is not None
        address = ""
        while not address:
            line = process.stderr.readline()
            assert line, "the server did not start"
            found = re.search(r"http://\S+", line)
            address = found[0] if found else ""
        try:
            with httpx.Client(base_url=address, timeout=60) as client:
                wait_for(lambda: not warm or _answers(client))
                yield client
        finally:
            os.kill(process.pid, end)
            process.wait(60)
            if messages is not None:
                messages.append(process.stderr.read())


def _answers(client: Any) -> bool:
    try:
        return bool(client.get("/api/about").json()["ready"])
    except httpx.TransportError:
        return False


@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGKILL], ids=["told", "killed"])
def test_a_search_goes_on_after_its_server_has_ended(tmp_path: Path, end: int) -> None:
    with serving(tmp_path, end) as client:
        problem = problem_to_dict(find_problem("scaling-8"))
        body = {"title": "long", "session": "s", "problem": problem, "steps": 6_000, "chains": 2}
        name = client.post("/api/runs", json=body).json()["id"]
        wait_for(lambda: client.get(f"/api/runs/{name}").json()["done"] > 1000)
        assert client.get(f"/api/runs/{name}").json()["status"] == "running"
    with serving(tmp_path) as client:
        assert [run["id"] for run in client.get("/api/runs").json()] == [name]

        def ended() -> Any:
            run = client.get(f"/api/runs/{name}").json()
            assert run["status"] != "failed", run["message"]
            return run if run["status"] == "finished" else None

        assert wait_for(ended)["efficiency"] > 1.0


def test_a_folder_has_one_server(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "bellcrank", "serve", "--port", "0", "--folder", str(tmp_path)]
    with serving(tmp_path):
        second = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert second.returncode == 1
    assert "is working in this folder" in second.stderr


def marked(mark: str) -> list[str]:
    """Return the command of every process that lives and has a mark in its environment."""
    found = []
    for path in Path("/proc").glob("[0-9]*"):
        try:
            ours = f"{MARK}={mark}\0".encode() in (path / "environ").read_bytes()
            command = (path / "cmdline").read_text().replace("\0", " ")
        except OSError:  # it has ended meanwhile, or is not ours to read
            continue
        if ours and command:
            found.append(command)
    return found


needs_proc = pytest.mark.skipif(
    not Path("/proc/self/environ").exists(), reason="processes are counted in /proc"
)


@needs_proc
@pytest.mark.parametrize(
    "end", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL], ids=["ctrl-c", "told", "killed"]
)
def test_no_process_outlives_its_server(tmp_path: Path, end: int) -> None:
    mark = uuid.uuid4().hex
    with serving(tmp_path, end, mark=mark) as client:
        crane = client.get("/api/gallery/builtin/human-crane").json()
        design = {"problem": crane["problem"], "mask": crane["mask"]}
        assert client.post("/api/validation", json=design).status_code == 200
        body = {"title": "t", "session": "s", "problem": crane["problem"], "steps": 1_000_000}
        name = client.post("/api/runs", json=body).json()["id"]
        wait_for(lambda: client.get(f"/api/runs/{name}").json()["done"] > 0)
        # Four pools and a search; a resource tracker and the server itself.
        assert len(marked(mark)) == 7
    wait_for(lambda: not marked(mark), seconds=30)


@needs_proc
@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGKILL], ids=["told", "killed"])
def test_no_process_outlives_a_server_that_was_still_starting_them(
    tmp_path: Path, end: int
) -> None:
    mark = uuid.uuid4().hex
    with serving(tmp_path, end, mark=mark, warm=False):
        wait_for(lambda: len(marked(mark)) > 2)
    wait_for(lambda: not marked(mark), seconds=30)


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM], ids=["ctrl-c", "told"])
def test_a_computation_ends_with_its_server_without_a_traceback(tmp_path: Path, end: int) -> None:
    messages: list[str] = []
    with ThreadPoolExecutor(1) as pool:
        with serving(tmp_path, end, messages=messages) as client:
            crane = client.get("/api/gallery/builtin/human-crane").json()
            body = {"problem": crane["problem"], "mask": crane["mask"], "part": {}}
            answer = pool.submit(
                httpx.post, f"{client.base_url}api/tolerance", json=body, timeout=60
            )
            asked = {**body, "results": False}
            wait_for(lambda: client.post("/api/computations", json=asked).json()["tolerance"])
        assert answer.result(60).status_code == 503
    assert "Traceback" not in messages[0]


def test_a_computation_that_is_stopped_makes_room_for_another(tmp_path: Path) -> None:
    with ThreadPoolExecutor(2) as pool, serving(tmp_path) as client:
        crane = client.get("/api/gallery/builtin/human-crane").json()

        def asked(width: float) -> dict[str, Any]:
            return {"problem": crane["problem"], "mask": crane["mask"], "part": {"width": width}}

        def begin(width: float) -> Future[Any]:
            address = f"{client.base_url}api/tolerance"
            return pool.submit(httpx.post, address, json=asked(width), timeout=300)

        def known(width: float) -> dict[str, Any]:
            body = {**asked(width), "results": False}
            found = client.post("/api/computations", json=body).json()["tolerance"]
            return found or {"share": None}

        def is_computed(width: float) -> bool:
            return known(width)["share"] is not None

        def stop(width: float) -> bool:
            body = {**asked(width), "computation": "tolerance"}
            return bool(client.post("/api/computations/stop", json=body).json()["stopped"])

        assert not stop(1.4)
        first = begin(1.4)
        wait_for(lambda: is_computed(1.4))
        second = begin(1.5)
        wait_for(lambda: known(1.5).get("waits_for") == "tolerance of crane")
        assert stop(1.4)
        assert first.result(5).status_code == 409
        wait_for(lambda: is_computed(1.5))
        assert stop(1.5)
        assert second.result(5).status_code == 409
        assert client.post("/api/computations", json=asked(1.4)).json()["tolerance"] is None


def test_a_check_is_found_again_after_a_restart(tmp_path: Path) -> None:
    with serving(tmp_path) as client:
        crane = client.get("/api/gallery/builtin/human-crane").json()
        body = {"problem": crane["problem"], "mask": crane["mask"], "part": {"width": 1.6}}
        found = client.post("/api/validation", json={**body, "level": "frame"}).json()
    with serving(tmp_path, warm=False) as client:
        known = client.post("/api/computations", json=body).json()
        assert known["validation"]["frame"] == {"result": found}
