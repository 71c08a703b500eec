"""The library as it comes along, and how entries are found in it."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidFile, InvalidSettings, UnknownName
from bellcrank.machines import mean_ports, two_port_at
from bellcrank.machines.elementary import DIRECTIONS
from bellcrank.machines.library import (
    Library,
    bundled_folder,
    kinds,
    library,
    user_folder,
    write_entry,
)
from bellcrank.machines.library.catalogue import SORTS, entry_files
from bellcrank.machines.library.tasks import OFF_AXIS, ROTATION, SAG
from bellcrank.mechanics import VERIFICATION_INCREMENT, Conditions, Status, model_evaluator
from bellcrank.model import Section
from bellcrank.part import PartSpec, frame_section
from bellcrank.workflows.library_measurement import MIN_INPUT_STIFFNESS

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.machines.library import Entry

SHIPPED = Library((bundled_folder(),))
NAMES = SHIPPED.names()


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, own_entry: Entry) -> Path:
    """A folder of the user with one entry."""
    monkeypatch.setenv("BELLCRANK_LIBRARY", str(tmp_path))
    write_entry(own_entry, tmp_path)
    return tmp_path


def test_there_are_entries_for_all_directions_sizes_and_payloads() -> None:
    there = {(each.direction, each.columns, each.kind) for each in SHIPPED.summaries}
    assert len(there) == len(NAMES)
    complete = ("straight-10g", "straight-50g", "straight-100g")
    assert there >= set(product(DIRECTIONS, (7, 9, 12), complete))
    assert {kind for _, _, kind in there} == set(kinds)


def test_entries_of_straight_motions_meet_their_items_by_frames_and_in_the_sheet() -> None:
    for summary in SHIPPED.summaries:
        entry = SHIPPED.find(summary.name)
        wanted = [item["name"] for item in entry.provenance["items"]]
        assert len(wanted) == 7
        for model in ("frames, 8 elements", "sheet"):
            assert all(item["reached"][model]["met"] for item in entry.provenance["items"])
        figures = entry.figures
        assert summary.gain == figures["efficiency"] > 1.0
        assert summary.blocked_force_N == figures["blocked_force_N"]
        assert figures["off_axis"] <= OFF_AXIS
        assert abs(figures["rotation_deg"]) <= ROTATION
        assert figures["sag_mm"] <= SAG * figures["travel_mm"]
        assert figures["payload_N"] >= kinds[entry.kind].payload
        assert figures["blocked_force_N"] > 0.0
        assert not entry.warnings, "no contact along the stroke"


def test_what_comes_along_is_small() -> None:
    sizes = [path.stat().st_size for path in entry_files(bundled_folder())]
    assert max(sizes) < 50_000
    assert sum(sizes) < 4_000_000


@pytest.mark.parametrize(
    "name",
    [
        name if number % 6 == 0 else pytest.param(name, marks=pytest.mark.slow)
        for number, name in enumerate(NAMES)
    ],
)
def test_an_entry_that_comes_along_is_sound(name: str) -> None:
    entry = SHIPPED.find(name)
    problem, mask = entry.design.problem, entry.design.mask
    expected = Section(0.2, 0.5, joint=frame_section(PartSpec(), 2).joint)
    assert problem.section == expected, "struts of 2 mm on 10 mm, 5 mm thick"
    assert entry.characterisation.model == "frames"
    response = model_evaluator(problem).evaluate(mask, VERIFICATION_INCREMENT)
    assert response.status is Status.CONVERGED, "stable"
    assert entry.efficiency == pytest.approx(response.efficiency, abs=1e-8)
    stiffness = 2.0 * response.energy / problem.input.amount**2
    assert stiffness > MIN_INPUT_STIFFNESS

    element = mean_ports(entry.design)
    rest = element.rest()
    assert rest.asymmetry < 1e-10, "reciprocity, before the stiffness is made symmetric"
    assert np.linalg.eigvalsh(rest.stiffness)[0] >= -1e-10 * np.abs(rest.stiffness).max()
    moved = Conditions(np.array([True, False]), np.zeros(2), np.zeros(2))
    answer = element.linear(rest, moved).transfer()
    assert answer[0, 1] == pytest.approx(-answer[1, 0], rel=1e-8)
    fresh = two_port_at(element, rest)
    stiffness = entry.characterisation.rest.stiffness
    assert np.allclose(stiffness, fresh.stiffness, rtol=1e-6, atol=1e-12)
    assert np.linalg.eigvalsh(stiffness)[0] >= -1e-8 * np.abs(stiffness).max()

    assert np.isfinite(entry.validation.linear_efficiency)
    assert entry.provenance["settings"]["steps"] > 0


def test_an_entry_is_known_by_name_beginning_and_hash() -> None:
    name = next(name for name in NAMES if name.startswith("down-9-straight-50g"))
    for text in (name, name[:-3], "down-9-straight-50g", name[-8:], name[-8:-3]):
        assert SHIPPED.resolve(text) == name, text
    assert SHIPPED.find("down-9-straight-50g").name == name


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("down", r"is the beginning of \d+ library entries: down-"),
        ("down-9-strait", "no library entry 'down-9-strait'; similar: down-9-straight-"),
        ("zzz", "no library entry 'zzz'; see"),
        ("", "no library entry ''"),
    ],
)
def test_what_is_not_known_is_said_with_what_is_near(text: str, told: str) -> None:
    with pytest.raises(UnknownName, match=told):
        SHIPPED.resolve(text)


def test_a_search_keeps_what_fits_and_sorts_the_best_first() -> None:
    found = SHIPPED.search(direction="up", kind="straight-50g")
    assert {(each.direction, each.kind) for each in found} == {("up", "straight-50g")}
    values = [each.two_port.efficiency_against(0.0) for each in found]
    assert values == sorted(values, reverse=True)
    assert {each.columns for each in SHIPPED.search(columns=7)} == {7}
    assert len(SHIPPED.search(no_warnings=True)) == len(NAMES)
    soft = SHIPPED.search(stiffness=4.0)
    assert 0 < len(soft) < len(NAMES)
    assert all(each.input_stiffness <= 4.0 for each in soft)
    assert all(1.0 / each.output_compliance >= 0.1 for each in SHIPPED.search(output_stiffness=0.1))


def test_a_search_under_load_prefers_what_pushes() -> None:
    free, loaded = SHIPPED.search(), SHIPPED.search(spring=0.14)
    assert free[0].kind == "straight-10g"
    assert loaded[0].kind != "straight-10g"
    least = SHIPPED.search(spring=0.14, efficiency=1.0)
    assert all(each.two_port.efficiency_against(0.14) >= 1.0 for each in least)
    assert 0 < len(least) < len(loaded)


@pytest.mark.parametrize("sort", SORTS)
def test_every_order_keeps_all_entries(sort: str) -> None:
    assert {each.name for each in SHIPPED.search(sort=sort)} == set(NAMES)


def test_a_search_for_what_there_cannot_be_is_refused() -> None:
    with pytest.raises(InvalidSettings, match="direction: expected one of"):
        SHIPPED.search(direction="sideways")
    with pytest.raises(UnknownName, match="unknown kind of actuator 'strong'"):
        SHIPPED.search(kind="strong")
    with pytest.raises(InvalidSettings, match="sort: expected one of efficiency"):
        SHIPPED.search(sort="beauty")
    with pytest.raises(InvalidSettings, match="spring: expected a stiffness"):
        SHIPPED.search(spring=-1.0)


def test_the_users_entries_stand_beside_those_that_come_along(own: Path) -> None:
    assert user_folder() == own
    known = library()
    assert len(known) == len(NAMES) + 1
    assert known.find("left-own").kind == "own"
    assert [each.name for each in known.search(kind="own")] == [known.resolve("left-own")]


def test_a_damaged_file_is_told_of_and_hides_no_other(own: Path) -> None:
    (path,) = entry_files(own)
    path.write_text(path.read_text()[:-30])
    known = library()
    assert len(known) == len(NAMES)
    (line,) = known.damaged
    assert str(path) in line
    with pytest.raises(InvalidFile, match="not valid JSON"):
        known.find(path.stem)


def test_a_folder_that_is_not_there_is_an_empty_library(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BELLCRANK_LIBRARY", str(tmp_path / "nowhere"))
    assert len(library()) == len(NAMES)
    monkeypatch.delenv("BELLCRANK_LIBRARY")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert user_folder() == tmp_path / "bellcrank" / "library"
