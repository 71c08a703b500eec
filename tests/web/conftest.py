"""A server in this process, with real processes behind it."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import pytest

pytest.importorskip("fastapi", reason="needs the extra [web]")

from starlette.testclient import TestClient

from bellcrank.web.app import make_app

if TYPE_CHECKING:
    from collections.abc import Iterator

PAGE = "http://localhost:8642"


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """Ask a server with a folder of its own, as its own page would."""
    app = make_app(tmp_path_factory.mktemp("web"), searches=2)
    with TestClient(app, base_url=PAGE) as found:
        wait_for(lambda: found.get("/api/about").json()["ready"])
        yield found


@pytest.fixture(scope="module")
def crane(client: TestClient) -> dict[str, Any]:
    """Return the human-designed crane as the gallery gives it."""
    found: dict[str, Any] = client.get("/api/gallery/builtin/human-crane").json()
    return found


def wait_for(done: Any, seconds: float = 180.0) -> Any:
    """Ask until the answer is yes; generous, since machines that test are busy."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        answer = done()
        if answer:
            return answer
        time.sleep(0.1)
    raise AssertionError("waited in vain")
