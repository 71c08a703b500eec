"""Pictures of the page for the documentation: ``python tools/make_screenshots.py``.

Starts a server in a temporary folder, opens the pages in Chromium, and writes
``docs/images/web-*.png``. Needs the extra ``test-all`` and Chromium.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from playwright.sync_api import sync_playwright

if TYPE_CHECKING:
    from playwright.sync_api import Page

IMAGES = Path(__file__).parents[1] / "docs" / "images"
WIDTH = 1280
PATIENCE = 120.0
"""Seconds to wait for the server and the page."""
IS_READY = "fetch('/api/about').then((reply) => reply.json()).then((about) => about.ready)"


def show_motion(page: Page) -> None:
    """Wait for the motion and the frame analysis; show the strain energy."""
    page.locator('.player[data-ready="yes"]').wait_for()
    page.locator(".headline .model", has_text="frame").wait_for()
    page.locator(".colour label", has_text="Strain energy").click()


def show_task(page: Page) -> None:
    """Wait for the drawing of a task."""
    page.locator("svg.canvas").wait_for()


def show_machine(page: Page) -> None:
    """Wait for the drawing of a machine."""
    page.get_by_text("nodes,").first.wait_for()


PICTURES = {
    "draw": ("", 860, show_task),
    "result": ("design/builtin/machine-crane", 1000, show_motion),
    "machine": ("machine/gripper", 980, show_machine),
}
"""Path of the page, height in pixels, and what to wait for."""


def address_of(server: subprocess.Popen[str]) -> str:
    """Return the address that a server prints when it starts."""
    assert server.stderr is not None
    for line in server.stderr:
        if found := re.search(r"http://[^:]+:\d+", line):
            return found[0]
    raise RuntimeError("the server has ended")


def main() -> None:
    """Write all pictures."""
    with TemporaryDirectory() as folder, sync_playwright() as library:
        command = [sys.executable, "-m", "bellcrank", "serve", "--port", "0", "--folder", folder]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server:
            try:
                address = address_of(server)
                browser = library.chromium.launch(
                    executable_path=shutil.which("chromium"), args=["--no-sandbox"]
                )
                for name, (path, height, wait) in PICTURES.items():
                    page = browser.new_page(viewport={"width": WIDTH, "height": height})
                    page.set_default_timeout(1000.0 * PATIENCE)
                    page.emulate_media(reduced_motion="reduce")
                    page.goto(f"{address}/#/{path}")
                    end = time.monotonic() + PATIENCE
                    while not page.evaluate(IS_READY):
                        assert time.monotonic() < end
                        page.wait_for_timeout(200)
                    wait(page)
                    page.wait_for_timeout(3000)
                    page.screenshot(path=IMAGES / f"web-{name}.png")
                    page.close()
            finally:
                server.terminate()


if __name__ == "__main__":
    main()
