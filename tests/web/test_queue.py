"""Who searches when, and what becomes of searches that are paused, stopped and taken up again."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from bellcrank.model import find_problem, problem_to_dict, read_design
from bellcrank.web.curves import MAX_POINTS, Curves
from bellcrank.web.jobs import Jobs, Record
from bellcrank.web.scheduler import Scheduler

from .conftest import wait_for

if TYPE_CHECKING:
    from pathlib import Path

    from starlette.testclient import TestClient

    from bellcrank.web.jobs import Job

pytestmark = pytest.mark.slow


class Still(Scheduler):
    """A scheduler that starts nothing, and says what it would start."""

    def __init__(self, jobs: Jobs) -> None:
        super().__init__(jobs, slots=1)
        self.started: list[str] = []
        self.jobs_of: dict[str, Any] = {}

    def _start(self, job: Job, _wanted: str = "") -> None:
        self.started.append(job.record.title)
        self.running[job.name] = object()  # type: ignore[assignment]
        self._started_at[job.record.session] = float(len(self.started))
        job.update(status="running")

    def end(self) -> None:
        """End what runs."""
        name = next(iter(self.running))
        del self.running[name]
        self.jobs[name].update(status="finished")
        self._fill()


def record(title: str, session: str) -> Record:
    return Record(
        title=title, session=session, settings={"search": "paper", "steps": 10, "chains": 1}
    )


def test_sessions_take_turns_however_many_searches_one_of_them_queues(tmp_path: Path) -> None:
    problem = find_problem("scaling-8")
    jobs = Jobs(tmp_path)
    scheduler = Still(jobs)
    for title, session in [
        ("a1", "a"),
        ("a2", "a"),
        ("a3", "a"),
        ("a4", "a"),
        ("b1", "b"),
        ("c1", "c"),
        ("b2", "b"),
    ]:
        scheduler.add(jobs.add(problem, record(title, session)))
    places = {job.record.title: scheduler.position(job) for job in scheduler.queue}
    for _ in range(6):
        scheduler.end()
    assert scheduler.started == ["a1", "b1", "c1", "a2", "b2", "a3", "a4"]
    assert [
        title for title, _ in sorted(places.items(), key=lambda each: each[1])
    ] == scheduler.started[1:]


def test_jobs_are_found_again_and_damaged_ones_are_left_alone(tmp_path: Path) -> None:
    jobs = Jobs(tmp_path)
    job = jobs.add(find_problem("scaling-8"), record("one", "a"))
    for name, text in [
        ("0" * 12, "{"),
        ("1" * 12, '{"schema": "bellcrank/job/1"}'),
        ("2" * 12, "[]"),
    ]:
        (tmp_path / name).mkdir()
        (tmp_path / name / "job.json").write_text(text)
    again = Jobs(tmp_path)
    assert [each.name for each in again] == [job.name]
    assert again[job.name].record == job.record
    assert Still(again).queue[0].name == job.name


def test_curves_stay_short_however_long_a_search_is() -> None:
    trace = Curves()
    for step in range(5000):
        trace.add(0, [(step, 0.1, 0.1, 0.0)])
    curve = trace.chains[0]
    assert len(curve) <= MAX_POINTS
    assert curve[0][0] == 0
    assert curve[-1][0] == 4999
    assert (np.diff([point[0] for point in curve]) > 0).all()


@pytest.fixture
def begin(client: TestClient) -> Any:
    """Begin a search and return its name."""

    def begin(**more: Any) -> str:
        problem = problem_to_dict(find_problem("scaling-8"))
        body = {
            "title": "t",
            "session": "s",
            "problem": problem,
            "chains": 2,
            "steps": 1000,
            **more,
        }
        answer = client.post("/api/runs", json=body)
        assert answer.status_code == 201, answer.text
        return str(answer.json()["id"])

    return begin


def status_is(client: TestClient, name: str, *statuses: str) -> Any:
    run = client.get(f"/api/runs/{name}").json()
    assert run["status"] in statuses or run["status"] != "failed", run["message"]
    return run if run["status"] in statuses else None


def test_a_search_is_told_over_a_websocket_and_ends_with_a_design(
    client: TestClient, begin: Any
) -> None:
    name = begin(method="paper")
    steps: list[int] = []
    with client.websocket_connect(f"ws://localhost:8642/api/runs/{name}/live") as socket:
        while True:
            news = socket.receive_json()
            steps += [point[0] for points in news["points"].values() for point in points]
            if news["run"]["status"] == "finished":
                break
            assert news["run"]["status"] in {"queued", "running"}
    assert max(steps) == 1000
    run = client.get(f"/api/runs/{name}").json()
    checks = run["provenance"]["checks"]
    assert len(checks) == 2
    assert all(run["efficiency"] == pytest.approx(each, abs=1e-6) for each in checks.values())
    history = client.get(f"/api/runs/{name}/history.parquet")
    assert history.content[:4] == b"PAR1"
    entry = client.get(f"/api/gallery/runs/{name}").json()
    assert entry["mask"] == run["mask"]
    assert (
        client.post(f"/api/runs/{name}/resume").json()["message"].startswith("this search has made")
    )


def test_a_paused_search_goes_on_to_the_same_end_as_one_that_never_paused(
    client: TestClient, begin: Any
) -> None:
    whole = begin(seed=5, steps=8_000)
    parted = begin(seed=5, steps=8_000)
    wait_for(lambda: client.get(f"/api/runs/{parted}").json()["done"] > 0)
    client.post(f"/api/runs/{parted}/pause")
    resting = wait_for(lambda: status_is(client, parted, "paused", "finished"))
    assert resting["status"] == "paused"
    assert 0 < resting["done"] < resting["total"]
    assert "not running" in client.post(f"/api/runs/{parted}/pause").json()["message"]
    client.post(f"/api/runs/{parted}/resume")
    ends = [
        wait_for(lambda name=name: status_is(client, name, "finished")) for name in (whole, parted)
    ]
    assert ends[0]["mask"] == ends[1]["mask"]
    assert ends[0]["efficiency"] == ends[1]["efficiency"]


def test_a_search_that_is_stopped_gives_the_best_it_has_found(
    client: TestClient, begin: Any
) -> None:
    name = begin(steps=1_000_000, method="paper")
    wait_for(lambda: (client.get(f"/api/runs/{name}").json()["done"]) > 2000)
    assert "running" in client.delete(f"/api/runs/{name}").json()["message"]
    assert "running" in client.get(f"/api/runs/{name}/history.parquet").json()["message"]
    client.post(f"/api/runs/{name}/stop")
    run = wait_for(lambda: status_is(client, name, "stopped"))
    assert run["mask"]
    assert run["efficiency"] > 0.0
    history = client.get(f"/api/runs/{name}/history.parquet")
    found = pq.read_table(io.BytesIO(history.content))
    assert found.num_rows == run["done"]
    assert set(found["chain"].to_pylist()) == {0, 1}
    path = client.app.state.bellcrank.jobs[name].path  # type: ignore[attr-defined]
    assert read_design(path / "run" / "design.json").mask_hex == run["mask"]
    assert client.delete(f"/api/runs/{name}").status_code == 200
    assert not path.exists()
    assert client.get(f"/api/runs/{name}").status_code == 404


def test_a_search_is_compared_with_the_design_by_hand(client: TestClient) -> None:
    problem = problem_to_dict(find_problem("crane"))
    body = {"title": "t", "session": "s", "problem": problem, "steps": 10, "chains": 1}
    name = client.post("/api/runs", json=body).json()["id"]
    human = client.get(f"/api/runs/{name}").json()["comparison"]
    assert human["efficiency"] == pytest.approx(1.010457, abs=1e-5)
    own = {**body, "reference": problem["initial"]}
    name = client.post("/api/runs", json=own).json()["id"]
    assert client.get(f"/api/runs/{name}").json()["comparison"]["title"] == "yours"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"steps": 0}, "steps"),
        ({"method": "magic"}, "method"),
        ({"goals": ["mirror z"]}, "mirror"),
        ({"reference": "ff"}, "mask"),
        ({"part": {"width": "thick"}}, "width"),
        ({"title": ""}, "title"),
        ({"session": "../x"}, "session"),
    ],
)
def test_searches_that_make_no_sense_are_refused_before_they_are_queued(
    client: TestClient, change: dict[str, Any], words: str
) -> None:
    problem = problem_to_dict(find_problem("scaling-8"))
    before = len(client.get("/api/runs").json())
    answer = client.post(
        "/api/runs", json={"title": "t", "session": "s", "problem": problem, **change}
    )
    assert answer.status_code == 422
    assert words in answer.json()["message"]
    assert len(client.get("/api/runs").json()) == before
