"""Use of the page, from an empty lattice to a part."""

from __future__ import annotations

import io
import math
import signal
from typing import TYPE_CHECKING, Any

import pytest
import trimesh

from bellcrank.fem import FemSettings
from bellcrank.machines.library import Library, bundled_folder
from bellcrank.mechanics import VERIFICATION_INCREMENT, FrameEvaluator
from bellcrank.model import problem_from_dict, read_design, unpack_mask
from bellcrank.part import PartSpec, frame_problem
from bellcrank.workflows import validate

from .driving import click, drag, start_search, summary, task, tool, until

if TYPE_CHECKING:
    from pathlib import Path

    from .conftest import Server

pytestmark = pytest.mark.slow

HEIGHT = math.sqrt(3.0) / 2.0


def downloaded(page: Any, suffix: str) -> bytes:
    """Download a file of the displayed design."""
    with page.expect_download() as waiting:
        page.locator(f'[data-file="{suffix}"]').click()
    with open(waiting.value.path(), "rb") as file:  # noqa: PTH123
        return file.read()


def test_a_task_is_defined_searched_followed_stopped_played_and_downloaded(page: Any) -> None:
    top = 8 * HEIGHT
    page.get_by_role("button", name="Clear").click()
    until(page, lambda: summary(page, "supports") == "none")
    assert page.get_by_role("button", name="Design it").is_disabled()
    page.mouse.dblclick(*_at(page, 3.5, 0.0))
    until(page, lambda: summary(page, "supports") == "8 nodes")

    tool(page, "Input")
    page.get_by_role("button", name="Clear").click()
    click(page, 7.5, top)
    drag(page, (8.2, top - 1.3), (7.6, top - 0.5))
    assert task(page)["problem"]["input"]["nodes"] == [67, 75]
    page.get_by_label("down", exact=True).click()
    tip = 0.5 * (7.5 + 8.0)
    amount = task(page)["problem"]["input"]["amount"]
    middle = top - 0.5 * HEIGHT
    drag(page, (tip, middle - 4 * amount), (tip, middle - 1.6))
    assert task(page)["problem"]["input"]["amount"] == pytest.approx(0.4, abs=0.02)
    until(page, lambda: "4.0 mm down" in summary(page, "input"))
    page.keyboard.press("Control+z")
    assert task(page)["problem"]["input"]["amount"] == amount
    page.keyboard.press("Control+Shift+z")

    tool(page, "Output")
    until(page, lambda: summary(page, "output") == "2 nodes, left")
    page.wait_for_timeout(400)
    assert not page.locator(".error").inner_text()

    start_search(page, "Thorough")
    page.get_by_text("steps/s").wait_for()
    until(page, "document.querySelector('.curve.best')?.getAttribute('d').length > 20")
    page.reload()
    until(page, "document.querySelector('.curve.best')?.getAttribute('d').length > 20")
    page.get_by_role("button", name="Stop and choose the best").click()
    page.locator('.player[data-ready="yes"]').wait_for()
    assert float(page.locator(".headline strong").inner_text().replace("−", "-")) > 0.5
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


def _at(page: Any, x: float, y: float) -> tuple[float, float]:
    from .driving import place

    return place(page, x, y)


def test_a_design_is_changed_by_hand_and_evaluated_by_the_solver(page: Any) -> None:
    tool(page, "By hand")
    page.locator(".readout .latency").wait_for()
    before = page.locator(".readout strong").inner_text()
    for x in (2.5, 3.5, 4.5):
        click(page, x, 4 * HEIGHT)
    until(page, f"document.querySelector('.readout strong').textContent !== '{before}'")
    page.wait_for_timeout(500)
    kept = task(page)
    problem = problem_from_dict({**kept["problem"], "designable": _free(kept)})
    mask = unpack_mask(kept["hand"], problem.lattice.beam_count)
    assert mask.sum() == len(mask) - 3
    frame = frame_problem(problem, PartSpec(width=2.0))
    exact = FrameEvaluator(frame).evaluate(mask, VERIFICATION_INCREMENT).efficiency
    shown = float(page.locator(".readout strong").inner_text().replace("−", "-"))
    assert shown == pytest.approx(exact, abs=6e-4)
    page.keyboard.press("Control+z")
    page.wait_for_timeout(500)
    assert unpack_mask(task(page)["hand"], problem.lattice.beam_count).sum() == len(mask) - 2
    page.get_by_role("button", name="Save this design").click()
    page.locator('.player[data-ready="yes"]').wait_for()


def _free(kept: Any) -> list[int]:
    return [k for k, rule in enumerate(kept["rules"]) if rule == "auto"][:1]


def test_beams_are_marked_and_mirrored_and_the_task_is_saved_and_loaded(
    page: Any, tmp_path: Any
) -> None:
    tool(page, "Beams")
    total = summary(page, "beams")
    page.get_by_label("Mirror symmetry left/right").check()
    click(page, 2.5, 4 * HEIGHT)
    assert task(page)["rules"].count("keep") == 2
    page.locator(".beams .choice label", has_text="Absent").click()
    click(page, 4.0, 2 * HEIGHT)
    assert task(page)["rules"].count("never") in {1, 2}
    until(page, lambda: summary(page, "beams") != total)
    page.locator(".step.lattice h2 button").click()
    with page.expect_download() as waiting:
        page.get_by_role("button", name="Save TOML").click()
    waiting.value.save_as(tmp_path / "task.toml")
    text = (tmp_path / "task.toml").read_text()
    rules = task(page)["rules"]
    page.get_by_label("Start from").select_option("crane")
    until(page, "JSON.parse(localStorage.getItem('bellcrank-task')).problem.name === 'crane'")
    (tmp_path / "broken.toml").write_text(text.replace("drive", "drove"))
    page.locator('input[type="file"]').set_input_files(tmp_path / "broken.toml")
    page.get_by_text("unknown key", exact=False).first.wait_for()
    page.locator('input[type="file"]').set_input_files(tmp_path / "task.toml")
    until(page, "JSON.parse(localStorage.getItem('bellcrank-task')).problem.name === 'my actuator'")
    assert task(page)["rules"] == rules


def test_an_error_is_shown_in_its_section(page: Any) -> None:
    page.locator(".step.lattice h2 button").click()
    page.get_by_label("Start from").select_option("discs")
    until(page, "JSON.parse(localStorage.getItem('bellcrank-task')).problem.name === 'discs'")
    tool(page, "Beams")
    page.get_by_label("Mirror symmetry left/right").check()
    page.locator(".step.beams .fault", has_text="not symmetric").wait_for()
    assert page.get_by_role("button", name="Design it").is_disabled()
    page.get_by_label("Mirror symmetry left/right").uncheck()
    page.locator(".step.beams .fault").wait_for(state="detached")


def test_a_machine_is_made_of_two_parts(page: Any, server: Server) -> None:
    for direction in ("down", "left"):
        made = """async (name) => {
          const problem = await (await fetch(`/api/problems/${name}`)).json();
          const headers = {"content-type": "application/json"};
          const body = JSON.stringify({problem, mask: problem.initial, title: name});
          await fetch("/api/gallery", {method: "POST", headers, body});
        }"""
        page.evaluate(made, f"elementary-{direction}")
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
    page.locator(".readout strong").wait_for()
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
    tool(page, "By hand")
    page.locator(".readout .latency").wait_for()
    click(page, 2.5, 4 * HEIGHT)
    until(page, "JSON.parse(localStorage.getItem('bellcrank-task')).hand !== null")
    start_search(page)
    page.locator(".status.finished").wait_for()
    page.locator('.player[data-ready="yes"]').wait_for()
    assert page.locator(".figures tr", has_text="Your design").count() == 1
    row = page.locator(".figures tr", has_text="Frame")  # selected by frame analysis
    row.get_by_text("MPa").wait_for()
    (tmp_path / "design.json").write_bytes(downloaded(page, "json"))
    design = read_design(tmp_path / "design.json")
    part = PartSpec.from_dict(design.provenance["part"])
    exact = validate(design, part, [("frame", FemSettings())])
    shown = float(row.locator("td").first.inner_text().replace("−", "-"))
    assert shown == pytest.approx(exact.analyses[0].efficiency, abs=6e-4)
    page.get_by_role("button", name="Show stress").click()
    page.locator(".stress path").first.wait_for(state="attached")
    assert downloaded(page, "history")[:4] == b"PAR1"
    assert downloaded(page, "svg").lstrip()[:1] == b"<"


def test_a_search_without_a_design_shows_the_reason_and_suggestions(
    page: Any, server: Server
) -> None:
    name = page.evaluate("""async () => {
      const problem = await (await fetch("/api/problems/scaling-8")).json();
      const body = {title: "hopeless", session: "s", problem, steps: 50, chains: 1,
                    goals: ["input-stiffness >= 1000"]};
      const headers = {"content-type": "application/json"};
      const sent = {method: "POST", headers, body: JSON.stringify(body)};
      return (await (await fetch("/api/runs", sent)).json()).id;
    }""")
    page.goto(f"{server.address}/#/run/{name}")
    message = page.locator(".panel .fault", has_text="Suggestions")
    message.wait_for()
    assert "accepted no design" in message.inner_text()
    assert "Search longer" in message.inner_text()
    assert "--" not in message.inner_text()
    page.get_by_role("link", name="Back to the task").click()
    page.locator("svg.canvas").wait_for()


def test_a_link_carries_the_task_to_another_browser(page: Any, server: Server) -> None:
    tool(page, "Beams")
    click(page, 2.5, 4 * HEIGHT)
    page.locator(".step.lattice h2 button").click()
    page.context.grant_permissions(["clipboard-read", "clipboard-write"], origin=server.address)
    page.get_by_role("button", name="Copy link").click()
    page.get_by_role("button", name="Copied").wait_for()
    link = page.evaluate("navigator.clipboard.readText()")
    sent = task(page)
    page.evaluate("localStorage.clear()")
    page.goto("about:blank")
    page.goto(link)
    page.locator("svg.canvas").wait_for()
    until(page, "localStorage.getItem('bellcrank-task') !== null")
    assert task(page)["rules"] == sent["rules"]
    assert task(page)["problem"] == sent["problem"]


@pytest.mark.parametrize("kind", ["Disordered", "Discs", "Crane"])
def test_another_kind_of_lattice_keeps_supports_input_and_output(page: Any, kind: str) -> None:
    page.locator(".step.lattice h2 button").click()
    page.locator(".lattice .choice label", has_text=kind).click()
    until(
        page,
        "JSON.parse(localStorage['bellcrank-task']).lattice.kind !== 'triangular-rectangle'",
    )
    problem = task(page)["problem"]
    lowest = min(y for _, y in problem["positions"])
    held = [problem["positions"][node][1] for node in problem["supports"]["fixed"]]
    assert len(held) >= 5
    assert max(held) < lowest + 0.8
    assert problem["input"]["nodes"]
    assert problem["output"]["nodes"]
    assert page.get_by_role("button", name="Design it").is_enabled()
