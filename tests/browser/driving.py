"""Actions of a user of the page."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

PATIENCE = 120.0
"""Seconds."""


def tool(page: Any, name: str) -> None:
    """Select a tool above the drawing."""
    page.locator(".tools label", has_text=name).click()


def place(page: Any, x: float, y: float) -> tuple[float, float]:
    """Return the position of a point of the lattice on the screen."""
    found = page.evaluate(
        """([x, y]) => {
          const svg = document.querySelector("svg.canvas");
          const p = new DOMPoint(x, -y).matrixTransform(svg.getScreenCTM());
          return [p.x, p.y];
        }""",
        [x, y],
    )
    return found[0], found[1]


def click(page: Any, x: float, y: float) -> None:
    """Click a point of the lattice."""
    page.mouse.click(*place(page, x, y))


def drag(page: Any, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Drag from one point of the lattice to another."""
    page.mouse.move(*place(page, *start))
    page.mouse.down()
    page.mouse.move(*place(page, *end), steps=8)
    page.mouse.up()


def node(page: Any, x: float, y: float) -> tuple[float, float]:
    """Return the position of the node nearest to a point of the lattice."""
    return _nearest(page, ".dot.node", x, y)


def strut(page: Any, x: float, y: float) -> tuple[float, float]:
    """Return the middle of the strut nearest to a point of the lattice."""
    return _nearest(page, ".beam.rule-auto", x, y)


def _nearest(page: Any, marks: str, x: float, y: float) -> tuple[float, float]:
    """Return the point nearest to another one: nodes, or middles of struts, of a drawn path."""
    found = page.evaluate(
        """([marks, x, y]) => {
          const d = document.querySelector(`svg.canvas ${marks}`).getAttribute("d");
          const numbers = (end) => end.split(/[ h]/).map(Number);
          const lines = d.split("M").filter(Boolean).map((line) => line.split("L").map(numbers));
          const mean = (ends, axis) => ends.reduce((sum, end) => sum + end[axis], 0) / ends.length;
          const points = lines.map((ends) => [mean(ends, 0), mean(ends, 1)]);
          const far = ([px, py]) => (px - x) ** 2 + (py + y) ** 2;
          return points.reduce((a, b) => (far(b) < far(a) ? b : a));
        }""",
        [marks, x, y],
    )
    return found[0], -found[1]


def section(page: Any, name: str) -> None:
    """Open a section of the panel, which may still be drawn for a task that is loaded."""
    head = page.locator(f".step.{name} h2 button")

    def is_open() -> bool:
        if head.get_attribute("aria-expanded") == "false":
            head.click()
        page.wait_for_timeout(300)
        return bool(head.get_attribute("aria-expanded") == "true")

    until(page, is_open)


def field(page: Any, label: str) -> str:
    """Return the text of a field."""
    return str(page.get_by_label(label, exact=True).input_value())


def fill(page: Any, label: str, text: str) -> None:
    """Type a text into a field and leave it."""
    page.get_by_label(label, exact=True).fill(text)
    page.keyboard.press("Tab")


def summary(page: Any, step: str) -> str:
    """Return the summary of a section of the panel."""
    return str(page.locator(f".step.{step} .summary").inner_text())


def task(page: Any) -> Any:
    """Return the stored task."""
    return page.evaluate("JSON.parse(sessionStorage.getItem('bellcrank-task'))")


def start_search(page: Any, effort: str = "Quick") -> str:
    """Start a search and return the name of its run."""
    page.locator(".search .choice label", has_text=effort).click()
    page.get_by_role("button", name="Design it").click()
    page.wait_for_url("**/#/run/*")
    return str(page.url.rsplit("/", 1)[1])


def until(page: Any, condition: str | Callable[[], bool]) -> None:
    """Wait for a condition, an expression of the page or a function.

    The content policy of the page forbids the browser's own way of doing so.
    """
    end = time.monotonic() + PATIENCE
    while not (condition() if callable(condition) else page.evaluate(condition)):
        assert time.monotonic() < end, condition
        time.sleep(0.05)
