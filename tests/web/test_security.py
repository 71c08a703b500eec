"""Who may ask, how much, and that nothing a client says reaches the file system."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from bellcrank.errors import InvalidSettings
from bellcrank.web.app import PAGES, STATIC, make_app
from bellcrank.web.limits import BODY
from bellcrank.web.security import is_loopback
from bellcrank.web.serving import ServerSettings, address_of

if TYPE_CHECKING:
    from collections.abc import Iterator

TOKEN = "a-token-of-some-length"


@pytest.fixture
def guarded(tmp_path: Path) -> TestClient:
    """Ask a server that wants a token; nothing is computed, so nothing is started."""
    app = make_app(tmp_path, token=TOKEN)
    return TestClient(app, base_url="http://192.0.2.7:8642", follow_redirects=False)


@pytest.mark.parametrize("host", ["evil.example", "192.0.2.7:8642", "localhost.evil.example", ""])
def test_without_a_token_only_this_machine_is_answered(client: TestClient, host: str) -> None:
    assert client.get("/api/about", headers={"host": host}).status_code == 403


@pytest.mark.parametrize("path", ["/api/about", "/", "/api/runs"])
def test_other_pages_are_refused(client: TestClient, path: str) -> None:
    for headers in (
        {"origin": "http://evil.example"},
        {"origin": "http://localhost:9999"},
        {"origin": "null"},
    ):
        assert client.get(path, headers=headers).status_code == 403
    assert client.get(path, headers={"origin": "http://localhost:8642"}).status_code == 200


def test_a_link_elsewhere_may_lead_to_the_page_and_to_nothing_else(client: TestClient) -> None:
    headers = {"sec-fetch-site": "cross-site"}
    assert client.get("/", headers=headers).status_code == 200
    assert client.get("/api/runs", headers=headers).status_code == 403


def test_websockets_from_other_pages_are_refused(client: TestClient) -> None:
    address = "ws://localhost:8642/api/edit"
    with (
        pytest.raises(WebSocketDisconnect) as caught,
        client.websocket_connect(address, headers={"origin": "http://evil.example"}),
    ):
        pass
    assert "other pages" in caught.value.reason
    with client.websocket_connect(address, headers={"origin": "http://localhost:8642"}):
        pass


def test_a_form_elsewhere_cannot_send_what_we_read(client: TestClient) -> None:
    body = json.dumps({"task": {"name": "a", "domain": {"size": [62, 54]}, "cases": []}})
    answer = client.post("/api/tasks/build", content=body, headers={"content-type": "text/plain"})
    assert answer.status_code == 415


def test_large_requests_are_refused_announced_or_not(client: TestClient) -> None:
    answer = client.post("/api/tasks/read", json={"text": "x" * BODY, "suffix": ".toml"})
    assert answer.status_code == 413

    def pieces() -> Iterator[bytes]:
        for _ in range(60):
            yield b" " * 50_000

    headers = {"content-type": "application/json"}
    assert client.post("/api/tasks/read", content=pieces(), headers=headers).status_code == 413


def test_a_token_is_demanded_in_cookie_header_or_address(guarded: TestClient) -> None:
    assert guarded.get("/api/about").status_code == 401
    assert guarded.get("/").status_code == 401
    assert guarded.get("/?token=wrong-one").status_code == 401
    with pytest.raises(WebSocketDisconnect), guarded.websocket_connect("/api/edit"):
        pass
    bearer = {"authorization": f"Bearer {TOKEN}"}
    assert guarded.get("/api/about", headers=bearer).status_code == 200
    answer = guarded.get(f"/?token={TOKEN}")
    assert answer.status_code == 303
    assert answer.headers["location"] == "/"
    assert "HttpOnly; SameSite=Strict" in answer.headers["set-cookie"]
    assert guarded.get("/api/about").status_code == 200


def test_a_token_is_made_up_for_every_address_but_that_of_this_machine(tmp_path: Path) -> None:
    assert ServerSettings(folder=tmp_path).needed_token is None
    assert len(ServerSettings(folder=tmp_path, host="0.0.0.0").needed_token or "") >= 20
    assert not is_loopback("0.0.0.0")
    assert address_of("0.0.0.0") not in {"0.0.0.0", ""}
    with pytest.raises(InvalidSettings, match="token"):
        ServerSettings(folder=tmp_path, token="short")


@pytest.mark.parametrize("name", ["%2e%2e%2f%2e%2e", "server.lock", "aaaaaaaaaaaa", "A" * 12])
def test_names_that_are_no_runs_or_designs_are_not_looked_for(
    client: TestClient, name: str
) -> None:
    for path in (f"/api/runs/{name}", f"/api/gallery/kept/{name}", f"/api/gallery/runs/{name}"):
        assert client.get(path).status_code in {404, 422}
    assert client.get(f"/api/runs/{name}/history.parquet").status_code in {404, 422}
    assert client.get(f"/{name}").status_code == 404


@pytest.mark.parametrize("where", ["/api/tasks/from-problem", "/api/motion"])
def test_a_task_cannot_name_a_file_of_this_machine(client: TestClient, where: str) -> None:
    problem = {
        "schema": "bellcrank/problem/1", "name": "spy",
        "lattice": {"kind": "imported", "path": "/etc/passwd"},
        "supports": {"fixed": [0]}, "input": {}, "output": {},
    }  # fmt: skip
    more: dict[str, Any] = {"/api/motion": {"mask": "ff"}}
    answer = client.post(where, json={"problem": problem, **more.get(where, {})})
    assert answer.status_code == 422
    text = 'schema = "bellcrank/problem/1"\nlattice = { kind = "imported", path = "/etc/passwd" }'
    answer = client.post("/api/tasks/read", json={"text": text, "suffix": ".toml"})
    assert "root:" not in answer.text


def test_answers_forbid_everything_from_elsewhere(client: TestClient) -> None:
    policy = client.get("/").headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert client.get("/docs").status_code == 404


def test_the_page_is_light_complete_and_names_no_other_machine() -> None:
    total = 0
    for name, _ in PAGES.values():
        content = (STATIC / name).read_bytes()
        total += len(content)
        found = set(re.findall(rb"https?://[^\s\"'`)]+", content))
        assert found <= {b"http://www.w3.org/2000/svg", b"http://www.w3.org/1999/xhtml"}, (
            f"{name}: {found}"
        )
    assert 40_000 < total < 1_000_000


def test_the_page_that_ships_was_built_from_the_sources_beside_it() -> None:
    sources = Path(__file__).parents[2] / "web" / "src"
    if not sources.is_dir():
        pytest.skip("no sources of the page here")
    for name in ("index.html", "icon.svg"):
        assert (STATIC / name).read_bytes() == (sources / name).read_bytes()
    built = (STATIC / "app.js").read_text(encoding="utf-8")
    texts = (sources / "editor.ts").read_text(encoding="utf-8")
    for sentence in re.findall(r'"([A-Z][^"`$]{30,}\.)"', texts):
        assert sentence in built, "run `npm run build` in web/"
