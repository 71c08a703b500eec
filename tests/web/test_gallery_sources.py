"""Bundled designs of the gallery: elementary actuators, struts, and machines."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank.machines.bundled import bundled_machine, machines_in
from bellcrank.machines.bundled.contact import bundled_contact
from bellcrank.machines.library import library
from bellcrank.model import unpack_mask
from bellcrank.web.gallery import BundledDesigns
from bellcrank.web.machine_gallery import Actuators, Machines, Struts

if TYPE_CHECKING:
    from starlette.testclient import TestClient


@pytest.fixture(scope="module")
def collections(client: TestClient) -> dict[str, list[dict[str, Any]]]:
    """Return the entries of each source of the gallery."""
    return {each["source"]: each["entries"] for each in client.get("/api/gallery").json()}


def test_every_actuator_of_the_library_is_listed(collections: dict[str, Any]) -> None:
    known = {summary.name: summary for summary in library().summaries}
    assert {entry["key"] for entry in collections["library"]} == set(known)
    for entry in collections["library"]:
        summary = known[entry["key"]]
        assert entry["facets"]["Moves"] == summary.direction
        assert entry["facets"]["Size"] == (f"{summary.columns} wide" if summary.columns else "")
        assert entry["title"].lower().startswith(summary.direction)
        assert entry["picture"]["lines"]
        assert entry["efficiency"] is not None


def test_machines_have_a_description_and_their_contact(collections: dict[str, Any]) -> None:
    assert [entry["key"] for entry in collections["machines"]] == [*machines_in(2), *machines_in(3)]
    notes = {entry["key"]: entry["note"] for entry in collections["machines"]}
    assert all(len(note) > 20 for note in notes.values())
    assert all(bundled_contact(name).message in note for name, note in notes.items())


@pytest.mark.parametrize("name", machines_in(2))
def test_the_plan_of_a_machine_builds_that_machine(client: TestClient, name: str) -> None:
    plan = client.get(f"/api/machines/{name}").json()
    built = client.post("/api/machines", json={"plan": plan}).json()
    exact = bundled_machine(name).design
    problem = built["problem"]
    assert np.array_equal(problem["beams"], exact.problem.lattice.beams)
    assert np.allclose(problem["positions"], exact.problem.lattice.positions)
    assert np.array_equal(unpack_mask(built["mask"], len(problem["beams"])), exact.mask)
    found = client.get(f"/api/gallery/machines/{name}").json()
    assert found["mask"] == built["mask"]


def test_an_actuator_of_the_gallery_is_that_of_the_library(
    client: TestClient, collections: dict[str, Any]
) -> None:
    key = collections["library"][0]["key"]
    found = client.get(f"/api/gallery/library/{key}").json()
    assert found["mask"] == library().find(key).design.mask_hex


@pytest.mark.parametrize(
    "address",
    [
        "gallery/library/none", "gallery/machines/none", "gallery/struts/strut-99999999",
        "gallery/struts/strut-2", "gallery/struts/..%2Fstrut-4", "machines/none",
        "machines/..%2Fgripper", "machines/gripper.toml",
    ],
)  # fmt: skip
def test_unknown_names_are_not_found(client: TestClient, address: str) -> None:
    assert client.get(f"/api/{address}").status_code == 404


def test_struts_have_the_length_of_their_name() -> None:
    for entry in Struts().entries():
        problem = entry.design.problem
        ends = [
            problem.lattice.positions[nodes].mean(axis=0)
            for nodes in (problem.input.nodes, problem.output.nodes)
        ]
        length = np.linalg.norm(ends[0] - ends[1])
        assert length == pytest.approx(int(entry.key.removeprefix("strut-")))


def _count(source: Any) -> int:
    return len(list(source.entries()))


def test_simultaneous_requests_list_all_entries_of_a_source() -> None:
    for source in (BundledDesigns(), Actuators(), Machines()):
        with ThreadPoolExecutor(8) as pool:
            results = [pool.submit(_count, source) for _ in range(16)]
        assert {each.result() for each in results} == {_count(source)}
