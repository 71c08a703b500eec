"""Every form of `bellcrank plot`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from matplotlib.image import imread

from .helpers import PROBLEM, call, colours, files, refusal, write

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.usefixtures("here")

KINDS = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}


def drawn(here: Path, *words: object) -> Path:
    """Draw, and return the only file that is new in the current folder."""
    before = files(here)
    outcome = call("plot", *words)
    assert outcome.code == 0, outcome.err
    assert outcome.out == ""
    (name,) = set(files(here)) - set(before)
    assert outcome.err == f"wrote {name}\n"
    assert len((here / name).read_bytes()) > 5000
    return here / name


def test_a_problem_is_drawn_under_its_own_name(here: Path) -> None:
    path = drawn(here, PROBLEM)
    assert path.name == f"{PROBLEM}.png"
    assert colours(path) > 20


def test_a_problem_of_ones_own_is_drawn(here: Path, lift: str) -> None:
    path = drawn(here, lift)
    assert path.name == "lift.png"
    assert colours(path) > 20


@pytest.mark.parametrize("kind", KINDS)
def test_the_suffix_chooses_the_format(here: Path, small: str, kind: str) -> None:
    path = drawn(here, small, "--rest", "--out", f"picture.{kind}")
    assert path.read_bytes().startswith(KINDS[kind])


def test_rest_and_motion_are_different_pictures(here: Path, small: str) -> None:
    rest = drawn(here, small, "--rest", "--out", "rest.png")
    moved = drawn(here, small, "--out", "moved.png")
    larger = drawn(here, small, "--magnify", "2", "--out", "larger.png")
    assert len({path.read_bytes() for path in (rest, moved, larger)}) == 3
    assert min(map(colours, (rest, moved, larger))) > 20


@pytest.mark.parametrize("what", ["", "design.json"])
def test_the_design_of_a_run_is_drawn(here: Path, whole: Path, what: str) -> None:
    assert drawn(here, whole / what).name == f"{PROBLEM}.png"


def test_the_same_design_is_the_same_picture_by_folder_and_by_file(here: Path, whole: Path) -> None:
    folder = drawn(here, whole, "--rest", "--out", "folder.png")
    file = drawn(here, whole / "design.json", "--rest", "--out", "file.png")
    full = drawn(here, PROBLEM, "--rest", "--out", "full.png")
    assert folder.read_bytes() == file.read_bytes()
    assert folder.read_bytes() != full.read_bytes()


def test_two_designs_are_drawn_beside_each_other(here: Path, whole: Path) -> None:
    path = drawn(here, PROBLEM, "--compare", whole / "design.json", "--out", "two.png")
    picture = imread(path)
    assert picture.shape[1] > picture.shape[0]
    assert colours(path) > 20


def test_a_human_design_is_drawn(here: Path) -> None:
    human = drawn(here, "human:crane", "--rest")
    assert human.name == "crane.png"
    full = drawn(here, "crane", "--rest", "--out", "full.png")
    assert human.read_bytes() != full.read_bytes()


def test_the_paths_of_a_run_are_drawn_into_its_folder(copy: Path) -> None:
    outcome = call("plot", copy, "--paths")
    assert (outcome.code, outcome.out) == (0, "")
    assert outcome.err == f"wrote {copy}/paths.png\n"
    assert colours(copy / "paths.png") > 20


def test_the_paths_of_a_run_that_is_not_finished_are_drawn_and_leave_it_alone(
    here: Path, half: Path
) -> None:
    before = files(half)
    assert colours(drawn(here, half, "--paths", "--out", "paths.png")) > 20
    assert files(half) == before


def test_a_picture_is_replaced_on_request_only(here: Path, small: str) -> None:
    write(here / "p.png", "precious")
    line = refusal("plot", small, "--out", "p.png")
    assert line.startswith("error: p.png: exists already; ")
    assert call("plot", small, "--out", "p.png", "--overwrite").code == 0
    assert colours(here / "p.png") > 20


@pytest.mark.parametrize("form", [(), ("--rest",), ("--compare", PROBLEM)])
@pytest.mark.parametrize("name", ["p.jpg", "p", "p.png.txt"])
def test_an_unknown_format_is_refused(small: str, form: tuple[str, ...], name: str) -> None:
    line = refusal("plot", small, *form, "--out", name)
    assert line == f"error: {name}: expected a picture name ending in .png, .svg, .pdf"


@pytest.mark.parametrize("factor", ["0", "-1", "nan", "inf"])
def test_a_magnification_that_makes_no_sense_is_refused(small: str, factor: str) -> None:
    line = refusal("plot", small, "--magnify", factor)
    assert line.startswith("error: magnify: expected a number above 0, got ")


def test_an_unknown_objective_is_refused(small: str) -> None:
    line = refusal("plot", small, "--objective", "best")
    assert line.startswith("error: unknown objective 'best'; known: displacement, ")


def test_an_unknown_second_design_is_refused(small: str) -> None:
    line = refusal("plot", small, "--compare", "nowhere")
    assert line.startswith("error: unknown problem 'nowhere'; known: ")


def test_a_problem_without_a_human_design_has_none_to_draw() -> None:
    assert "no human design for 'discs'" in refusal("plot", "human:discs")


def test_paths_are_those_of_a_run_only(here: Path, small: str) -> None:
    assert "error: nowhere: no such folder" in refusal("plot", "nowhere", "--paths")
    assert f"error: {small}: no such folder" in refusal("plot", small, "--paths")
    (here / "empty").mkdir()
    line = refusal("plot", "empty", "--paths")
    assert line.startswith("error: empty: not the folder of a run: it has no run.json")


def test_a_missing_folder_for_the_picture_is_named(small: str) -> None:
    line = refusal("plot", small, "--out", "no/p.png", code=1)
    assert line.startswith("error: no/p.png: cannot be written (No such file or directory)")
