"""What the page shows while it waits, and sizes of its controls on phones."""

from __future__ import annotations

import json
from typing import Any

import pytest

from .driving import until

pytestmark = pytest.mark.slow

LEAST = 40
"""Least height of a control on a phone, pixels."""


def run(name: str, **changes: Any) -> dict[str, Any]:
    """Return a search as the server lists it."""
    settings = {"steps": 8000, "chains": 2, "seed": 0, "goals": []}
    return {
        "id": name, "title": "my part", "created": 1.0, "status": "queued", "message": "",
        "efficiency": None, "method": "basin-hopping", "settings": settings, "part": None,
        "reference": None, "refine": False, "done": 0, "total": 16000, "has_design": False,
        "place": 1, **changes,
    }  # fmt: skip


def test_searches_that_wait_are_distinguished_from_new_ones_and_from_each_other(
    page: Any,
) -> None:
    runs = [run("aaaa00000000", done=4000), run("bbbb00000000", place=2)]
    page.route("**/api/runs", lambda route: route.fulfill(body=json.dumps(runs)))
    page.get_by_role("link", name="Searches").click()
    rows = page.locator(".list .line")
    until(page, lambda: rows.count() == 2)
    first, second = rows.all_inner_texts()
    assert "waiting for its turn, 25 % done" in first
    assert "waiting" not in second
    assert "queued" in second
    assert first.splitlines()[-1] != second.splitlines()[-1]


def test_a_list_without_a_server_says_so(page: Any) -> None:
    page.route("**/api/runs", lambda route: route.abort())
    page.get_by_role("link", name="Searches").click()
    page.locator(".list", has_text="cannot be reached").wait_for()


def test_a_result_says_that_it_is_being_computed(page: Any) -> None:
    page.route("**/api/report", lambda _route: None)  # never answered
    page.goto(f"{page.url.split('#')[0]}#/design/builtin/machine-crane")
    page.get_by_text("computing the part").wait_for()
    page.locator('.player[data-ready="yes"]').wait_for()  # the motion does not wait for it


@pytest.mark.parametrize("address", ["#/draw", "#/design/builtin/machine-crane", "#/runs"])
def test_controls_of_a_phone_are_large_enough_for_a_finger(page: Any, address: str) -> None:
    page.set_viewport_size({"width": 360, "height": 740})
    page.goto(f"{page.url.split('#')[0]}{address}")
    page.locator("h1").wait_for()
    page.wait_for_timeout(1500)
    small = page.evaluate(
        """(least) => [...document.querySelectorAll("button, select, input:not([type=file]), summary, .choice label")]
          .filter((each) => each.offsetParent && !each.closest(".choice input") && each.type !== "radio" && each.type !== "checkbox" && each.type !== "range")
          .filter((each) => each.getBoundingClientRect().height < least - 0.5)
          .map((each) => `${each.tagName} ${each.textContent.slice(0, 30)} ${each.getBoundingClientRect().height}`)""",  # noqa: E501
        LEAST,
    )
    assert small == []
