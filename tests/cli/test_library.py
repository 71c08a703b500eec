"""`bellcrank library`: entries to look through, to use anywhere, and to add to."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING

import pytest

from bellcrank.machines import elementary
from bellcrank.machines.library import Library, bundled_folder, find_entry, read_entry
from bellcrank.model import read_design, write_design
from tests.refinements import make_without_sheet

from .helpers import call, refusal

if TYPE_CHECKING:
    from pathlib import Path

COUNT = len(Library((bundled_folder(),)).names())


@pytest.fixture(autouse=True)
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Keep tests away from the folder of whoever runs them."""
    folder = tmp_path / "own"
    monkeypatch.setenv("BELLCRANK_LIBRARY", str(folder))
    return folder


@pytest.fixture
def lever(tmp_path: Path) -> Path:
    """A design file of somebody's own."""
    path = tmp_path / "lever.json"
    write_design(elementary(7, "left").full_design(), path)
    return path


def test_all_entries_are_listed() -> None:
    outcome = call("library", "list", width=80)
    assert outcome.code == 0, outcome.err
    assert f"{COUNT} entries" in outcome.out
    assert find_entry("down-9-straight-50g").name in outcome.out
    assert max(map(len, outcome.out.splitlines())) <= 80
    listed = call("library", "list", "--json").data
    assert len(listed) == COUNT
    assert {"name", "efficiency", "gain", "input_stiffness"} <= set(listed[0])


def test_a_search_gives_the_best_first() -> None:
    told = call("library", "search", "--direction", "up", "--kind", "straight-50g", "--json").data
    assert len(told) == 3
    assert {(each["direction"], each["kind"]) for each in told} == {("up", "straight-50g")}
    gains = [each["gain"] for each in told]
    assert gains == sorted(gains, reverse=True)
    outcome = call("library", "search", "--columns", 9, "--spring", 0.14, "--sort", "work")
    assert "spring" in outcome.out
    assert call("library", "search", "--efficiency", 1e6, "--json").data == []


def test_an_entry_is_shown_with_its_two_port_figures_and_origin(tmp_path: Path) -> None:
    entry = find_entry("down-9-straight-50g")
    outcome = call("library", "show", "down-9-straight-50g", "--out", tmp_path / "picture.png")
    assert outcome.code == 0, outcome.err
    for words in (
        entry.name,
        "off-axis motion",
        "payload that halves the travel",
        "blocked force",
        "frame analysis",
        "input stiffness",
        "stroke, free",
        "seed",
    ):
        assert words in outcome.out
    assert (tmp_path / "picture.png").stat().st_size > 1000
    record = call("library", "show", entry.name, "--json").data
    assert record["schema"] == "bellcrank/entry/2"
    assert record["name"] == entry.name


def test_an_entry_goes_wherever_a_design_does(tmp_path: Path) -> None:
    entry = find_entry("down-9-straight-50g")
    told = call("evaluate", "down-9-straight-50g", "--json").data["results"][0]
    assert told["mask"] == entry.design.mask_hex
    # `evaluate` leaves out the shortening of bent beams.
    assert told["efficiency"] == pytest.approx(entry.efficiency, rel=0.02)
    found = call("characterise", entry.name[:-2], "--points", 2, "--json").data
    assert found["rest"]["efficiency"] == pytest.approx(
        entry.characterisation.rest.efficiency, rel=1e-6
    )
    checked = call("validate", entry.name.rpartition("-")[2], "--json").data
    assert checked["efficiency"] == pytest.approx(entry.validation.efficiency, rel=1e-6)
    assert call("export", entry.name, tmp_path / "part.svg").code == 0
    plan = tmp_path / "pair.toml"
    plan.write_text(
        'name = "pair"\n[parts.first]\nentry = "down-9-straight-50g"\n[parts.second]\n'
        'entry = "down-9-straight-10g"\njoin = "first.output"\nrotate = 300\n[input]\n'
        'ports = ["first.input"]\n[output]\nports = ["second.output"]\n'
    )
    outcome = call("machine", "build", plan)
    assert outcome.code == 0, outcome.err
    assert read_design(tmp_path / "pair.json").beam_count > entry.design.beam_count


def test_a_file_or_problem_goes_before_an_entry(
    lever: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    name = find_entry("down-9-straight-50g").name
    lever.rename(tmp_path / f"{name}.json")
    told = call("evaluate", f"{name}.json", "--json").data["results"][0]
    assert told["mask"] == elementary(7, "left").full_design().mask_hex
    assert call("evaluate", "crane", "--json").code == 0


def test_a_design_is_added_to_ones_own_folder(lever: Path, own: Path) -> None:
    outcome = call("library", "add", lever, "--points", 2)
    assert outcome.code == 0, outcome.err
    (path,) = own.iterdir()
    assert re.fullmatch(r"left-own-[0-9a-f]{8}\.json", path.name)
    assert f"added {path.stem}" in outcome.err
    assert "added design" in outcome.out
    assert len(call("library", "list", "--json").data) == COUNT + 1
    assert call("evaluate", "left-own", "--json").code == 0
    assert "exists already" in refusal("library", "add", lever, "--points", 1, folder=own)
    assert len(read_entry(path).characterisation.curves[0].motion) == 3
    assert call("library", "add", lever, "--points", 1, "--overwrite").code == 0
    assert len(read_entry(path).characterisation.curves[0].motion) == 2


@pytest.mark.slow
def test_entries_are_made_where_one_wants_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_without_sheet(monkeypatch)
    words = (
        "library", "make", "--directions", "up", "--columns", "5", "--kinds", "straight-10g",
        "--steps", 300, "--chains", 2, "--out", tmp_path / "made",
    )  # fmt: skip
    outcome = call(*words)
    assert outcome.code == 0, outcome.err
    assert "1 of 1  up-5-straight-10g: up-5-straight-10g-" in outcome.err
    assert len(list((tmp_path / "made").glob("up-5-straight-10g-*.json"))) == 1
    assert "exists" in call(*words).err
    assert "none better than up-5-straight-10g-" in call(*words, "--again").err
    outcome = call("library", "index", "--entries", tmp_path / "made", "--out", tmp_path / "pages")
    assert outcome.code == 0, outcome.err
    (name,) = (path.stem for path in (tmp_path / "made").glob("up-*.json"))
    readable = (tmp_path / "pages" / "README.md").read_text()
    assert f"{name}.svg" in readable
    assert (tmp_path / "pages" / f"{name}.svg").read_text().startswith("<svg")
    assert "exists" in refusal("library", "index", "--out", tmp_path / "pages")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("show", "down-9-strait"), "no library entry 'down-9-strait'; similar: down-9-straight-"),
        (("show", "down"), "is the beginning of"),
        (("search", "--direction", "sideways"), "direction: expected one of right"),
        (("search", "--kind", "strong"), "unknown kind of actuator 'strong'"),
        (("search", "--sort", "beauty"), "sort: expected one of"),
        (("make", "--directions", "sideways", "--out", "x"), "direction: expected one of right"),
        (("make", "--columns", "nine", "--out", "x"), "--columns nine: expected integers"),
        (("make", "--columns", "3", "--out", "x"), "columns: expected at least 5"),
        (("make", "--workers", "0", "--out", "x"), "workers: expected at least 1"),
        (
            ("index", "--entries", "nothing", "--out", "x"),
            "nothing: expected a folder",
        ),
        (("add", "nothing.json"), "unknown problem 'nothing.json'"),
        (("add", "crane", "--points", "0"), "--points: expected at least one"),
        (("show", "down-9-straight-50g", "--out", "picture.gif"), "expected a picture name"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(words: tuple[str, ...], told: str, here: Path) -> None:
    assert told in refusal("library", *words, folder=here)


def test_a_name_like_an_entrys_is_told_what_is_near() -> None:
    assert "no library entry 'down-9-strait'; similar: down-9-straight-" in refusal(
        "evaluate", "down-9-strait"
    )
    assert "unknown problem 'crain'" in refusal("evaluate", "crain")


def test_a_damaged_file_is_refused_where_it_is_asked_for_and_listed(lever: Path, own: Path) -> None:
    call("library", "add", lever, "--points", 1)
    (path,) = own.iterdir()
    data = json.loads(path.read_text())
    data["design"]["efficiency"] = 99.0
    path.write_text(json.dumps(data))
    assert "checksum: does not match" in refusal("evaluate", path.stem)
    outcome = call("library", "list")
    assert outcome.code == 0
    assert "skipped:" in outcome.err


def test_a_folder_that_cannot_be_written_is_said(
    lever: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("BELLCRANK_LIBRARY", str(tmp_path / "file" / "folder"))
    assert "cannot be written" in refusal("library", "add", lever, code=1)
    told = refusal("library", "make", "--out", tmp_path / "file" / "folder", code=1)
    assert "cannot be written" in told


def test_entries_are_found_by_figures_of_their_parts() -> None:
    words = ("library", "search", "--direction", "left", "--payload", "40g", "--sort", "travel")
    outcome = call(*words, "--json")
    found = json.loads(outcome.out)
    assert found
    assert all(each["payload_N"] >= 0.04 * 9.80665 for each in found)
    travels = [each["travel_mm"] for each in found]
    assert travels == sorted(travels, reverse=True)
    assert "payload" in call(*words).out
    strong = json.loads(call(*words, "--blocked-force", "1N", "--json").out)
    assert 0 < len(strong) < len(found)
    assert all(each["blocked_force_N"] >= 1.0 for each in strong)
    fewer = json.loads(call(*words, "--rotation", "2.3deg", "--json").out)
    assert len(fewer) < len(found)
    assert call(*words, "--gain", "1000").out.count("0 entries") == 1


def test_a_figure_in_another_unit_is_refused() -> None:
    line = refusal("library", "search", "--off-axis", "5 mm")
    assert "--off-axis: expected a ratio like 10% or 0.1, got '5 mm'" in line
