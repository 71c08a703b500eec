"""Tasks with a specification: built from tables, evaluated, and searched."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank.model import (
    Design,
    gallery_design,
    human_design,
    problem_from_dict,
    problem_to_dict,
    write_design,
)
from bellcrank.part import PartSpec, frame_problem
from bellcrank.search.verification import ELEMENTS
from bellcrank.task import find_task
from bellcrank.web.jobs import Record
from bellcrank.workflows.part_figures import part_figures
from bellcrank.workflows.specification import item_rows, results_for
from bellcrank.workflows.tolerance import compute_tolerance, deviations_of, tolerance_rows

from .conftest import wait_for
from .test_api import refusal

if TYPE_CHECKING:
    from starlette.testclient import TestClient

SIZED = {
    "name": "own",
    "domain": {"size": [62, 54]},
    "supports": [{"at": {"edge": "bottom"}}],
    "cases": [
        {
            "inputs": [
                {"at": {"point": [51, 53], "count": 2}, "direction": "down", "displacement": "3mm"}
            ],
            "outputs": [
                {
                    "at": {"point": [11, 53], "count": 2},
                    "direction": "left",
                    "gain": "maximise",
                    "off_axis": "10%",
                }
            ],
        }
    ],
}


def full_mask(problem: dict[str, Any]) -> str:
    """Return the mask of all beams."""
    return np.packbits(np.ones(len(problem["beams"]), dtype=bool)).tobytes().hex()


def test_every_bundled_task_has_a_picture_with_its_arrows(client: TestClient) -> None:
    found = {each["name"]: each for each in client.get("/api/tasks/pictures").json()}
    listed = {each["name"]: each["about"] for each in client.get("/api/tasks").json()}
    assert set(found) == {name for name in listed if not name.startswith("element-")}
    for name, each in found.items():
        assert each["about"] == listed[name]
        picture = each["picture"]
        assert all(len(picture[mark]) >= 2 for mark in ("lines", "supports", "input", "output"))
        assert each["arrows"]["input"], name
    # Both sides of a disc are pushed; its hub turns, in no direction.
    assert sorted(arrow[2] for arrow in found["twist"]["arrows"]["input"]) == [-1.0, 1.0]
    assert found["twist"]["arrows"]["output"] == []
    (_, _, across, up), *_ = found["gripper"]["arrows"]["input"]
    assert (across, up) == (0.0, -1.0)


def test_every_listed_task_is_built_with_its_items(client: TestClient) -> None:
    listed = {each["name"] for each in client.get("/api/tasks").json()}
    assert {"straight-crane", "gripper", "selector", "bracket", "twist-column"} <= listed
    for name in listed:
        table = client.get(f"/api/tasks/{name}").json()
        built = client.post("/api/tasks/build", json={"task": table}).json()
        assert built["fault"] is None
        task = find_task(name)
        if name.startswith("element-"):
            continue
        assert task is not None
        assert problem_from_dict(built["problem"]).hash == task.problem.hash
        assert [each["case"] for each in built["conditions"]] == list(task.problem.cases)
        assert all(each["texts"][0].startswith("input ") for each in built["conditions"])
        wanted = task.problem.specification
        assert wanted is not None
        named = [each["name"] for each in built["items"]]
        assert named[: len(wanted.items)] == [item.name for item in wanted.items]
        assert len(named) == len(wanted.items) + len(wanted.maximise)
        assert built["part"] == json.loads(json.dumps(task.part.to_dict()))


@pytest.mark.parametrize(
    ("changes", "words", "key"),
    [
        ({"domain": {"outline": "../secret.svg"}}, "not the name of a file", "domain.outline"),
        ({"domain": {"size": [4000, 4000]}}, "the limit of the page is", "domain"),
        ({"domain": {"outline": {"circle": [0, 0], "radius": 4000}}}, "the limit", "domain"),
        ({"domain": {"size": [4000, 4000, 4000]}}, "the limit of the page is", "domain"),
        ({"domain": {"size": [60, 60, 60], "cells": "hexagon"}}, "octet", "domain.cells"),
        ({"domain": {"size": [62, 54]}, "part": {"spacing": 0}}, "part.spacing", "part.spacing"),
        (
            {"domain": {"lattice": {"kind": "triangular-rectangle", "columns": 3, "rows": 10**9}}},
            "the limit of the page is",
            "lattice",
        ),
        (
            {"domain": {"lattice": {"kind": "nodes", "positions": [[0, 0]] * 4000, "beams": []}}},
            "the limit of the page is",
            "lattice",
        ),
        ({"part": {"width": 12}}, "not slender", "part.width"),
        ({"part": {"material": "oak"}}, "oak", "part.material"),
    ],
)
def test_a_task_that_cannot_be_built_is_refused_in_one_sentence(
    client: TestClient, changes: dict[str, Any], words: str, key: str
) -> None:
    start = time.perf_counter()
    message, named = refusal(client.post("/api/tasks/build", json={"task": {**SIZED, **changes}}))
    assert time.perf_counter() - start < 10.0  # refused before a large domain is filled
    assert words in message
    assert named.startswith(key)


@pytest.mark.parametrize(
    ("changes", "words", "key"),
    [
        ({"supports": [{"at": {"point": [200, 0]}}]}, "the node nearest to", "supports[0].at"),
        ({"limits": {"symmetry": "x"}}, "symmetr", "limits.symmetry"),
        (
            {"cases": [{**SIZED["cases"][0], "outputs": [{"at": {"nodes": [0]}}]}]},
            "node 0",
            "output.nodes",
        ),
    ],
)
def test_a_task_with_a_fault_is_still_drawn(
    client: TestClient, changes: dict[str, Any], words: str, key: str
) -> None:
    built = client.post("/api/tasks/build", json={"task": {**SIZED, **changes}}).json()
    assert len(built["lattice"]["positions"]) == 46
    assert built["problem"] is None
    assert words in built["fault"]["message"]
    assert built["fault"]["key"].startswith(key)


@pytest.mark.parametrize(
    ("changes", "missing"),
    [
        ({"supports": []}, "supports"),
        ({"supports": [{"at": []}]}, "supports[0]"),
        ({"cases": [{"outputs": SIZED["cases"][0]["outputs"]}]}, "cases[0].inputs"),
        ({"cases": [{"inputs": SIZED["cases"][0]["inputs"]}]}, "cases[0].outputs"),
        ({"domain": {"problem": "crane"}, "supports": [], "cases": [{"outputs": [{}]}]}, None),
    ],
)
def test_an_unfinished_task_is_drawn_and_says_what_is_missing(
    client: TestClient, changes: dict[str, Any], missing: str | None
) -> None:
    built = client.post("/api/tasks/build", json={"task": {**SIZED, **changes}}).json()
    assert built["missing"] == missing
    assert built["fault"] is None
    assert (built["problem"] is None) == (missing is not None)
    assert built["lattice"]["beams"]


def test_a_task_is_written_as_a_task_file_and_read_again(client: TestClient) -> None:
    for name in ("gripper", "selector", "bracket", "arc", "inverter"):
        table = client.get(f"/api/tasks/{name}").json()
        text = client.post("/api/tasks/write", json={"task": table}).json()["text"]
        read = client.post("/api/tasks/read", json={"text": text, "suffix": ".toml"}).json()
        assert read["task"] == table


def test_the_region_of_a_drawing_becomes_an_outline_with_holes(client: TestClient) -> None:
    drawing = (
        '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="80mm" '
        'viewBox="0 0 100 80"><rect x="5" y="5" width="90" height="70"/>'
        '<circle cx="50" cy="40" r="10"/></svg>'
    )
    region = client.post("/api/tasks/region", json={"text": drawing, "suffix": ".svg"}).json()
    corners = np.array(region["outline"])
    assert corners.min(axis=0) == pytest.approx([0.0, 0.0])
    assert corners.max(axis=0) == pytest.approx([90.0, 70.0])
    (hole,) = region["holes"]
    assert np.mean(hole["polygon"], axis=0) == pytest.approx([45.0, 35.0], abs=0.1)
    table = {**SIZED, "domain": region}
    built = client.post("/api/tasks/build", json={"task": table}).json()
    assert built["fault"] is None
    message, _ = refusal(
        client.post("/api/tasks/region", json={"text": "<svg/>", "suffix": ".svg"})
    )
    assert "closed curve" in message
    assert "/tmp" not in message


def test_the_report_has_the_items_and_figures_of_the_part(client: TestClient) -> None:
    built = client.post("/api/tasks/build", json={"task": SIZED}).json()
    problem, part = built["problem"], built["part"]
    mask = full_mask(problem)
    body = {"problem": problem, "mask": mask, "part": part}
    report = client.post("/api/report", json=body).json()
    task = find_task("slider")
    assert task is not None
    own = problem_from_dict(problem)
    bits = np.ones(own.lattice.beam_count, dtype=bool)
    for model, elements in (("search", None), ("frames", ELEMENTS)):
        results = results_for(own, bits, elements)
        assert results is not None
        rows = item_rows(own, task.part, {model: results})[1:]  # the part is the usual one
        shown = report["items"][model]
        assert [each["reached"] for each in shown] == [row[2] for row in rows]
        assert [[each["label"], each["wanted"]] for each in shown] == [row[:2] for row in rows]
        assert [each["met"] for each in shown] == [row[-1] == "yes" for row in rows]
    (figures,) = report["figures"]
    (exact,) = part_figures(Design(own, bits), task.part)
    assert figures == json.loads(json.dumps(exact))
    assert {"off_axis", "rotation_deg", "payload_N", "sag_mm", "path_mm"} <= set(figures)


def test_the_report_of_a_design_of_springs_is_that_of_its_part(
    client: TestClient, crane: dict[str, Any]
) -> None:
    body = {"problem": crane["problem"], "mask": crane["mask"], "part": {"width": 2.0}}
    report = client.post("/api/report", json=body).json()
    assert not report["specified"]
    assert report["items"] == {"search": None, "frames": None}
    (figures,) = report["figures"]
    assert figures["efficiency"] == pytest.approx(1.17, abs=0.02)
    assert figures["off_axis"] == pytest.approx(0.18, abs=0.01)


def test_the_report_without_a_specification_is_that_of_the_part_that_is_asked_for(
    client: TestClient,
) -> None:
    found = gallery_design("machine", "crane")
    assert found is not None
    data, figures = problem_to_dict(found.problem), {}
    for width in (2.0, 1.6):
        spec = PartSpec(width=width)
        body = {"problem": data, "mask": found.mask_hex, "part": spec.to_dict()}
        (figures[width],) = client.post("/api/report", json=body).json()["figures"]
        design = replace(found, problem=frame_problem(found.problem, spec))
        (exact,) = part_figures(design, spec)
        assert figures[width] == json.loads(json.dumps(exact))
    assert figures[1.6]["input_force_N"] < 0.7 * figures[2.0]["input_force_N"]


def test_an_own_part_of_a_machine_is_joined_to_one_of_the_library(client: TestClient) -> None:
    table = client.get("/api/tasks/element-left").json()
    built = client.post("/api/tasks/build", json={"task": table}).json()
    body = {
        "problem": built["problem"], "mask": full_mask(built["problem"]), "title": "own",
        "provenance": {"part": built["part"]},
    }  # fmt: skip
    key = client.post("/api/gallery", json=body).json()["key"]
    (library,) = [each for each in client.get("/api/gallery").json() if each["source"] == "library"]
    other = next(each["key"] for each in library["entries"] if each["key"].startswith("down-7-"))
    plan = {
        "name": "two",
        "parts": {
            "first": {"entry": f"kept/{key}"},
            "second": {"entry": f"library/{other}", "join": "first.output"},
        },
        "input": {"ports": ["first.input"]},
        "output": {"ports": ["second.output"]},
    }
    assert client.post("/api/machines", json={"plan": plan}).json()["status"] == "converged"


def test_a_motion_is_that_of_the_chosen_load_case(client: TestClient) -> None:
    table = client.get("/api/tasks/selector").json()
    problem = client.post("/api/tasks/build", json={"task": table}).json()["problem"]
    body = {"problem": problem, "mask": full_mask(problem)}
    motions = {
        case: client.post("/api/motion", json={**body, "case": case}).json()
        for case in ("", "A", "B")
    }
    assert motions[""] == motions["A"]
    assert motions["B"]["cases"] == ["A", "B"]
    assert motions["B"]["input"] == problem["specification"]["cases"][0]["input"]["nodes"]
    moved = np.reshape(motions["B"]["displacement"][-1], (-1, 2))[motions["B"]["input"]]
    assert moved == pytest.approx(np.tile([-0.3, 0.0], (len(moved), 1)), abs=1e-6)
    message, _ = refusal(client.post("/api/motion", json={**body, "case": "C"}))
    assert message.startswith("case: expected one of A, B")


def test_live_edits_are_answered_at_once_and_their_items_when_verified(client: TestClient) -> None:
    built = client.post("/api/tasks/build", json={"task": SIZED}).json()
    problem, mask = built["problem"], full_mask(built["problem"])
    own = problem_from_dict(problem)
    with client.websocket_connect("ws://localhost:8642/api/edit") as socket:
        first = {"id": 1, "problem": problem, "part": built["part"], "mask": mask}
        socket.send_text(json.dumps(first))
        quick = json.loads(socket.receive_text())
    body = {"problem": problem, "part": built["part"], "mask": mask}
    whole = client.post("/api/response", json=body).json()
    results = results_for(own, np.ones(own.lattice.beam_count, dtype=bool))
    assert results is not None
    assert [each["met"] for each in whole["items"]] == [each.met for each in results]
    assert quick["items"] is None
    assert quick["displacement"] == pytest.approx(whole["displacement"], abs=1e-3)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, "either a task or a problem"),
        ({"task": SIZED, "part": {"width": 2.0}}, "part is that of the task"),
    ],
)
def test_a_search_is_for_a_task_or_for_a_problem(
    client: TestClient, changes: dict[str, Any], words: str
) -> None:
    body = {"title": "t", "session": "s", **changes}
    message, _ = refusal(client.post("/api/runs", json=body))
    assert words in message


@pytest.mark.slow
def test_the_tolerance_of_a_part_is_that_of_the_command(client: TestClient) -> None:
    human = human_design("crane")
    assert human is not None
    spec = PartSpec()
    problem = frame_problem(human.problem, spec)
    body = {"problem": problem_to_dict(problem), "mask": human.mask_hex, "part": spec.to_dict()}
    found = client.post("/api/tolerance", json=body).json()
    design = replace(human, problem=problem)
    report = compute_tolerance(design, deviations_of(design, spec), spec, workers=1)
    assert report is not None
    assert found["rows"] == tolerance_rows(report)
    assert found["sentence"].startswith(f"{len(report.tolerance.scenarios)} scenarios")
    losses = report.tolerance.strut_losses()
    assert found["losses"]["beams"] == list(losses)
    costs = [None if each == np.inf else each for each in losses.values()]
    assert found["losses"]["cost"] == pytest.approx(costs)


def test_the_best_figure_stays_when_a_search_is_resumed(client: TestClient) -> None:
    """The process that resumes a search has reported smaller figures so far."""
    jobs = client.app.state.bellcrank.jobs  # type: ignore[attr-defined]
    task = find_task("lever")
    assert task is not None
    settings = {"search": "basin-hopping", "steps": 10, "chains": 2, "goals": []}
    record = Record(title="r", session="s", settings=settings, status="running", efficiency=12.09)
    job = jobs.add(task.problem, record)
    shown = []
    for best in (None, 8.22, 12.5):
        job.progress = {"chains": {0: {"best": best}, 1: {"best": None}}}
        shown.append(job.summary()["efficiency"])
    assert shown == [12.09, 12.09, 12.5]
    jobs.remove(job.name)


def test_a_refined_design_is_shown_with_its_own_geometry(client: TestClient) -> None:
    jobs = client.app.state.bellcrank.jobs  # type: ignore[attr-defined]
    task = find_task("lever")
    assert task is not None
    settings = {"search": "basin-hopping", "steps": 10, "chains": 1, "goals": []}
    job = jobs.add(
        task.problem, Record(title="r", session="s", settings=settings, status="finished")
    )
    positions = task.problem.lattice.positions + 0.01
    widths = np.full(task.problem.lattice.beam_count, 0.25)
    moved = task.problem.with_geometry(positions, widths)
    (job.path / "run").mkdir()
    write_design(Design(moved, moved.initial), job.path / "run" / "design.json")
    run = client.get(f"/api/runs/{job.name}").json()
    assert problem_from_dict(run["problem"]).hash == moved.hash
    assert run["mask"]
    jobs.remove(job.name)


@pytest.mark.slow
def test_a_task_is_searched_with_its_items_shown_and_stopped_without_refinement(
    client: TestClient,
) -> None:
    body = {"title": "own", "session": "s", "task": SIZED, "steps": 200_000, "chains": 1}
    name = client.post("/api/runs", json=body).json()["id"]
    with client.websocket_connect(f"ws://localhost:8642/api/runs/{name}/live") as socket:

        def items() -> Any:
            moved = json.loads(socket.receive_text())["moved"]
            return moved and moved["items"]

        shown = wait_for(items)
    assert shown[0]["label"] == "off-axis motion"
    client.post(f"/api/runs/{name}/stop")
    wait_for(lambda: client.get(f"/api/runs/{name}").json()["status"] == "stopped")
    run = client.get(f"/api/runs/{name}").json()
    assert run["task"] == SIZED
    assert run["mask"]
    assert "refinement" not in run["provenance"]
    assert run["problem"]["specification"]["items"]
    client.delete(f"/api/runs/{name}")
