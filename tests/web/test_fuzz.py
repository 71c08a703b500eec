"""Whatever is sent to what the server describes of itself, it never breaks."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import HealthCheck, settings

schemathesis = pytest.importorskip("schemathesis")
pytest.importorskip("fastapi", reason="needs the extra [web]")

from bellcrank.web.app import make_app  # noqa: E402

if TYPE_CHECKING:
    from starlette.testclient import TestClient

pytestmark = pytest.mark.slow


def described() -> dict[str, Any]:
    """Return what a server says of itself."""
    with TemporaryDirectory() as folder:
        return make_app(Path(folder)).openapi()


schema = schemathesis.openapi.from_dict(described())


@schema.parametrize()
@settings(
    max_examples=10, deadline=None, derandomize=True, database=None,
    suppress_health_check=list(HealthCheck),
)  # fmt: skip
def test_no_request_breaks_the_server(case: schemathesis.Case, client: TestClient) -> None:
    request = case.as_transport_kwargs(base_url="http://localhost:8642")
    given = {key: request[key] for key in ("headers", "params", "json", "data") if request.get(key)}
    if isinstance(given.get("data"), bytes | str):
        given["content"] = given.pop("data")
    answer = client.request(request["method"], request["url"], **given)
    assert answer.status_code < 500 or answer.status_code in {503, 507}, answer.text
    if answer.status_code >= 400:
        assert set(answer.json()) == {"message", "key"}


def test_the_description_names_every_complaint() -> None:
    for path in described()["paths"].values():
        for operation in path.values():
            assert "422" in operation["responses"]
