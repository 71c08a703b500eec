"""Searches that begin with a design, refinements, and parts in space."""

from __future__ import annotations

import io
import json
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import trimesh

from bellcrank.export.slicer import has_slicer
from bellcrank.mechanics import VERIFICATION_INCREMENT, model_evaluator
from bellcrank.model import (
    Design,
    Tolerances,
    gallery_design,
    human_design,
    pack_mask,
    problem_from_dict,
    problem_to_dict,
    unpack_mask,
    write_design,
)
from bellcrank.part import PartSpec
from bellcrank.search import SpecificationEvaluator
from bellcrank.search.symmetry import beam_images
from bellcrank.task import find_task
from bellcrank.web.page_files import page_files
from bellcrank.web.requests import RunBody
from bellcrank.web.run_routes import validated
from bellcrank.web.search_process import result_of
from bellcrank.web.task_tables import table_in, task_of
from bellcrank.workflows.fabricate import (
    Grips,
    bundle_of,
    contacts_of,
    profile_for,
    size_and_volume,
)

from .conftest import wait_for
from .test_api import refusal
from .test_tasks import SIZED, full_mask

if TYPE_CHECKING:
    from pathlib import Path

    from starlette.testclient import TestClient


def status_of(client: TestClient, name: str) -> str:
    status: str = client.get(f"/api/runs/{name}").json()["status"]
    return status


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"refine": True}, "start: expected the design to be refined"),
        ({"tolerant": True}, "tolerant: expected a refinement"),
        ({"start": "abc"}, "mask"),
    ],
)
def test_a_start_that_cannot_be_used_is_refused(
    client: TestClient, changes: dict[str, Any], words: str
) -> None:
    body = {"title": "own", "session": "aa", "task": SIZED, **changes}
    message, _ = refusal(client.post("/api/runs", json=body))
    assert words in message
    assert not client.get("/api/runs").json()


def test_a_design_without_a_specification_is_not_refined(
    client: TestClient, crane: dict[str, Any]
) -> None:
    body = {"title": "own", "session": "aa", "problem": crane["problem"], "start": crane["mask"]}
    message, _ = refusal(client.post("/api/runs", json={**body, "refine": True}))
    assert "needs a specification" in message


def test_a_request_keeps_what_it_begins_with() -> None:
    body = RunBody(title="a", session="b", task={}, start="ff", refine=True)
    assert (body.start, body.refine) == ("ff", True)


def test_a_design_is_refined_over_the_usual_tolerances_on_request() -> None:
    task = task_of(table_in(SIZED))
    mask = task.problem.full_design().mask_hex
    body = RunBody(title="a", session="b", task=SIZED, start=mask, refine=True)
    for tolerant, wanted in ((False, None), (True, Tolerances(node=0.1 / task.part.scale))):
        problem, record = validated(body.model_copy(update={"tolerant": tolerant}))
        assert problem.specification is not None
        assert problem.specification.tolerances == wanted
        assert record.refine


def test_a_result_has_what_was_maximised_in_the_list(tmp_path: Path) -> None:
    table = json.loads(json.dumps(SIZED))
    output = table["cases"][0]["outputs"][0]
    output.pop("gain", None)
    output["travel"] = [{"maximise": True}]
    task = task_of(table_in(table))
    design = replace(task.problem.full_design(), efficiency=0.25)
    (tmp_path / "run").mkdir()
    write_design(design, tmp_path / "run" / "design.json")
    (tmp_path / "job.json").write_text(json.dumps({"part": task.part.to_dict()}))
    found = result_of(tmp_path)
    assert found["efficiency"] == 0.25
    assert re.fullmatch(r"travel -?[\d.]+ mm", found["objective"])


@pytest.mark.slow
def test_a_search_begins_with_the_given_design(client: TestClient) -> None:
    problem = client.post("/api/tasks/build", json={"task": SIZED}).json()["problem"]
    bits = np.ones(len(problem["beams"]), dtype=bool)
    bits[problem["designable"][3]] = False
    body = {"title": "own", "session": "aa", "task": SIZED, "steps": 40, "chains": 1}
    name = client.post("/api/runs", json={**body, "start": pack_mask(bits)}).json()["id"]
    run = client.get(f"/api/runs/{name}").json()
    assert run["problem"]["initial"] == pack_mask(bits)

    def first_point() -> Any:
        with client.websocket_connect(f"ws://localhost:8642/api/runs/{name}/live") as live:
            return json.loads(live.receive_text())["points"].get("0")

    step, efficiency, *_ = wait_for(first_point)[0]
    evaluator = SpecificationEvaluator(problem_from_dict(run["problem"]))
    assert step == 0
    assert efficiency == pytest.approx(evaluator.evaluate(bits).efficiency, abs=1e-4)
    if status_of(client, name) == "running":
        client.post(f"/api/runs/{name}/stop")
    wait_for(lambda: status_of(client, name) in {"finished", "stopped", "paused"}, 400.0)


@pytest.mark.slow
def test_a_refinement_moves_the_nodes_of_a_design_and_can_be_stopped(client: TestClient) -> None:
    problem = client.post("/api/tasks/build", json={"task": SIZED}).json()["problem"]
    mask = full_mask(problem)
    body = {"title": "own", "session": "aa", "task": SIZED, "start": mask, "refine": True}
    name = client.post("/api/runs", json=body).json()["id"]
    wait_for(lambda: client.get(f"/api/runs/{name}").json()["done"] > 10, 400.0)
    client.post(f"/api/runs/{name}/stop")
    wait_for(lambda: status_of(client, name) == "stopped", 100.0)
    run = client.get(f"/api/runs/{name}").json()
    assert run["refine"]
    assert run["mask"] == mask
    moved = np.abs(np.subtract(run["problem"]["positions"], problem["positions"])).max()
    assert 1e-3 < moved <= 0.9 + 1e-9
    part = {"problem": run["problem"], "mask": mask, "part": run["part"]}
    before = client.post("/api/report", json={**part, "problem": problem}).json()["figures"][0]
    after = client.post("/api/report", json=part).json()["figures"][0]
    assert after["off_axis"] < before["off_axis"] or after["efficiency"] > before["efficiency"]
    # A refined design is refined further from its own geometry.
    again = {"title": "own", "session": "aa", "problem": run["problem"], "part": run["part"]}
    further = client.post("/api/runs", json={**again, "start": mask, "refine": True}).json()["id"]
    stored = client.get(f"/api/runs/{further}").json()["problem"]["positions"]
    assert stored == run["problem"]["positions"]
    client.post(f"/api/runs/{further}/pause")
    wait_for(lambda: status_of(client, further) == "paused", 100.0)


@pytest.mark.slow
def test_a_search_that_is_stopped_keeps_what_its_refinement_has_reached(
    client: TestClient,
) -> None:
    problem = client.post("/api/tasks/build", json={"task": SIZED}).json()["problem"]
    body = {"title": "own", "session": "aa", "task": SIZED, "steps": 40, "chains": 1}
    name = client.post("/api/runs", json=body).json()["id"]

    def news() -> Any:
        with client.websocket_connect(f"ws://localhost:8642/api/runs/{name}/live") as live:
            update = json.loads(live.receive_text())
        moved = update["moved"]
        if not (moved and moved["problem"]):
            return None
        apart = np.abs(np.subtract(moved["problem"]["positions"], problem["positions"])).max()
        return moved if apart > 1e-3 else None  # the first geometry is that of the lattice

    drawn = wait_for(news, 400.0)
    assert drawn["items"][0]["label"] == "off-axis motion"
    client.post(f"/api/runs/{name}/stop")
    wait_for(lambda: status_of(client, name) == "stopped", 100.0)
    run = client.get(f"/api/runs/{name}").json()
    assert np.abs(np.subtract(run["problem"]["positions"], problem["positions"])).max() > 1e-3
    part = {"problem": run["problem"], "mask": run["mask"], "part": run["part"]}
    items = client.post("/api/report", json=part).json()["items"]["frames"]
    assert all(each["met"] for each in items)


@pytest.mark.slow
def test_the_live_design_of_a_symmetric_search_has_all_images(client: TestClient) -> None:
    table = client.get("/api/tasks/gripper").json()
    body = {"title": "own", "session": "aa", "task": table, "steps": 300, "chains": 1}
    name = client.post("/api/runs", json=body).json()["id"]
    problem = problem_from_dict(client.get(f"/api/runs/{name}").json()["problem"])

    def news() -> Any:
        with client.websocket_connect(f"ws://localhost:8642/api/runs/{name}/live") as live:
            update = json.loads(live.receive_text())
        return update if update["moved"] and update["moved"]["items"] else None

    update = wait_for(news, 400.0)
    images = beam_images(problem, "x")
    for mask in (update["moved"]["mask"], update["chains"]["0"]["mask"]):
        bits = unpack_mask(mask, problem.lattice.beam_count)[problem.designable]
        assert np.array_equal(bits, bits[images])
    reached = {each["name"]: each["reached"] for each in update["moved"]["items"]}
    assert reached["close.left jaw.off_axis"] == reached["close.right jaw.off_axis"]
    assert update["moved"]["objectives"][0]["label"] == "left jaw: gain"
    client.post(f"/api/runs/{name}/pause")
    wait_for(lambda: status_of(client, name) in {"paused", "finished"}, 100.0)


def test_a_report_has_the_quantity_that_is_maximised(client: TestClient) -> None:
    case = SIZED["cases"][0]
    output = {"at": case["outputs"][0]["at"], "rotation": "maximise", "payload": "1 g"}
    table = {**SIZED, "cases": [{**case, "outputs": [output]}]}
    built = client.post("/api/tasks/build", json={"task": table}).json()
    payload = next(each for each in built["items"] if each["label"] == "payload")
    assert payload["wanted"] == "at least 0.00981 N (1 g), halves the motion"
    body = {"problem": built["problem"], "mask": full_mask(built["problem"]), "part": built["part"]}
    report = client.post("/api/report", json=body).json()
    (objective,) = report["objectives"]
    turn = report["figures"][0]["rotation_deg"]
    assert (objective["quantity"], objective["label"]) == ("rotation", "rotation")
    assert objective["reached"] in {f"{turn:.3g} deg", f"{-turn:.3g} deg"}


def test_a_plate_counts_for_size_mass_and_screws(client: TestClient) -> None:
    design = human_design("crane")
    assert design is not None
    body = {"problem": problem_to_dict(design.problem), "mask": design.mask_hex}
    plain, gripped = (
        client.post("/api/part", json={**body, **grips}).json()
        for grips in ({}, {"plate": True, "screws": 2})
    )
    assert not plain["screws"]
    assert len(gripped["screws"]) == 2
    assert gripped["mass"] > plain["mass"]


@pytest.mark.slow
def test_a_part_in_space_is_reported_played_and_written(client: TestClient) -> None:
    task = find_task("straight-orthogonal")
    assert task is not None
    table = client.get("/api/tasks/straight-orthogonal").json()
    built = client.post("/api/tasks/build", json={"task": table}).json()
    body = {"problem": built["problem"], "mask": full_mask(built["problem"])}
    nodes = task.problem.lattice.node_count
    motion = client.post("/api/motion", json=body).json()
    assert {len(each) for each in motion["displacement"]} == {3 * nodes}
    report = client.post("/api/report", json={**body, "part": built["part"]}).json()
    assert report["specified"]
    assert [item["name"] for item in report["items"]["frames"]] == [
        item["name"] for item in built["items"] if not item["name"].startswith("maximise:")
    ]
    assert len(report["figures"][0]["path_mm"][0]) == 3
    summary = client.post("/api/part", json={**body, "part": built["part"]}).json()
    assert np.allclose(summary["size"], (45.0, 17.0, 45.0), atol=10.0)
    for suffix in ("stl", "3mf", "json"):
        content = client.post(f"/api/files/{suffix}", json={**body, "part": built["part"]})
        assert content.status_code == 200
        assert len(content.content) > 5_000
    message, _ = refusal(client.post("/api/files/svg", json={**body, "part": built["part"]}))
    assert "in space" in message
    assert not page_files["svg"].in_space
    saved = client.post("/api/gallery", json={**body, "title": "mine"}).json()
    entry = client.get(f"/api/gallery/{saved['source']}/{saved['key']}").json()
    table = client.post("/api/tasks/from-problem", json={"problem": entry["problem"]}).json()
    again = client.post("/api/tasks/build", json={"task": table}).json()
    assert again["lattice"]["positions"] == built["lattice"]["positions"]


def test_struts_that_touch_are_named(client: TestClient, crane: dict[str, Any]) -> None:
    free = {"problem": crane["problem"], "mask": crane["mask"], "part": PartSpec().to_dict()}
    assert client.post("/api/part", json=free).json()["touching"] == []
    entry = client.get("/api/gallery/builtin/machine-anti-parallel").json()
    body = {"problem": entry["problem"], "mask": entry["mask"]}
    design = gallery_design("machine", "anti-parallel")
    assert design is not None
    for width, pairs in ((2.0, 1), (4.0, 9)):
        part = PartSpec(width=width)
        summary = client.post("/api/part", json={**body, "part": part.to_dict()}).json()
        contacts = contacts_of(part.of(design))
        assert len(contacts.pairs) == pairs
        assert summary["touching"] == np.unique(contacts.pairs).tolist()
        assert any("touch" in each for each in summary["remarks"])


def test_the_space_of_a_moving_part_and_the_outline_of_its_plate_are_returned(
    client: TestClient,
) -> None:
    spec = PartSpec()
    entry = client.get("/api/gallery/builtin/machine-crane").json()
    body = {"problem": entry["problem"], "mask": entry["mask"], "part": spec.to_dict()}
    summary = client.post("/api/part", json=body).json()
    assert summary["outline"] == []
    design = gallery_design("machine", "crane")
    assert design is not None
    part = spec.of(design)
    response = model_evaluator(part.design.problem).evaluate(design.mask, VERIFICATION_INCREMENT)
    ends = (part.positions + part.scale * response.displacement)[part.struts]
    low = np.minimum(ends.min(axis=(0, 1)), part.positions[part.struts].min(axis=(0, 1)))
    high = np.maximum(ends.max(axis=(0, 1)), part.positions[part.struts].max(axis=(0, 1)))
    assert summary["swept"][0] == pytest.approx(high[0] - low[0] + spec.width, abs=0.5)
    assert summary["swept"][0] > summary["size"][0] + 20.0
    assert summary["swept"][1] >= summary["size"][1] - 0.1
    held = client.post("/api/part", json={**body, "plate": True, "screws": 2}).json()
    loops = [np.array(loop) for loop in held["outline"]]
    span = np.ptp(np.concatenate(loops), axis=0)
    assert span == pytest.approx(held["size"][:2], abs=0.1)
    # The last loops are the holes of the screws.
    assert sorted(loop.mean(axis=0).tolist() for loop in loops[-2:]) == pytest.approx(
        np.array(held["screws"]), abs=0.1
    )


def test_a_part_of_an_own_material_has_remarks(client: TestClient, crane: dict[str, Any]) -> None:
    own = {"name": "own", "young": 12.0, "poisson": 0.45, "density": 1.2, "strain_limit": 0.3}
    part = {"width": 2.0, "thickness": 5.0, "scale": 10.0, "material": own}
    body = {"problem": crane["problem"], "mask": crane["mask"], "part": part}
    answer = client.post("/api/part", json=body)
    assert answer.status_code == 200
    assert answer.json()["mass"] > 0.0


def test_a_file_has_the_plate_and_the_pad_that_are_asked_for(
    client: TestClient, crane: dict[str, Any]
) -> None:
    body = {
        "problem": crane["problem"], "mask": crane["mask"], "part": PartSpec().to_dict()
    }  # fmt: skip

    def volume(**grips: Any) -> float:
        content = client.post("/api/files/stl", json={**body, **grips}).content
        return float(trimesh.load(io.BytesIO(content), file_type="stl").volume)

    plain, plate, drilled = volume(), volume(plate=True), volume(plate=True, screws=2)
    assert plain < volume(pad=True) < plate
    assert plate - drilled == pytest.approx(2 * np.pi * 1.7**2 * 5.0, rel=0.05)
    message, _ = refusal(client.post("/api/files/stl", json={**body, "screws": 2}))
    assert "plate" in message


@pytest.mark.skipif(not has_slicer(), reason="no slicer is installed")
def test_the_print_time_is_that_of_the_command(client: TestClient, crane: dict[str, Any]) -> None:
    assert client.get("/api/about").json()["slicer"]
    part = PartSpec()
    body = {"problem": crane["problem"], "mask": crane["mask"], "part": part.to_dict()}
    found = client.post("/api/print", json=body).json()
    design = Design(
        problem_from_dict(crane["problem"]),
        unpack_mask(crane["mask"], len(crane["problem"]["beams"])),
    )
    profile = profile_for(None, part)
    bundle = bundle_of(design, part, Grips(), layer=profile.layer)
    assert found["layers"] == round(bundle.thickness / profile.layer)
    assert 10.0 < found["minutes"] < 600.0
    assert found["mass"] == pytest.approx(
        size_and_volume(bundle)[1] * part.registered_material.density / 1000.0, rel=0.01
    )
