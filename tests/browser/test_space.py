"""Tasks and parts in space on the page."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import pytest

axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe")

from bellcrank.machines.bundled import bundled_part  # noqa: E402
from bellcrank.model import problem_to_dict  # noqa: E402
from bellcrank.task import find_task  # noqa: E402

from .driving import section, summary, task, tool, until  # noqa: E402

if TYPE_CHECKING:
    from .conftest import Server

pytestmark = pytest.mark.slow

KILOBYTES_FLAT, KILOBYTES_IN_ALL = 80, 900
"""Largest size of the page before a view in space is opened, and with it."""
APART = 20
"""Distance of points at which nodes are sought, pixels."""


def findings(page: Any) -> list[str]:
    """Return the serious findings of axe."""
    found = axe.Axe().run(page).response["violations"]
    return [each["id"] for each in found if each["impact"] in {"serious", "critical"}]


def begin(page: Any, name: str) -> None:
    """Open a task of the list."""
    section(page, "domain")
    page.locator('[data-key="start"]').select_option(name)
    page.locator(".space canvas").wait_for()


def name_of_next_node(page: Any) -> str:
    """Move the pointer over the drawing to the next node and return its name."""
    box = page.locator(".space canvas").bounding_box()
    tip = page.locator(".space-canvas .tip")
    for y in range(int(box["y"]) + 30, int(box["y"] + box["height"]) - 30, APART):
        for x in range(int(box["x"]) + 30, int(box["x"] + box["width"]) - 30, APART):
            page.mouse.move(x, y)
            if tip.is_visible():
                page.mouse.click(x, y)
                return str(tip.inner_text())
    raise AssertionError("no node under the pointer")


def test_a_task_in_space_is_stated_by_layers_nodes_and_keys(page: Any) -> None:
    begin(page, "empty-space")
    tool(page, "Supports")
    layer = page.get_by_label("Layer of nodes")
    layer.select_option("0")
    page.get_by_role("button", name="Add all free nodes of the layer").click()
    until(page, lambda: summary(page, "supports") == "10 nodes")
    assert task(page)["table"]["supports"][0]["at"] == [{"face": "bottom"}]

    tool(page, "Inputs")
    layer.select_option(str(layer.locator("option").count() - 2))  # the highest layer
    named = name_of_next_node(page)
    until(page, lambda: summary(page, "inputs") == "1 node")
    (given,) = task(page)["table"]["cases"][0]["inputs"]
    numbers = [float(text) for text in re.findall(r"-?\d+\.\d", named)]
    assert given["at"][0]["point"] == pytest.approx(numbers, abs=0.051)
    page.locator('[data-key="inputs-0-direction"]').select_option("front")
    until(page, lambda: task(page)["table"]["cases"][0]["inputs"][0]["direction"] == "front")

    tool(page, "Outputs")
    layer.select_option("")
    page.locator(".space canvas").focus()
    page.keyboard.press("ArrowUp")
    page.keyboard.press("PageDown")  # the highest layer only
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Space")
    until(page, lambda: summary(page, "outputs") == "1 node")
    assert "node at" in page.locator(".visually-hidden[role=status]").inner_text()
    page.locator('[data-key="outputs-0-direction"]').select_option("vector")
    page.locator('[data-key="outputs-0-vector"]').fill("1, 0, 1")
    page.keyboard.press("Tab")
    until(page, lambda: task(page)["table"]["cases"][0]["outputs"][0]["direction"] == [1, 0, 1])

    section(page, "domain")
    page.locator('[data-key="zone-add"]').select_option("sphere")
    page.locator('[data-key="zone-holes-0-radius"]').fill("6")
    page.keyboard.press("Tab")
    until(page, lambda: task(page)["table"]["domain"]["holes"][0]["radius"] == 6)
    until(page, lambda: page.get_by_role("button", name="Design it").is_enabled())
    page.locator(".specification tr", has_text="gain").first.wait_for()
    page.reload()
    page.locator(".space canvas").wait_for()
    until(page, lambda: summary(page, "supports").endswith("nodes"))
    assert task(page)["table"]["domain"]["size"] == [45, 17, 45]


def test_an_empty_box_gets_a_lattice_that_is_symmetric_by_thirds_of_a_turn(page: Any) -> None:
    page.get_by_role("button", name="Empty box in space").click()
    page.locator(".space canvas").wait_for()
    section(page, "domain")
    page.locator('[data-key="domain-depth"]').fill("45")
    page.keyboard.press("Tab")
    until(page, lambda: task(page)["table"]["domain"]["size"] == [45, 45, 45])
    page.locator('[data-key="domain-cells"]').select_option("on-corner")
    until(page, lambda: "110 nodes" in summary(page, "domain"))
    page.get_by_text("designs may be 3-fold symmetric").wait_for()
    chosen = task(page)["table"]["domain"]["cells"]
    section(page, "limits")
    page.get_by_label("Symmetry of the design").select_option("3-fold")
    page.get_by_text("It needs the lattice “octet on a corner").wait_for()
    # It is that of the bundled task, whose design is searched with this symmetry.
    begin(page, "twist-column")
    until(page, lambda: task(page)["table"]["name"] == "twist-column")
    assert task(page)["table"]["domain"]["cells"] == chosen
    assert page.locator('[data-key="domain-cells"]').input_value() == "on-corner"
    until(page, lambda: page.get_by_role("button", name="Design it").is_enabled())


def test_an_output_turns_about_the_middle_node_of_an_input(page: Any, server: Server) -> None:
    begin(page, "twist-column")
    until(
        page, lambda: (summary(page, "inputs"), summary(page, "outputs")) == ("1 node", "6 nodes")
    )
    tool(page, "Outputs")
    page.get_by_text("turns", exact=True).click()
    tool(page, "Inputs")
    layer, free = page.get_by_label("Layer of nodes"), page.locator('[data-key="whole-layer"]')
    layer.select_option(str(layer.locator("option").count() - 2))  # the highest layer
    free.click()
    page.locator(".notice", has_text="All nodes of this layer belong to").wait_for()
    layer.select_option("3")
    free.click()
    until(page, lambda: int(summary(page, "inputs").split()[0]) > 2)
    assert summary(page, "outputs") == "6 nodes"
    page.get_by_role("button", name="Keep its middle node only").click()
    until(page, lambda: summary(page, "inputs") == "1 node")

    task_of_turn = find_task("twist-column")
    assert task_of_turn is not None
    problem = problem_to_dict(task_of_turn.problem)
    body = {"problem": problem, "mask": problem["initial"], "title": "turns"}
    kept = page.request.post(f"{server.address}/api/gallery", data=body).json()
    page.goto(f"{server.address}/#/design/{kept['source']}/{kept['key']}")
    page.locator('.player[data-ready="yes"]').wait_for()
    readout = page.locator(".player .readout")
    readout.get_by_text("rotation of the output").wait_for()
    assert readout.locator("strong").inner_text().endswith("°")


@pytest.mark.parametrize("width", [1440, 320])
def test_a_result_that_turns_has_its_axis_and_curves(page: Any, server: Server, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 900})
    design = bundled_part("machine:twist-column")
    assert design is not None
    data = {
        "problem": problem_to_dict(design.problem), "mask": design.mask_hex, "title": "column",
        "provenance": dict(design.provenance),
    }  # fmt: skip
    kept = page.request.post(f"{server.address}/api/gallery", data=data).json()
    page.goto(f"{server.address}/#/design/{kept['source']}/{kept['key']}")
    row = page.locator(".figures.part tr", has_text="rotation of the output")
    row.get_by_text("about (0, 0, −1), clockwise seen from above").wait_for()
    charts = page.locator(".stroke-charts").get_by_role("img")
    turn, force = (chart.get_attribute("aria-label") for chart in charts.all())
    assert re.fullmatch(r"rotation of the output over .*, 57\.\d ° at 3\.00 mm", turn or "")
    assert re.fullmatch(r"input force over .* N at 3\.00 mm", force or "")
    box = charts.first.bounding_box()
    assert box is not None
    assert 220 <= box["width"] <= width
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert findings(page) == []
    page.locator(".stroke-charts summary").click()
    until(page, lambda: not charts.first.is_visible())


def test_a_design_in_space_is_drawn_by_hand(page: Any) -> None:
    begin(page, "straight-orthogonal")
    tool(page, "By hand")
    until(page, lambda: "276 struts" in page.locator(".readout").inner_text())
    page.locator(".space canvas").focus()
    page.keyboard.press("ArrowUp")
    page.keyboard.press("ArrowUp")
    page.keyboard.press("Space")
    until(page, lambda: "275 struts" in page.locator(".readout").inner_text())
    assert findings(page) == []


@pytest.mark.parametrize("width", [1440, 320])
def test_a_part_in_space_is_played_and_turned(page: Any, server: Server, width: int) -> None:
    page.emulate_media(reduced_motion="reduce")
    page.set_viewport_size({"width": width, "height": 900})
    page.goto(f"{server.address}/#/design/builtin/human-orthogonal")
    page.locator('.player[data-ready="yes"]').wait_for()
    canvas = page.locator(".space canvas")
    canvas.wait_for()
    page.wait_for_timeout(1500)
    first = canvas.screenshot()
    page.get_by_role("button", name="Top").click()
    page.wait_for_timeout(800)
    top = canvas.screenshot()
    canvas.focus()
    page.keyboard.press("ArrowDown")
    page.wait_for_timeout(800)
    assert len({first, top, canvas.screenshot()}) == 3
    assert page.locator(".levels, .figures").get_by_text("2D solid").count() == 0
    assert page.locator('[data-file="svg"]').count() == 0
    assert page.locator('[data-file="stl"]').count() == 1
    assert findings(page) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_a_flat_part_is_shown_extruded_and_three_dimensions_are_loaded_then(
    page: Any, server: Server
) -> None:
    sizes: dict[str, int] = {}
    page.on(
        "response",
        lambda answer: (
            sizes.update({answer.url: int(answer.headers.get("content-length") or 0)})
            if answer.url.endswith((".js", ".css", ".svg", "/"))
            else None
        ),
    )
    page.goto(f"{server.address}/#/design/builtin/machine-crane")
    page.reload()
    page.locator('.player[data-ready="yes"]').wait_for()
    assert sum(sizes.values()) < 1000 * KILOBYTES_FLAT
    assert not any(url.endswith("space.js") for url in sizes)
    page.locator(".transport label", has_text="3D").click()
    page.locator(".space canvas").wait_for()
    page.wait_for_timeout(1000)
    assert any(url.endswith("space.js") for url in sizes)
    assert sum(sizes.values()) < 1000 * KILOBYTES_IN_ALL
    page.locator(".colour label", has_text="Stress").click()  # which is drawn flat
    page.locator(".player svg.drawing").wait_for()
    assert page.locator(".space canvas").count() == 0
