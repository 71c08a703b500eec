"""Use of the page, from an empty rectangle to a part."""

from __future__ import annotations

import io
import re
import signal
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest
import trimesh

from bellcrank.fem import FemSettings
from bellcrank.machines.elementary import elementary
from bellcrank.machines.library import Library, bundled_folder
from bellcrank.mechanics import VERIFICATION_INCREMENT
from bellcrank.model import (
    find_problem,
    gallery_design,
    human_design,
    problem_to_dict,
    read_design,
    unpack_mask,
)
from bellcrank.part import PartSpec, frame_problem
from bellcrank.search import SpecificationEvaluator
from bellcrank.task import find_task, read_task, task_from_dict
from bellcrank.workflows import validate
from bellcrank.workflows.part_figures import part_figures
from bellcrank.workflows.specification import item_rows
from bellcrank.workflows.tolerance import with_tolerances

from .driving import (
    click,
    drag,
    field,
    fill,
    node,
    place,
    section,
    start_search,
    strut,
    summary,
    task,
    tool,
    until,
)

if TYPE_CHECKING:
    from pathlib import Path

    from .conftest import Server

pytestmark = pytest.mark.slow


def downloaded(page: Any, suffix: str) -> bytes:
    """Download a file of the displayed design."""
    with page.expect_download() as waiting:
        page.locator(f'[data-file="{suffix}"]').click()
    with open(waiting.value.path(), "rb") as file:  # noqa: PTH123
        return file.read()


def test_a_task_is_stated_searched_followed_stopped_played_and_downloaded(page: Any) -> None:
    """On a lattice of 77 nodes with spacing 1, its lowest row at (0.1, 0.136)."""
    section(page, "domain")
    page.get_by_label("Start from").select_option("empty")
    until(page, lambda: summary(page, "supports") == "none")
    assert page.get_by_role("button", name="Design it").is_disabled()
    tool(page, "Supports")
    page.mouse.dblclick(*place(page, *node(page, 3.6, 0.1)))
    until(page, lambda: summary(page, "supports") == "9 nodes")
    assert task(page)["table"]["supports"] == [{"at": [{"edge": "bottom"}]}]

    tool(page, "Inputs")
    first, second = node(page, 7.1, 7.1), node(page, 6.1, 7.1)
    click(page, *first)
    click(page, *second)
    until(page, lambda: summary(page, "inputs") == "2 nodes")
    (given,) = task(page)["table"]["cases"][0]["inputs"]
    assert given["displacement"] == 3
    middle = (0.5 * (first[0] + second[0]), first[1])
    drag(page, (middle[0], middle[1] - 1.2), (middle[0], middle[1] - 1.6))
    until(page, lambda: field(page, "Stroke") == "4")
    page.keyboard.press("Control+z")
    until(page, lambda: field(page, "Stroke") == "3")
    page.keyboard.press("Control+Shift+z")
    until(page, lambda: field(page, "Stroke") == "4")

    tool(page, "Outputs")
    click(page, *node(page, 0.1, 7.1))
    click(page, *node(page, 1.1, 7.1))
    until(page, lambda: summary(page, "outputs") == "2 nodes")
    page.get_by_label("Ask for").select_option("rotation")
    page.locator('.item[data-item="rotation"]').wait_for()
    page.locator('.specification [data-item="case.output.off_axis"]').wait_for()
    items = page.locator(".specification tbody tr")
    until(page, lambda: items.count() == 5)  # with strain, clearance and gain
    assert not page.locator(".error").inner_text()

    start_search(page, "Thorough")
    page.get_by_text("steps/s").wait_for()
    page.locator(".live").wait_for()
    page.locator(".items tbody tr").first.wait_for()
    page.reload()
    page.locator(".items tbody tr").first.wait_for()
    page.get_by_role("button", name="Stop and choose the best").click()
    page.locator('.player[data-ready="yes"]').wait_for()
    page.locator(".figures.part").wait_for()
    assert page.locator(".verdict").first.inner_text()
    assert page.locator(".items thead").inner_text().split()[0] in {"search", "frames"}
    before = page.locator(".player path.plain, .player [class*=heat]").first.get_attribute("d")
    page.wait_for_timeout(300)
    page.get_by_label("Pause the motion").click()
    page.locator(".transport > input").fill("1000")
    assert "mm out" in page.locator(".readout").inner_text()
    assert before is not None
    mesh = trimesh.load(io.BytesIO(downloaded(page, "stl")), file_type="stl")
    assert mesh.is_watertight
    assert closed_in_3mf(downloaded(page, "3mf"))
    assert downloaded(page, "history")[:4] == b"PAR1"
    page.locator(".colour label", has_text="Sensitivity").click()
    page.get_by_text("Dark: removal lowers").wait_for()


def closed_in_3mf(content: bytes) -> bool:
    """Whether the one body of a file is closed, as the 3MF Consortium's own library reads it."""
    lib3mf = pytest.importorskip("lib3mf")
    model = lib3mf.get_wrapper().CreateModel()
    model.QueryReader("3mf").ReadFromBuffer(content)
    bodies = model.GetMeshObjects()
    assert bodies.Count() == 1
    bodies.MoveNext()
    return bool(bodies.GetCurrentMeshObject().IsManifoldAndOriented())


def test_a_design_is_changed_by_hand_and_evaluated_by_the_solver(page: Any) -> None:
    tool(page, "By hand")
    page.locator(".readout .latency").wait_for()
    before = page.locator(".readout strong").inner_text()
    for x in (2.6, 3.6, 4.6):
        click(page, *strut(page, x, 6.2))
    until(page, f"document.querySelector('.readout strong').textContent !== '{before}'")
    page.wait_for_timeout(1500)
    kept = task(page)
    own = task_from_dict(kept["table"])
    problem = own.problem
    mask = unpack_mask(kept["hand"], problem.lattice.beam_count)
    assert mask.sum() == len(mask) - 3
    evaluator = SpecificationEvaluator(problem)
    exact = evaluator.evaluate(mask, VERIFICATION_INCREMENT).efficiency
    shown = float(page.locator(".readout strong").inner_text().replace("−", "-"))
    assert shown == pytest.approx(exact, abs=6e-4)
    rows = item_rows(problem, own.part, {"search": evaluator.results()})[1:]
    assert page.locator(".specification tbody tr").count() == len(rows)
    for row, (_, _, reached, _, met) in zip(
        page.locator(".specification tbody tr").all(), rows, strict=True
    ):
        assert reached in row.inner_text()
        assert row.get_attribute("class") == ("met" if met == "yes" else "missed")
    page.keyboard.press("Control+z")
    page.wait_for_timeout(500)
    assert unpack_mask(task(page)["hand"], problem.lattice.beam_count).sum() == len(mask) - 2
    for again in (lambda: tool(page, "Inputs"), page.reload):
        again()
        page.locator("svg.canvas").wait_for()
        tool(page, "By hand")
        page.locator(".readout .latency").wait_for()
        page.locator(".specification tbody tr.met").first.wait_for()
        page.locator(".response").wait_for(state="attached")
    page.get_by_role("button", name="Save this design").click()
    page.locator('.player[data-ready="yes"]').wait_for()
    page.get_by_role("button", name="Open its task").click()
    until(page, lambda: task(page)["table"] == kept["table"])


def test_holes_are_drawn_and_symmetry_is_asked_and_the_task_is_saved_and_loaded(
    page: Any, tmp_path: Any
) -> None:
    tool(page, "Zones")
    drag(page, (3.0, 2.5), (5.0, 4.2))
    until(page, lambda: len(task(page)["table"]["domain"].get("holes", [])) == 1)
    until(page, lambda: "nodes" in summary(page, "domain") and beams(page) < 196)
    page.locator(".zones .choice label", has_text="Solid").click()
    page.locator(".zones .choice label", has_text="Circle").click()
    drag(page, (6.0, 3.0), (7.6, 3.0))
    until(page, lambda: "circle" in task(page)["table"]["domain"].get("solid", [{}])[0])
    section(page, "limits")
    page.get_by_label("Symmetry of the design").select_option("y")
    page.locator(".step.limits .fault").wait_for()  # held at the bottom only
    assert page.get_by_role("button", name="Design it").is_disabled()
    page.get_by_label("Symmetry of the design").select_option("")
    page.locator(".step.limits .fault").wait_for(state="detached")
    with page.expect_download() as waiting:
        page.get_by_role("button", name="Download the task").click()
    waiting.value.save_as(tmp_path / "task.toml")
    table = task(page)["table"]
    assert read_task(tmp_path / "task.toml").problem.hash == task_from_dict(table).problem.hash
    text = (tmp_path / "task.toml").read_text()
    page.get_by_label("Start from").select_option("selector")
    until(page, lambda: task(page)["table"]["name"] == "selector")
    (tmp_path / "broken.toml").write_text(text.replace("displacement", "displaced"))
    page.get_by_label("File to open").set_input_files(tmp_path / "broken.toml")
    page.get_by_text("unknown key", exact=False).first.wait_for()
    page.get_by_label("File to open").set_input_files(tmp_path / "task.toml")
    until(page, lambda: task(page)["table"]["name"] == "my part")
    assert task_from_dict(task(page)["table"]).problem.hash == task_from_dict(table).problem.hash


def test_nodes_keep_their_distance_from_the_sides_of_a_part_of_another_size(page: Any) -> None:
    section(page, "domain")
    fill(page, "Width", "62")
    fill(page, "Height", "54")
    until(page, lambda: task(page)["table"]["domain"]["size"] == [62, 54])
    until(page, lambda: page.get_by_role("button", name="Design it").is_enabled())
    assert summary(page, "inputs") == summary(page, "outputs") == "2 nodes"
    (given,) = task(page)["table"]["cases"][0]["inputs"]
    assert given["at"] == [{"point": [56, 52]}, {"point": [46, 52]}]
    # Too narrow for both: the fault is shown in its section, and undo mends it.
    fill(page, "Width", "22")
    page.locator(".faulty .fault").wait_for()
    assert page.get_by_role("button", name="Design it").is_disabled()
    page.get_by_role("button", name="Undo").click()
    page.locator(".fault").first.wait_for(state="detached")
    until(page, lambda: page.get_by_role("button", name="Design it").is_enabled())


def test_fields_that_are_typed_quickly_one_after_the_other_keep_all_numbers(page: Any) -> None:
    section(page, "domain")
    page.get_by_label("Width", exact=True).click()
    page.keyboard.press("Control+a")
    page.keyboard.type("92")
    page.keyboard.press("Tab")
    page.keyboard.press("Control+a")
    page.keyboard.type("62", delay=80)
    page.keyboard.press("Tab")
    until(page, lambda: task(page)["table"]["domain"]["size"] == [92, 62])
    assert (field(page, "Width"), field(page, "Height")) == ("92", "62")


def test_undo_outlasts_a_reload_and_tabs_keep_their_own_tasks(page: Any, server: Server) -> None:
    section(page, "domain")
    before = task(page)
    fill(page, "Strut width", "1.6")
    until(page, lambda: task(page)["table"]["part"]["width"] == 1.6)
    page.reload()
    page.locator("svg.canvas").wait_for()
    page.keyboard.press("Control+z")
    until(page, lambda: task(page) == before)
    other = page.context.new_page()
    other.goto(server.address)
    other.locator("svg.canvas").wait_for()
    section(other, "domain")
    fill(other, "Strut width", "1.8")
    until(other, lambda: task(other)["table"]["part"]["width"] == 1.8)
    page.get_by_text("changed in another tab").wait_for()
    assert task(page) == before
    page.get_by_role("button", name="Open that one here").click()
    until(page, lambda: task(page)["table"]["part"]["width"] == 1.8)
    other.close()


def test_an_error_is_shown_in_its_section(page: Any) -> None:
    tool(page, "Outputs")
    page.locator('[data-key="outputs-0-off_axis-0"]').fill("10")
    page.keyboard.press("Tab")
    page.locator(".step.outputs .fault", has_text="write '10%'").wait_for()
    assert page.get_by_role("button", name="Design it").is_disabled()
    page.locator('[data-key="outputs-0-off_axis-0"]').fill("10%")
    page.keyboard.press("Tab")
    page.locator(".step.outputs .fault").wait_for(state="detached")
    section(page, "domain")
    fill(page, "Strut width", "12")
    page.locator(".step.domain .fault", has_text="not slender").wait_for()
    fill(page, "Strut width", "2")
    page.locator(".step.domain .fault").wait_for(state="detached")


def test_every_bundled_task_is_shown_with_its_specification(page: Any) -> None:
    section(page, "domain")
    for name in ("gripper", "selector", "bracket", "arc", "twist", "inverter", "straight-crane"):
        page.get_by_label("Start from").select_option(name)
        until(page, lambda name=name: task(page)["table"]["name"] == name)
        found = find_task(name)
        assert found is not None
        wanted = found.problem.specification
        assert wanted is not None
        count = len(wanted.items) + len(wanted.maximise)
        until(page, lambda count=count: page.locator(".specification tbody tr").count() == count)
        assert page.get_by_role("button", name="Design it").is_enabled()


def beams(page: Any) -> int:
    """Return the number of struts of the lattice."""
    return int(summary(page, "domain").split(", ")[1].split()[0].replace(",", ""))


def test_a_machine_is_made_of_two_parts(page: Any, server: Server) -> None:
    for direction in ("down", "left"):
        made = """async ([name, problem]) => {
          const headers = {"content-type": "application/json"};
          const body = JSON.stringify({problem, mask: problem.initial, title: name});
          await fetch("/api/gallery", {method: "POST", headers, body});
        }"""
        problem = problem_to_dict(elementary(7, direction))
        page.evaluate(made, [f"elementary-{direction}", problem])
    page.goto(f"{server.address}/#/machine")
    page.get_by_text("No parts", exact=True).wait_for()
    page.locator("button.tile", has_text="elementary-down").click()
    page.get_by_text("first: elementary-down").wait_for()
    page.get_by_text("No parts", exact=True).wait_for(state="hidden")
    page.locator("button.tile", has_text="elementary-left").click()
    page.get_by_text("second: elementary-left").wait_for()
    until(page, "document.querySelector('.readout strong')?.textContent.length > 3")
    page.get_by_label("Rotation").last.select_option("120")
    page.locator(".error", has_text="second").wait_for()
    page.get_by_label("Rotation").last.select_option("0")
    page.locator(".error:empty").wait_for(state="attached")
    page.get_by_role("button", name="Assemble").click()
    page.wait_for_url("**/#/design/kept/*")
    page.locator('.player[data-ready="yes"]').wait_for()


def test_the_page_and_its_search_survive_the_end_of_the_server(page: Any, server: Server) -> None:
    name = start_search(page, "Standard")
    page.get_by_text("steps/s").wait_for()
    until(page, "document.querySelector('.curve.best')?.getAttribute('d').length > 20")
    server.end(signal.SIGKILL)
    page.get_by_text("The server cannot be reached", exact=False).first.wait_for()
    server.start()
    page.get_by_text("steps/s").wait_for()
    page.goto(f"{server.address}/#/runs")
    page.locator(f'a[href="#/run/{name}"]').click()
    page.get_by_role("button", name="Stop and choose the best").click()
    page.locator('.player[data-ready="yes"]').wait_for()


def test_a_bundled_machine_is_opened_and_changed(page: Any, server: Server) -> None:
    page.goto(f"{server.address}/#/machine")
    page.locator('button.tile[data-entry="machines/amplifier"]').click()
    page.locator(".readout strong", has_text=re.compile(r"\d")).wait_for()
    page.locator(".figures.part").wait_for()
    whole = page.locator(".readout strong").inner_text()
    page.locator(".panel section", has_text="second").get_by_label("Mirrored").check()
    page.locator(".error", has_text="second").wait_for()
    page.keyboard.press("Control+z")
    until(page, f"document.querySelector('.readout strong')?.textContent === '{whole}'")
    page.reload()
    page.locator(".panel h2", has_text="second").wait_for()
    page.get_by_role("button", name="Remove second").click()
    until(page, f"document.querySelector('.readout strong')?.textContent !== '{whole}'")
    assert page.locator(".panel h2", has_text="second").count() == 0
    library = page.locator('.collection[data-source="library"]')
    library.get_by_label("Moves").select_option("up")
    library.get_by_label("Size").select_option("9 wide")
    count = len(Library((bundled_folder(),)).search(direction="up", columns=9))
    assert library.locator(".note[role=status]").inner_text() == f"{count} designs"
    library.locator("button.tile", has_text="straight, 50 g").click()
    page.locator(".panel h2", has_text="second: Up, 9 wide").wait_for()
    page.goto(f"{server.address}/#/design/machines/gripper")
    page.get_by_role("button", name="Open its plan").click()
    page.locator(".panel h2", has_text="left-fore").wait_for()
    page.locator(".readout strong").wait_for()


def test_a_whole_search_is_compared_checked_by_finite_elements_and_leaves_its_history(
    page: Any, tmp_path: Path
) -> None:
    """A search of springs by the programming interface, which is not refined and so takes less."""
    human = human_design("crane")
    assert human is not None
    part = {"width": 2.0, "thickness": 5.0, "scale": 10.0, "material": "ninjaflex"}
    name = page.evaluate(
        """async ([problem, part, reference]) => {
          const body = {title: "crane", session: "s", problem, part, reference, steps: 2000};
          const headers = {"content-type": "application/json"};
          const sent = {method: "POST", headers, body: JSON.stringify(body)};
          return (await (await fetch("/api/runs", sent)).json()).id;
        }""",
        [problem_to_dict(human.problem), part, human.mask_hex],
    )
    page.goto(page.url.split("#")[0] + f"#/run/{name}")
    page.locator(".status.finished").wait_for()
    page.locator('.player[data-ready="yes"]').wait_for()
    assert page.locator(".figures tr", has_text="Your design").count() == 1
    row = page.locator(".figures:not(.part) tr", has_text="Frame")  # selected by frame analysis
    row.get_by_text("MPa").wait_for()
    (tmp_path / "design.json").write_bytes(downloaded(page, "json"))
    design = read_design(tmp_path / "design.json")
    spec = PartSpec.from_dict(design.provenance["part"])
    exact = validate(design, spec, [("frame", FemSettings())])
    shown = float(row.locator("td").first.inner_text().replace("−", "-"))
    assert shown == pytest.approx(exact.analyses[0].efficiency, abs=6e-4)
    page.locator(".figures.part").wait_for()
    (figures,) = part_figures(design, spec)
    for text in (f"{100 * figures['off_axis']:.1f}\u00a0%", f"{figures['rotation_deg']:.1f}°"):
        assert text in page.locator(".figures.part").inner_text()
    page.get_by_role("button", name="Show stress").click()
    page.locator(".stress path").first.wait_for(state="attached")
    assert downloaded(page, "history")[:4] == b"PAR1"
    assert downloaded(page, "svg").lstrip()[:1] == b"<"


def test_a_result_that_is_left_ends_its_requests(page: Any, server: Server) -> None:
    """A browser has few connections to a server, which an open check would keep."""
    ended: list[str] = []
    page.on("requestfailed", lambda request: ended.append(request.url))
    page.route("**/api/tolerance", lambda _route: None)  # it is never answered
    page.goto(f"{server.address}/#/design/builtin/machine-crane")
    page.locator(".figures.part").wait_for()
    with page.expect_request("**/api/tolerance"):
        page.get_by_role("button", name="Compute the tolerance").click()
    assert not [url for url in ended if url.endswith("/tolerance")]
    page.goto(f"{server.address}/#/gallery")
    page.locator(".tile").first.wait_for()
    until(page, lambda: any(url.endswith("/tolerance") for url in ended))


def test_a_computation_is_stopped_and_begun_again(page: Any, server: Server) -> None:
    page.goto(f"{server.address}/#/design/builtin/human-crane")
    page.locator(".figures.part").wait_for()
    page.get_by_role("button", name="Compute the tolerance").click()
    stop = page.get_by_role("button", name="Stop: Tolerance")
    with page.expect_response(
        lambda answer: answer.url.endswith("/api/tolerance") and answer.status == 409
    ):
        stop.click()
    page.get_by_role("button", name="Compute the tolerance").wait_for()
    assert stop.count() == 0


def test_random_prints_are_an_item_of_a_task_over_tolerances(page: Any, server: Server) -> None:
    bundled = find_task("slider")
    assert bundled is not None
    design = with_tolerances(bundled.problem.full_design(), bundled.part)
    body = {
        "problem": problem_to_dict(design.problem), "mask": design.mask_hex, "title": "prints",
        "provenance": {"part": bundled.part.to_dict()},
    }  # fmt: skip
    kept = page.request.post(f"{server.address}/api/gallery", data=body).json()
    found = {
        "sentence": "20 random prints", "prints": 20, "met": 18, "met_words": "meet all items",
        "deviations": "widths", "rows": [["item", "wanted", "drawn", "95 %", "yield"]],
        "losses": {"beams": [], "cost": []},
    }  # fmt: skip
    page.route("**/api/validation", lambda _route: None)  # it is never answered
    page.route("**/api/tolerance", lambda route: route.fulfill(json=found))
    page.goto(f"{server.address}/#/design/{kept['source']}/{kept['key']}")
    row = page.locator('[aria-label="Result"] tr[data-item="tolerance"]')
    row.wait_for()
    assert row.get_attribute("class") == "missed"  # 95 % are wanted
    assert "random prints" in row.inner_text()
    assert "90 %" in row.inner_text()
    verdict = page.locator('[aria-label="Result"] .verdict').inner_text()
    assert "Of 20 random prints, 18 (90 %) meet all items; see Tolerance below." in verdict
    with page.expect_request("**/api/runs") as asked:
        page.get_by_role("button", name="Refine over tolerances").click()
    assert asked.value.post_data_json["tolerant"]
    page.wait_for_url("**/#/run/*")  # the movement of a design can be paused, too
    prints = page.locator(".facts", has_text="random prints")
    prints.wait_for()
    assert re.search(r"\d % meet all items .*; 95 % are needed", prints.inner_text())
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Continue").wait_for(timeout=20_000)


def test_the_tolerance_of_a_design_is_shown_and_it_is_compared_with_another(
    page: Any, server: Server
) -> None:
    page.goto(f"{server.address}/#/design/builtin/machine-crane")
    page.locator(".figures.part").wait_for()
    page.get_by_role("button", name="Compute the tolerance").click()
    page.locator(".items.tolerance tbody tr").first.wait_for()
    page.locator(".colour label", has_text="Loss of struts").click()
    assert page.locator('.colour input[value="loss"]').is_checked()
    assert page.locator(".player .beam.effect-3").get_attribute("d")
    page.get_by_label("Fill the supports to a plate for clamping").check()
    page.locator('[data-key="screws"]').fill("2")
    page.keyboard.press("Tab")
    note = page.locator("[data-gripped]", has_text="Centres of the holes")
    note.wait_for()
    assert re.search(r"\d × \d+(\.\d)? × 5\.1 mm, \d+\.\d g", note.inner_text())
    assert note.inner_text().split("Centres")[1].count("(") == 2
    assert page.locator(".player .printed").get_attribute("d").count("M") > 10
    assert page.locator(".player .screw").get_attribute("d").count("M") == 2
    worst = page.locator(".items.tolerance .worst").first.inner_text()
    assert re.search("^worst: widths .*, direction .*, stroke .*, prints ", worst)
    moving = page.get_by_text("It moves within").inner_text()
    assert re.search(r"It moves within \d+(\.\d)? × \d+(\.\d)? mm", moving)
    page.get_by_label("Compare with").select_option("builtin/human-crane")
    table = page.locator(".compare .figures.part")
    table.wait_for()
    for name in ("human-crane", "machine-crane"):
        human = (
            human_design("crane") if name == "human-crane" else gallery_design("machine", "crane")
        )
        assert human is not None
        spec = PartSpec()
        design = replace(human, problem=frame_problem(human.problem, spec))
        (figures,) = part_figures(design, spec)
        assert f"{100 * figures['off_axis']:.1f}\u00a0%" in table.inner_text()
    page.locator('.player[data-ready="yes"]').nth(1).wait_for()


def test_a_search_without_a_design_shows_the_reason_and_suggestions(
    page: Any, server: Server
) -> None:
    name = page.evaluate(
        """async (problem) => {
      const body = {title: "hopeless", session: "s", problem, steps: 50, chains: 1,
                    goals: ["input-stiffness >= 1000"]};
      const headers = {"content-type": "application/json"};
      const sent = {method: "POST", headers, body: JSON.stringify(body)};
      return (await (await fetch("/api/runs", sent)).json()).id;
    }""",
        problem_to_dict(find_problem("scaling-8")),
    )
    page.goto(f"{server.address}/#/run/{name}")
    message = page.locator(".panel .fault", has_text="Suggestions")
    message.wait_for()
    assert "accepted no design" in message.inner_text()
    assert "Search longer" in message.inner_text()
    assert "--" not in message.inner_text()
    page.get_by_role("link", name="Back to the task").click()
    page.locator("svg.canvas").wait_for()


def test_a_link_carries_the_task_to_another_browser(page: Any, server: Server) -> None:
    section(page, "domain")
    fill(page, "Strut width", "1.6")
    until(page, lambda: task(page)["table"].get("part") == {"width": 1.6})
    page.context.grant_permissions(["clipboard-read", "clipboard-write"], origin=server.address)
    page.get_by_role("button", name="Copy link").click()
    page.get_by_role("button", name="Copied").wait_for()
    link = page.evaluate("navigator.clipboard.readText()")
    sent = task(page)
    page.evaluate("localStorage.clear()")
    page.evaluate("sessionStorage.clear()")
    page.goto("about:blank")
    page.goto(link)
    page.locator("svg.canvas").wait_for()
    until(page, "localStorage.getItem('bellcrank-task') !== null")
    assert task(page) == sent
