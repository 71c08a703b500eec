"""Use of the page with a keyboard, a small screen or a screen reader."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe")

from .driving import section, start_search, summary, task, tool, until  # noqa: E402

if TYPE_CHECKING:
    from .conftest import Server

pytestmark = pytest.mark.slow
WIDTHS = (1440, 390, 320)


def findings(page: Any) -> list[str]:
    """Return the serious findings of axe."""
    found = axe.Axe().run(page).response["violations"]
    return [
        f"{each['id']}: {each['nodes'][0]['html'][:120]}"
        for each in found
        if each["impact"] in {"serious", "critical"}
    ]


def check_widths(page: Any) -> None:
    """Check the page in windows of all widths: no serious findings, no sideways scroll."""
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": 900})
        assert findings(page) == [], width
        assert page.evaluate("document.documentElement.scrollWidth") <= width, width


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", WIDTHS)
def test_axe_finds_nothing_serious(page: Any, server: Server, scheme: str, width: int) -> None:
    page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
    page.set_viewport_size({"width": width, "height": 900})
    section(page, "domain")
    section(page, "limits")
    page.get_by_label("Design over tolerances of print and drive").check()
    page.locator('[data-key="tolerance-width"]').wait_for()
    assert findings(page) == []
    for name in ("Inputs", "Outputs", "Loads", "Zones", "By hand"):
        tool(page, name)
        page.wait_for_timeout(300)
        assert findings(page) == []
    page.goto(f"{server.address}/#/machine")
    page.get_by_text("No parts", exact=True).wait_for()
    for place, seen in (
        ("gallery", ".tile"),
        ("machine", ".collections .tile"),
        ("machine/gripper", ".readout strong"),
        ("runs", "h1"),
        ("design/builtin/human-crane", '.player[data-ready="yes"]'),
        ("run/000000000000", "[role=alert]"),
    ):
        page.goto(f"{server.address}/#/{place}")
        page.locator(seen).first.wait_for()
        page.wait_for_timeout(500)
        assert findings(page) == [], place
        assert page.evaluate("document.documentElement.scrollWidth") <= width, place


def test_axe_finds_nothing_serious_in_a_search_and_its_result(page: Any) -> None:
    page.emulate_media(reduced_motion="reduce")
    start_search(page, "Thorough")
    page.get_by_text("steps/s").wait_for()
    page.locator(".readout strong").wait_for()
    check_widths(page)
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Choose the best").click()
    page.locator('.player[data-ready="yes"]').wait_for()
    page.locator(".colour label", has_text="Stress").click()
    page.locator(".figures td", has_text="MPa").first.wait_for()
    page.locator(".figures.part").wait_for()
    check_widths(page)


def test_a_task_can_be_defined_with_the_keyboard_alone(page: Any) -> None:
    until(page, lambda: summary(page, "supports") == "9 nodes")
    page.locator("svg.canvas").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Space")
    until(page, lambda: summary(page, "supports") == "8 nodes")
    spoken = page.locator(".visually-hidden[role=status]").inner_text()
    assert "node at" in spoken
    assert "mm: support" in spoken
    page.keyboard.press("Shift+Enter")
    until(page, lambda: summary(page, "supports") == "9 nodes")
    page.locator(".tools input").first.focus()
    page.keyboard.press("ArrowRight")
    assert page.locator(".page.draw").get_attribute("data-tool") == "inputs"
    page.get_by_label("Direction", exact=True).fill("90")
    page.keyboard.press("Tab")
    until(page, lambda: task(page)["table"]["cases"][0]["inputs"][0]["direction"] == "up")
    until(page, lambda: page.get_by_role("button", name="Design it").is_enabled())
    page.get_by_role("button", name="Design it").focus()
    page.keyboard.press("Enter")
    page.wait_for_url("**/#/run/*")
