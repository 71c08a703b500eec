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


def summary(page: Any, step: str) -> str:
    """Return the summary of a section of the panel."""
    return str(page.locator(f".step.{step} .summary").inner_text())


def task(page: Any) -> Any:
    """Return the stored task."""
    return page.evaluate("JSON.parse(localStorage.getItem('bellcrank-task'))")


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
