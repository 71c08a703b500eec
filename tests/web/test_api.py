"""What the page asks of the server, and the sentences it gets when something is wrong."""

from __future__ import annotations

import io
import time
import zipfile
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import trimesh

from bellcrank.fem import levels
from bellcrank.machines.elementary import elementary
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator
from bellcrank.model import find_problem, human_design, problem_to_dict
from bellcrank.part import materials
from bellcrank.search import DEFAULT_SEARCH, searches
from bellcrank.web import design_routes
from bellcrank.web.page_files import page_files

if TYPE_CHECKING:
    from starlette.testclient import TestClient

LIFT = """schema = "bellcrank/problem/1"
name = "lift"

[lattice]
kind = "triangular-rectangle"
columns = 5
rows = 6

[supports]
fixed = [{ row = 0 }]

[input]
nodes = [{ row = -1, rightmost = 2 }]
direction = [0, -1]
drive = "displacement"
amount = 0.2

[output]
nodes = [{ row = -1, leftmost = 2 }]
direction = [0, 1]
"""


def refusal(answer: Any, status: int = 422) -> tuple[str, str]:
    """Return sentence and key of an answer that refuses."""
    assert answer.status_code == status, answer.text
    said = answer.json()
    assert set(said) == {"message", "key"}
    assert "\n" not in said["message"]
    assert "Traceback" not in said["message"]
    return said["message"], said["key"]


@pytest.mark.parametrize(
    ("change", "key", "words"),
    [
        ({"output": {"nodes": [132], "direction": [-1, 0]}}, "output.nodes", "also in input.nodes"),
        ({"supports": {"fixed": [999]}}, "supports.fixed", "999"),
        ({"input": {"nodes": [], "direction": [0, -1], "drive": "displacement", "amount": 0.3}},
         "input.nodes", "node"),
        ({"input": {"nodes": [132], "direction": [0, 0], "drive": "displacement", "amount": 0.3}},
         "input.direction", "unit"),
        ({"name": 7}, "name", "string"),
        ({"colour": "red"}, "", "unknown key 'colour'"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_problem_is_one_sentence_about_one_thing(
    client: TestClient, change: dict[str, Any], key: str, words: str
) -> None:
    problem = {**problem_to_dict(find_problem("crane")), **change}
    body = {"problem": problem, "mask": "ff"}
    message, about = refusal(client.post("/api/motion", json=body))
    assert words in message
    assert about.partition("[")[0] == key


def test_a_problem_file_is_opened_as_a_task_on_its_lattice(client: TestClient) -> None:
    read = client.post("/api/tasks/read", json={"text": LIFT, "suffix": ".toml"}).json()
    table = read["task"]
    assert table["name"] == "lift"
    built = client.post("/api/tasks/build", json={"task": table}).json()
    assert built["fault"] is None
    (given,) = table["cases"][0]["inputs"]
    assert given["displacement"] == pytest.approx(2.0)  # 0.2 lattice units of 10 mm
    assert built["problem"]["input"]["amount"] == pytest.approx(0.2)
    assert built["problem"]["supports"]["fixed"] == [0, 1, 2, 3, 4]


def test_a_design_file_is_opened_with_its_design(client: TestClient, crane: dict[str, Any]) -> None:
    text = client.post(
        "/api/files/json", json={"problem": crane["problem"], "mask": crane["mask"]}
    ).text
    read = client.post("/api/tasks/read", json={"text": text, "suffix": ".json"}).json()
    where = read["design"]
    opened = client.get(f"/api/gallery/{where['source']}/{where['key']}").json()
    assert opened["mask"] == crane["mask"]


@pytest.mark.parametrize(
    ("text", "suffix", "words"),
    [
        ("schema = ", ".toml", "not valid TOML"),
        ("[1]", ".json", "JSON object"),
        ("{}", ".json", "missing"),
        ("abc", ".exe", "ending in"),
        (LIFT.replace("rows = 6", "rows = 60000"), ".toml", "nodes"),
        (LIFT.replace("row = 0", "row = 99"), ".toml", "99"),
    ],
)
def test_a_bad_file_is_refused_in_a_sentence_without_our_paths(
    client: TestClient, text: str, suffix: str, words: str
) -> None:
    message, _ = refusal(client.post("/api/tasks/read", json={"text": text, "suffix": suffix}))
    assert words in message
    assert "/tmp" not in message
    assert "upload" not in message


def test_a_motion_follows_the_true_path(client: TestClient, crane: dict[str, Any]) -> None:
    body = {"problem": crane["problem"], "mask": crane["mask"]}
    motion = client.post("/api/motion", json=body).json()
    design = human_design("crane")
    assert design is not None
    exact = SpringEvaluator(design.problem).evaluate(design.mask, VERIFICATION_INCREMENT)
    there = np.array(motion["displacement"][-1]).reshape(-1, 2)
    assert np.abs(there - exact.displacement).max() < 1e-5
    assert motion["efficiency"][-1] == pytest.approx(exact.efficiency, abs=1e-9)
    assert np.abs(motion["displacement"][0]).max() == 0.0


def test_the_worth_of_a_beam_is_what_flipping_it_changes(
    client: TestClient, crane: dict[str, Any]
) -> None:
    body = {"problem": crane["problem"], "mask": crane["mask"]}
    found = client.post("/api/sensitivity", json=body).json()
    design = human_design("crane")
    assert design is not None
    evaluator = SpringEvaluator(design.problem)
    for place in (3, 50, 150):
        mask = design.mask.copy()
        mask[found["beams"][place]] ^= True
        flipped = evaluator.evaluate(mask)
        if found["change"][place] is None:
            assert flipped.status.label != "converged"
        else:
            change = flipped.efficiency - found["efficiency"]
            assert found["change"][place] == pytest.approx(change, abs=1e-9)


def test_the_solver_answers_over_a_websocket_design_by_design(
    client: TestClient, crane: dict[str, Any]
) -> None:
    with client.websocket_connect("ws://localhost:8642/api/edit") as socket:
        socket.send_json({"id": 1, "mask": crane["mask"]})
        assert "problem" in socket.receive_json()["error"]["message"]
        socket.send_json({"id": 2, "mask": crane["mask"], "problem": crane["problem"]})
        answer = socket.receive_json()
        assert answer["id"] == 2
        assert answer["efficiency"] == pytest.approx(1.010457, abs=1e-5)
        socket.send_json({"id": 3, "mask": "zz"})
        assert "hexadecimal" in socket.receive_json()["error"]["message"]
        socket.send_text("[")
        assert "JSON" in socket.receive_json()["error"]["message"]


@pytest.mark.parametrize("suffix", ["stl", "3mf"])
def test_what_is_downloaded_to_print_is_watertight(
    client: TestClient, crane: dict[str, Any], suffix: str
) -> None:
    body = {"problem": crane["problem"], "mask": crane["mask"], "part": {"width": 1.6}}
    answer = client.post(f"/api/files/{suffix}", json=body)
    assert answer.status_code == 200
    if suffix == "3mf":
        assert answer.content[:2] == b"PK"
        return
    mesh = trimesh.load(io.BytesIO(answer.content), file_type="stl")
    assert mesh.is_watertight
    assert mesh.volume > 0.0


@pytest.mark.parametrize(
    ("suffix", "place", "sign"),
    [
        ("svg", 0, b"<"), ("dxf", 0, b"0\nSECTION"), ("pdf", 0, b"%PDF"), ("gif", 0, b"GIF8"),
        ("mp4", 4, b"ftyp"), ("json", 0, b"{"),
    ],
)  # fmt: skip
def test_every_other_file_is_of_its_kind(
    client: TestClient, crane: dict[str, Any], suffix: str, place: int, sign: bytes
) -> None:
    body = {"problem": crane["problem"], "mask": crane["mask"], "part": {"width": 1.6}}
    answer = client.post(f"/api/files/{suffix}", json=body)
    assert answer.status_code == 200, answer.text
    assert answer.content[place:].replace(b"\r", b"").lstrip().startswith(sign)


def test_a_file_and_a_frame_do_not_wait_for_a_check(
    client: TestClient, crane: dict[str, Any]
) -> None:
    checks = client.app.state.bellcrank.pools.checks  # type: ignore[attr-defined]
    assert client.portal is not None
    client.portal.call(checks.call, abs, -1)  # its process has started
    busy = client.portal.start_task_soon(checks.call, time.sleep, 45.0)
    body = {"problem": crane["problem"], "mask": crane["mask"]}
    assert client.post("/api/files/stl", json=body).status_code == 200
    assert client.post("/api/validation", json={**body, "level": "frame"}).status_code == 200
    assert not busy.done()


@pytest.mark.slow
def test_all_files_come_in_one_archive(client: TestClient, crane: dict[str, Any]) -> None:
    body = {"problem": crane["problem"], "mask": crane["mask"]}
    content = client.post("/api/files/zip", json=body).content
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert {each.filename for each in archive.filelist} == {
            f"part.{suffix}" for suffix in page_files if suffix != "zip"
        }
        assert archive.testzip() is None
        single = client.post("/api/files/stl", json=body).content
        assert archive.read("part.stl") == single


def test_a_part_that_cannot_be_is_refused_in_a_sentence(
    client: TestClient, crane: dict[str, Any]
) -> None:
    body = {"problem": crane["problem"], "mask": crane["mask"], "part": {"width": 20.0}}
    message, key = refusal(client.post("/api/files/stl", json=body))
    assert "slender" in message
    assert key == "width"
    body["part"] = {"material": "wood"}
    assert "ninjaflex" in refusal(client.post("/api/part", json=body), 404)[0]


def test_frames_say_how_the_part_moves(client: TestClient, crane: dict[str, Any]) -> None:
    body = {"problem": crane["problem"], "mask": crane["mask"], "level": "frame"}
    found = client.post("/api/validation", json=body).json()
    assert found["efficiency"] == pytest.approx(1.176, abs=0.001)
    assert len(found["picture"]["stress"]) * found["picture"]["corners"] == len(
        found["picture"]["cells"]
    )


def test_a_check_is_found_again_without_computing_it(
    client: TestClient, crane: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    part = {"width": 1.7}
    body = {"problem": crane["problem"], "mask": crane["mask"], "part": part}
    before = client.post("/api/computations", json=body).json()
    assert before["validation"]["frame"] is None
    assert before["tolerance"] is None
    found = client.post("/api/validation", json={**body, "level": "frame"}).json()
    after = client.post("/api/computations", json=body).json()
    assert after["validation"]["frame"] == {"result": found}
    assert after["validation"]["plane"] is None
    running = client.post("/api/computations", json={**body, "results": False}).json()
    assert running["validation"]["frame"] is None
    monkeypatch.setattr(design_routes, "CODE", ["0.1.0", "another commit"])
    other = client.post("/api/computations", json=body).json()
    assert other["validation"]["frame"] is None


def test_a_design_by_hand_is_kept_and_found_in_the_gallery(
    client: TestClient, crane: dict[str, Any]
) -> None:
    body = {"problem": crane["problem"], "mask": crane["mask"], "title": "mine <b>"}
    kept = client.post("/api/gallery", json=body).json()
    found = client.get(f"/api/gallery/{kept['source']}/{kept['key']}").json()
    assert found["title"] == "mine <b>"
    assert found["mask"] == crane["mask"]
    collections = {each["source"]: each["entries"] for each in client.get("/api/gallery").json()}
    assert kept["key"] in {entry["key"] for entry in collections["kept"]}
    assert {"human-crane", "machine-discs"} <= {entry["key"] for entry in collections["builtin"]}


def test_two_parts_make_a_machine_and_parts_that_do_not_fit_are_named(client: TestClient) -> None:
    keys = []
    for name in ("elementary-down", "elementary-left"):
        problem = problem_to_dict(elementary(7, name.removeprefix("elementary-")))
        body = {"problem": problem, "mask": problem["initial"], "title": name}
        keys.append(client.post("/api/gallery", json=body).json()["key"])
    parts = {
        "first": {"entry": f"kept/{keys[0]}"},
        "second": {"entry": f"kept/{keys[1]}", "join": "first.output"},
    }
    plan = {
        "name": "two", "parts": parts,
        "input": {"ports": ["first.input"]}, "output": {"ports": ["second.output"]},
    }  # fmt: skip
    built = client.post("/api/machines", json={"plan": plan}).json()
    assert built["status"] == "converged"
    assert set(built["parts"]) == {"first", "second"}
    parts["second"]["rotate"] = 120
    message, _ = refusal(client.post("/api/machines", json={"plan": plan}))
    assert "second" in message
    parts["second"]["entry"] = "/etc/passwd"
    refusal(client.post("/api/machines", json={"plan": plan}), 404)


def test_the_page_is_served_every_registered_search_material_and_level(client: TestClient) -> None:
    served = client.get("/api/registries").json()
    registries = {
        "searches": searches,
        "materials": materials,
        "files": page_files,
        "levels": levels,
    }
    for kind, registry in registries.items():
        assert {each["name"] for each in served[kind]} == set(registry), kind
        assert all(each["title"] for each in served[kind]), kind
    assert served["searches"][0]["name"] == DEFAULT_SEARCH
    assert all(each["summary"] for each in served["searches"])
    assert all(each["duration"] for each in served["levels"])
    # The page shows the limit that holds where a task has none.
    limits = {each["name"]: each["strain_limit"] for each in served["materials"]}
    assert limits["ninjaflex"] == materials["ninjaflex"].strain_limit
    assert limits["tpu-95a"] is None


@pytest.mark.parametrize(
    ("address", "changes", "key", "known"),
    [
        ("validation", {"level": "shell"}, "level", "frame"),
        ("files/docx", {}, "suffix", "3mf"),
    ],
)
def test_an_unknown_name_is_refused_with_the_registered_ones(
    client: TestClient, crane: dict[str, Any], address: str, changes: dict[str, Any], key: str,
    known: str,
) -> None:  # fmt: skip
    body = {"problem": crane["problem"], "mask": crane["mask"], **changes}
    message, named = refusal(client.post(f"/api/{address}", json=body))
    assert named == key
    assert known in message
