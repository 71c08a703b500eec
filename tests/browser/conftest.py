"""The page in Chromium, with a server of its own."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import pytest

pytest.importorskip("fastapi", reason="needs the extra [web]")
playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright")

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
PATIENCE = 120_000
"""Time limit in milliseconds, for a busy machine."""


@dataclass(slots=True)
class Server:
    """A server that can be stopped and restarted at the same address."""

    folder: Path
    port: int = 0
    process: subprocess.Popen[str] | None = field(default=None)

    @property
    def address(self) -> str:
        """Address of the page."""
        return f"http://127.0.0.1:{self.port}"

    def start(self) -> None:
        """Start the process and wait for its address."""
        command = [
            sys.executable, "-m", "bellcrank", "serve",
            "--port", str(self.port), "--folder", str(self.folder),
        ]  # fmt: skip
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        assert self.process.stderr is not None
        for line in self.process.stderr:
            if found := re.search(r"http://[^:]+:(\d+)", line):
                self.port = int(found[1])
                return
        raise AssertionError("the server did not start")

    def end(self, how: int = signal.SIGTERM) -> None:
        """End the process by a signal."""
        assert self.process is not None
        assert self.process.stderr is not None
        os.kill(self.process.pid, how)
        self.process.wait(60)
        self.process.stderr.close()


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    """The browser, which can reach this machine only.

    Playwright keeps an event loop running in this thread, where other modules run theirs: it ends
    with the module.
    """
    if CHROMIUM is None:
        pytest.skip("Chromium is not installed")
    arguments = [
        "--no-sandbox",
        "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
        "--enable-unsafe-swiftshader",  # WebGL without a graphics processor
    ]
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=CHROMIUM, args=arguments)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """Serve from an empty folder."""
    server = Server(tmp_path_factory.mktemp("page"))
    server.start()
    yield server
    server.end()


@pytest.fixture
def page(chromium: Any, server: Server) -> Iterator[Any]:
    """Open a page that may contact its own server only, and must not report errors."""
    context = chromium.new_context(viewport={"width": 1440, "height": 900}, accept_downloads=True)
    context.set_default_timeout(PATIENCE)
    page = context.new_page()
    requested: list[str] = []
    errors: list[str] = []
    page.on("request", lambda request: requested.append(request.url))
    page.on("websocket", lambda socket: requested.append(socket.url))
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda line: errors.append(line.text) if line.type == "error" else None)
    page.goto(server.address)
    page.locator("svg.canvas").wait_for()
    ready(page)
    yield page
    context.close()
    places = {urlsplit(url).hostname for url in requested if not url.startswith(("blob:", "data:"))}
    assert places == {"127.0.0.1"}
    # While a server is restarted, the browser itself reports failed connections.
    page_errors = [
        text
        for text in errors
        if "ERR_" not in text and "WebSocket" not in text and "status of" not in text
    ]
    assert not page_errors


def ready(page: Any) -> None:
    """Wait until the kernels are loaded."""
    end = time.monotonic() + PATIENCE / 1000
    while not page.evaluate("fetch('/api/about').then(a => a.json()).then(a => a.ready)"):
        assert time.monotonic() < end
        time.sleep(0.2)
