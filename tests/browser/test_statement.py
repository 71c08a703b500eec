"""Statement of tasks on the page: turns, symmetry, other sizes, errors, the best design so far."""

from __future__ import annotations

import re
from typing import Any

import pytest

from .driving import click, field, fill, node, section, start_search, summary, task, tool, until

pytestmark = pytest.mark.slow


def test_an_output_that_turns_needs_no_direction(page: Any) -> None:
    tool(page, "Outputs")
    page.get_by_label("Motion of the output").get_by_text("turns").click()
    until(page, lambda: "rotation" in task(page)["table"]["cases"][0]["outputs"][0])
    (output,) = task(page)["table"]["cases"][0]["outputs"]
    assert output["rotation"] == [{"maximise": True}]
    assert not {"direction", "gain", "off_axis"} & set(output)
    page.get_by_text("counter-clockwise is positive").wait_for()
    page.locator('.specification [data-item="maximise:case.output.rotation"]').wait_for()
    assert page.get_by_role("button", name="Design it").is_enabled()
    page.get_by_label("Bound of the rotation").select_option("at_most")
    until(
        page,
        lambda: task(page)["table"]["cases"][0]["outputs"][0]["rotation"][0]["at_most"] == "5 deg",
    )


def test_the_list_of_what_is_asked_has_inputs_loads_and_limits_that_hold(page: Any) -> None:
    page.get_by_label("or start from").select_option("selector")
    asked = page.get_by_role("list", name="Inputs and loads")
    until(page, lambda: asked.locator("li").count() == 2)
    first, second = asked.locator("li").all_inner_texts()
    assert first.startswith("A: Input 3 mm right on 3 nodes between (")
    assert second.startswith("B: Input 3 mm left ")
    section(page, "limits")
    page.get_by_text("empty: 65 %, that of NinjaFlex").wait_for()
    section(page, "domain")
    page.get_by_label("Material").select_option("tpu-95a")
    page.get_by_text("empty: not limited, no limit of TPU 95A is known").wait_for()


def test_a_task_is_opened_by_its_picture(page: Any) -> None:
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.reload()
    page.locator("svg.canvas").wait_for()
    pictures = page.get_by_text("Pictures of the tasks")
    pictures.wait_for()
    assert not [url for url in asked if url.endswith("/pictures")]  # before they are opened
    pictures.click()
    tile = page.get_by_role("button", name="twist A hub in the middle")
    tile.locator(".task-arrow.input").wait_for()
    tile.click()
    until(page, lambda: task(page)["table"]["name"] == "twist")
    assert not tile.is_visible()


def test_supports_and_outputs_of_a_symmetric_design_get_their_images(page: Any) -> None:
    page.get_by_role("button", name="Empty rectangle").click()
    until(page, lambda: summary(page, "supports") == "none")
    section(page, "limits")
    page.get_by_label("Symmetry of the design").select_option("x")
    tool(page, "Supports")
    click(page, *node(page, 0.1, 0.1))
    until(page, lambda: summary(page, "supports") == "2 nodes")
    points = [each["point"] for each in task(page)["table"]["supports"][0]["at"]]
    assert points[0][0] + points[1][0] == pytest.approx(82.0, abs=0.1)
    assert points[0][1] == points[1][1]
    tool(page, "Outputs")
    click(page, *node(page, 0.1, 7.1))
    until(page, lambda: summary(page, "outputs") == "1 node")
    page.get_by_label("right", exact=True).click()
    page.get_by_role("button", name="Add its mirror image").click()
    until(page, lambda: len(task(page)["table"]["cases"][0]["outputs"]) == 2)
    first, second = task(page)["table"]["cases"][0]["outputs"]
    assert (first["direction"], second["direction"]) == ("right", "left")
    assert first["at"][0]["point"][0] + second["at"][0]["point"][0] == pytest.approx(82, abs=0.1)
    page.get_by_role("button", name="Add its mirror image").wait_for(state="detached")
    # Further nodes of one are those of the other, too.
    click(page, *node(page, 1.1, 7.1))
    until(page, lambda: summary(page, "outputs") == "4 nodes")
    counts = [len(each["at"]) for each in task(page)["table"]["cases"][0]["outputs"]]
    assert counts == [2, 2]
    page.keyboard.press("Control+z")
    until(page, lambda: summary(page, "outputs") == "2 nodes")
    # Items of one are those of the other.
    page.locator('input[data-key="outputs-0-off_axis-0"]').fill("7%")
    page.keyboard.press("Tab")
    until(
        page,
        lambda: [
            each["off_axis"] for each in task(page)["table"]["cases"][0]["outputs"]
        ] == [[{"at_most": "7%"}]] * 2,
    )  # fmt: skip


def test_ports_edges_and_zones_follow_the_sides_of_a_part_of_another_size(page: Any) -> None:
    page.get_by_label("Start from").select_option("gripper")
    until(page, lambda: task(page)["table"]["name"] == "gripper")
    before = task(page)["table"]
    section(page, "domain")
    width = before["domain"]["size"][0]
    fill(page, "Width", f"{(width + 20) / 10} cm")  # a length with a unit, too
    until(page, lambda: task(page)["table"]["domain"]["size"][0] == width + 20)
    after = task(page)["table"]

    def places(table: dict[str, Any]) -> list[float]:
        """Return x of all points, and ends of all ranges of horizontal edges."""
        regions = [
            region
            for each in [
                *table["supports"], *table["cases"][0]["inputs"], *table["cases"][0]["outputs"]
            ]
            for region in each["at"]
        ]  # fmt: skip
        found = [region["point"][0] for region in regions if "point" in region]
        found += [x for region in regions for x in region.get("between", ())]
        zones = [zone["box"] for zone in table["domain"].get("keep_out", ()) if "box" in zone]
        return found + [box[k] for box in zones for k in (0, 2)]

    moved = [new - old for old, new in zip(places(before), places(after), strict=True)]
    # What is near a side stays near it, and what is in the middle stays there.
    parts = [old / width - 0.5 for old in places(before)]
    expected = [10.0 if abs(part) < 0.15 else 20.0 if part > 0.0 else 0.0 for part in parts]
    assert moved == pytest.approx(expected)
    assert set(expected) == {0.0, 10.0, 20.0}


def test_nodes_that_lie_differently_after_a_change_of_size_are_named(page: Any) -> None:
    """Two nodes of a row may be nearest to places in two rows of the new lattice."""
    page.get_by_role("button", name="Empty rectangle").click()
    until(page, lambda: summary(page, "supports") == "none")
    tool(page, "Outputs")
    click(page, *node(page, 0.1, 7.1))
    click(page, *node(page, 1.1, 7.1))
    until(page, lambda: summary(page, "outputs") == "2 nodes")
    section(page, "domain")
    fill(page, "Height", "80")
    until(page, lambda: task(page)["table"]["domain"]["size"][1] == 80)
    notice = page.locator(".notice")
    notice.get_by_text("other nodes are selected: output 1").wait_for()


def test_a_button_stays_under_the_pointer_when_the_panel_is_drawn_again(page: Any) -> None:
    tool(page, "Outputs")
    arrow = page.get_by_label("up", exact=True)
    arrow.wait_for()
    page.evaluate("scrollTo({ top: 200, behavior: 'instant' })")
    before = arrow.bounding_box()["y"]
    for direction in ("up", "right", "down"):
        page.get_by_label(direction, exact=True).click()
        until(
            page,
            lambda name=direction: (
                task(page)["table"]["cases"][0]["outputs"][0]["direction"] == name
            ),
        )
        page.wait_for_timeout(300)  # the task is built meanwhile
        arrow.wait_for()
        assert arrow.bounding_box()["y"] == pytest.approx(before, abs=2.0)


def test_errors_name_the_sections_of_the_page(page: Any) -> None:
    tool(page, "Outputs")
    page.locator('[data-key="outputs-0-off_axis-0"]').fill("10")
    page.keyboard.press("Tab")
    fault = page.locator(".step.outputs .fault")
    fault.wait_for()
    text = fault.inner_text()
    assert text.startswith("Output 1, off axis, at most: expected at most 2")
    assert not re.search(r"cases\[|outputs\[", text)
    assert "without errors" in page.locator(".specification").inner_text()
    wrong = page.locator('[data-key="outputs-0-off_axis-0"][aria-invalid="true"]')
    assert wrong.count() == page.locator("[aria-invalid]").count() == 1
    assert page.locator(".start-search .fault").inner_text() == text
    page.keyboard.press("Control+z")
    page.locator("[aria-invalid]").wait_for(state="detached")


def test_what_follows_from_a_gripper_of_another_size_and_material_is_said(page: Any) -> None:
    page.get_by_label("Start from").select_option("gripper")
    until(page, lambda: summary(page, "inputs") == "3 nodes")
    notice = page.locator(".notice")
    assert notice.inner_text() == ""  # another task is no change of a lattice
    tool(page, "Supports")
    assert "selects the mirror image" in page.locator(".hint").inner_text()
    tool(page, "Outputs")
    page.get_by_text("40.0 mm apart, with a gap of 38.0 mm").wait_for()
    unlimited = page.locator(".specification").get_by_text("The strain is not limited")
    assert unlimited.count() == 0
    section(page, "domain")
    page.locator('[data-key="part-material"]').select_option(label="TPU 95A")
    unlimited.wait_for()
    page.locator('[data-key="part-spacing"]').fill("11.5")
    page.keyboard.press("Tab")
    notice.get_by_text("input 1 (1 instead of 3 nodes)").wait_for()


def test_the_welcome_is_hidden_after_a_change_and_the_effort_is_kept(page: Any) -> None:
    assert page.locator(".welcome").is_visible()
    section(page, "domain")
    fill(page, "Strut width", "1.9")
    until(page, lambda: not page.locator(".welcome").is_visible())
    page.locator(".search .choice label", has_text="Quick").click()
    page.get_by_role("link", name="Gallery").click()
    page.get_by_role("link", name="Task").first.click()
    until(page, lambda: page.locator(".search .choice input:checked").count() == 1)
    assert page.locator(".search .choice input:checked").get_attribute("value") == "quick"
    section(page, "domain")
    assert field(page, "Strut width") == "1.9"


def test_the_best_design_so_far_is_opened_and_two_searches_have_two_names(page: Any) -> None:
    page.get_by_label("Start from").select_option("gripper")
    until(page, lambda: task(page)["table"]["name"] == "gripper")
    start_search(page, "Thorough")
    # The live design of a symmetric search is the whole one: both jaws reach the same.
    page.locator(".verdict", has_text="before refinement").wait_for()
    reached = dict(
        re.findall(
            r"(left|right) jaw: off-axis motion\s+at most 20 %\s+([\d.]+) %",
            page.locator(".run .report").inner_text(),
        )
    )
    assert reached["left"] == reached["right"]
    title = "Objective along the search, before refinement: left jaw: gain"
    page.get_by_role("heading", name=title).wait_for()
    with page.context.expect_page() as opened:
        page.get_by_role("button", name="Open the best so far").click()
    other = opened.value
    other.locator('.player[data-ready="yes"]').wait_for()
    assert other.locator("h1").inner_text() == "gripper, best so far"
    other.close()
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Continue").wait_for()
    page.goto(f"{page.url.split('#')[0]}#/draw")
    page.get_by_label("Start from").select_option("gripper")
    until(page, lambda: task(page)["table"]["name"] == "gripper")
    start_search(page, "Quick")
    page.locator("h1", has_text="gripper (2)").wait_for()
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Continue").wait_for()


def test_a_load_without_a_unit_is_in_newtons(page: Any) -> None:
    tool(page, "Outputs")
    page.get_by_label("Ask for").select_option("payload")
    fill(page, "payload", "0.05")
    wanted = [{"at_least": "0.05 N"}]
    until(page, lambda: task(page)["table"]["cases"][0]["outputs"][0].get("payload") == wanted)


def test_a_weight_acts_before_the_input(page: Any) -> None:
    def case() -> dict[str, Any]:
        return task(page)["table"]["cases"][0]

    tool(page, "Loads")
    click(page, *node(page, 20, 70))
    until(page, lambda: len(case().get("loads", [])) == 1)
    page.get_by_text("before the input", exact=True).click()
    until(page, lambda: case()["loads"][0].get("during") == ["0%", "20%"])
    assert case()["inputs"][0]["during"] == ["20%", "100%"]
    until(page, lambda: page.get_by_role("button", name="Design it").is_enabled())
    page.get_by_text("grows with the input", exact=True).click()
    until(page, lambda: "during" not in case()["loads"][0])
    assert "during" not in case()["inputs"][0]
    page.get_by_text("before the input", exact=True).click()
    until(page, lambda: "during" in case()["inputs"][0])
    page.get_by_role("button", name="Remove load 1").click()
    until(page, lambda: not case()["loads"] and "during" not in case()["inputs"][0])


def test_the_own_weight_acts_before_the_input(page: Any) -> None:
    def case() -> dict[str, Any]:
        return task(page)["table"]["cases"][0]

    tool(page, "Loads")
    page.get_by_label("The own weight acts").check()
    until(page, lambda: case().get("gravity_during") == ["0%", "20%"])
    assert case()["inputs"][0]["during"] == ["20%", "100%"]
    until(page, lambda: summary(page, "loads") == "own weight")
    until(page, lambda: page.get_by_role("button", name="Design it").is_enabled())
    page.get_by_text("grows with the input", exact=True).click()
    until(page, lambda: "gravity_during" not in case())
    assert case()["gravity"] == "down"
    assert "during" not in case()["inputs"][0]
    page.get_by_text("before the input", exact=True).click()
    until(page, lambda: "during" in case()["inputs"][0])
    page.get_by_label("The own weight acts").uncheck()
    until(page, lambda: "gravity" not in case() and "during" not in case()["inputs"][0])


def test_a_task_is_scaled_with_all_its_lengths(page: Any) -> None:
    page.get_by_label("or start from").select_option("twist-column")
    until(page, lambda: summary(page, "supports") == "7 nodes")
    section(page, "domain")
    page.get_by_label("Scale the task to").fill("77")
    page.get_by_role("button", name="Scale", exact=True).click()
    until(page, lambda: task(page)["table"]["part"]["spacing"] == 7.7)
    table = task(page)["table"]
    assert table["part"]["width"] == pytest.approx(0.77 * 2.0)
    assert table["domain"]["size"] == pytest.approx([0.77 * 33, 0.77 * 33, 0.77 * 52], abs=0.01)
    until(page, lambda: field(page, "Scale the task to") == "100")
    # The same nodes are selected, and the task can be searched at once.
    until(page, lambda: page.get_by_role("button", name="Design it").is_enabled())
    nodes = ("7 nodes", "6 nodes")
    until(page, lambda: (summary(page, "supports"), summary(page, "outputs")) == nodes)
    page.keyboard.press("Control+z")
    until(page, lambda: "spacing" not in task(page)["table"].get("part", {}))


def test_paths_strokes_and_zones_are_scaled_with_a_task(page: Any) -> None:
    def scale(name: str) -> Any:
        page.get_by_label("or start from").select_option(name)
        until(page, lambda: task(page)["table"]["name"] == name)
        section(page, "domain")
        page.get_by_label("Scale the task to").fill("50")
        page.get_by_role("button", name="Scale", exact=True).click()
        until(page, lambda: task(page)["table"].get("part", {}).get("spacing") == 5)
        until(page, lambda: page.get_by_role("button", name="Design it").is_enabled())
        return task(page)["table"]

    (case,) = scale("arc")["cases"]
    assert case["inputs"][0]["displacement"] == 2.5
    assert case["inputs"][0]["at"][0]["point"] == [43, 44]
    assert case["outputs"][0]["path"]["arc"] == [10, 60]
    assert case["outputs"][0]["payload"] == [{"value": "10 g"}]
    bracket = scale("bracket")
    assert bracket["domain"]["outline"][2] == [65, 25]
    assert bracket["domain"]["holes"] == [{"circle": [15.5, 13], "radius": 4.5}]
    assert bracket["supports"][0]["at"][1] == {"circle": [37.5, 2.5], "radius": 5.5}
    assert bracket["cases"][0]["inputs"][0]["at"][0]["between"] == [10, 25]


def test_an_output_that_moves_again_has_its_items_back(page: Any) -> None:
    tool(page, "Outputs")
    before = task(page)["table"]["cases"][0]["outputs"][0]
    assert "off_axis" in before
    motion = page.get_by_label("Motion of the output")
    motion.get_by_text("turns").click()
    until(page, lambda: "off_axis" not in task(page)["table"]["cases"][0]["outputs"][0])
    motion.get_by_text("moves").click()
    until(page, lambda: task(page)["table"]["cases"][0]["outputs"][0] == before)


def test_tolerances_that_no_design_meets_are_named_and_ratios_are_percentages(page: Any) -> None:
    page.get_by_label("or start from").select_option("twist-column")
    until(page, lambda: task(page)["table"]["name"] == "twist-column")
    section(page, "limits")
    assert field(page, "Strain at most") == "4%"
    warning = page.locator(".specification .bad")
    assert not warning.count()
    page.get_by_label("Design over tolerances of print and drive").check()
    warning.wait_for()
    assert "5° off its direction" in warning.inner_text()
    assert "sideways by 8.7 % of the stroke" in warning.inner_text()
    assert "an off-axis motion of at most 5 %" in warning.inner_text()
    fill(page, "Direction of the input ±", "1")
    until(page, lambda: not warning.count())
    fill(page, "Each strut, width ±", "2.5%")
    until(page, lambda: task(page)["table"]["tolerance"]["each_width"] == "2.5%")


def test_the_button_that_starts_a_search_stays_in_view(page: Any) -> None:
    page.set_viewport_size({"width": 1440, "height": 600})
    button = page.get_by_role("button", name="Design it")
    assert page.evaluate("document.documentElement.scrollHeight") > 1000
    box = button.bounding_box()
    assert box["y"] + box["height"] <= 600.0
    section(page, "limits")
    assert button.bounding_box()["y"] + box["height"] <= 600.0


def test_the_spread_of_a_force_is_a_ratio(page: Any) -> None:
    """A bound of 0.1 became 0.1 N, which is refused."""
    page.get_by_label("or start from").select_option("constant-force")
    until(page, lambda: task(page)["table"]["name"] == "constant-force")
    tool(page, "Outputs")
    bound = page.locator('[data-key="case-force-0"]')
    assert bound.input_value() == "0.1"
    bound.fill("0.2")
    page.keyboard.press("Tab")
    until(page, lambda: task(page)["table"]["cases"][0]["input_force"][0]["at_most"] == 0.2)
    page.locator(".specification", has_text="at most 20 %").wait_for()
