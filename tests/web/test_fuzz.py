"""Whatever is sent to what the server describes of itself, it never breaks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hypothesis import HealthCheck, settings

schemathesis = pytest.importorskip("schemathesis")

from bellcrank.web.app import make_app  # noqa: E402

if TYPE_CHECKING:
    from pathlib import Path

    from starlette.testclient import TestClient


@pytest.fixture
def described(client: TestClient) -> object:
    """Return what the server says of itself."""
    return schemathesis.openapi.from_asgi("/api/openapi.json", client.app, headers=HEADERS)


HEADERS = {"host": "localhost:8642"}
schema = schemathesis.pytest.from_fixture("described")


@schema.parametrize()
@settings(
    max_examples=12, deadline=None, derandomize=True, database=None,
    suppress_health_check=list(HealthCheck),
)  # fmt: skip
def test_no_request_breaks_the_server(case: schemathesis.Case) -> None:
    answer = case.call(headers={**HEADERS, **(case.headers or {}), "host": "localhost:8642"})
    assert answer.status_code < 500 or answer.status_code in {503, 507}, answer.text


def test_the_description_names_every_complaint(tmp_path: Path) -> None:
    described = make_app(tmp_path).openapi()
    for path in described["paths"].values():
        for operation in path.values():
            assert "422" in operation["responses"]
