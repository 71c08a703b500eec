"""`bellcrank refine`, and the refinement at the end of `bellcrank design`."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.model import find_problem, read_design, write_design
from bellcrank.workflows import find_design
from tests.refinements import shorten

from .helpers import call, refusal

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.usefixtures("here")


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Path, str]]:
    """The same search with a short refinement and without one."""
    found = {}
    with pytest.MonkeyPatch.context() as patch:
        shorten(patch, 20, 40)
        for option in ("--refine", "--no-refine"):
            folder = tmp_path_factory.mktemp("refine") / "inverter"
            words = ("inverter", "--steps", 1000, "--seed", 1, option, "--out", folder)
            outcome = call("design", *words)
            assert outcome.code == 0, outcome.err
            found[option] = (folder, outcome.out)
    return found


def test_the_design_of_a_task_is_refined_by_default(runs: dict[str, tuple[Path, str]]) -> None:
    folder, out = runs["--refine"]
    plain, _ = runs["--no-refine"]
    summaries = [json.loads((each / "summary.json").read_text()) for each in (folder, plain)]
    assert summaries[1]["refinement"] is None
    found = summaries[0]["refinement"]
    assert found["met_after"]
    # Items in the sheet count before the objective.
    assert found["met_in_sheet"] or found["objective_after"] >= found["objective_before"]
    assert "refined" in out
    designs = [read_design(each / "design.json") for each in (folder, plain)]
    # Designs of two chains are refined, so that the beams may be those of the other one.
    refined, searched = (each.problem for each in designs)
    assert np.array_equal(refined.lattice.beams, searched.lattice.beams)
    moved = refined.lattice.positions - searched.lattice.positions
    assert 0.01 < np.abs(moved).max() <= 2 * 0.9 + 1e-9  # two refinements
    assert not moved[searched.special_nodes].any()
    assert designs[0].provenance["refinement"] == found


def test_a_refined_design_is_evaluated_and_exported_as_it_is(
    runs: dict[str, tuple[Path, str]], here: Path
) -> None:
    folder, _ = runs["--refine"]
    summary = json.loads((folder / "summary.json").read_text())
    outcome = call("evaluate", folder / "design.json", "--elements", 8, "--json")
    assert json.loads(outcome.out)["results"][0]["efficiency"] == pytest.approx(
        summary["efficiency"], rel=1e-6
    )
    assert call("export", folder / "design.json", "part.stl").code == 0
    assert (here / "part.stl").exists()


def test_a_design_in_a_file_is_refined(here: Path, runs: dict[str, tuple[Path, str]]) -> None:
    plain, _ = runs["--no-refine"]
    outcome = call("refine", plain / "design.json", "better.json", "--evaluations", 60)
    assert outcome.code == 0, outcome.err
    assert "before" in outcome.out
    assert "after" in outcome.out
    before, after = read_design(plain / "design.json"), read_design(here / "better.json")
    assert after.provenance["refinement"]["met_after"]
    assert after.efficiency is not None
    assert before.efficiency is not None
    assert after.efficiency > before.efficiency
    message = refusal("refine", plain / "design.json", "better.json", folder=here)
    assert "better.json exists" in message


@pytest.mark.slow
def test_a_refinement_over_tolerances_increases_the_worst_gain(here: Path) -> None:
    """Also of a design without a specification, whose file then names the tolerances."""
    outcome = call("refine", "machine:crane", "wide.json", "--tolerance", "--evaluations", 60)
    assert outcome.code == 0, outcome.err
    before, after = (
        json.loads(call("tolerance", name, "--prints", 60, "--no-struts", "--json").out)
        for name in ("machine:crane", "wide.json")
    )
    assert after["yield"] >= before["yield"]
    gains = [found["items"][-1]["percentile_5"] for found in (before, after)]
    assert gains[1] > 1.1 * gains[0]
    wanted = read_design(here / "wide.json").problem.specification
    assert wanted is not None
    assert wanted.tolerances is not None


def test_the_gain_of_a_free_design_grows(here: Path) -> None:
    outcome = call(
        "refine", "machine:discs", "discs.json", "--evaluations", 80, "--picture", "both.png"
    )
    assert outcome.code == 0, outcome.err
    assert (here / "both.png").stat().st_size > 10_000
    assert "off-axis motion" in outcome.out  # a gain alone would flatter
    start = find_design("machine:discs")
    after = read_design(here / "discs.json")
    assert after.efficiency is not None
    assert after.efficiency > 20.0  # 8.9 before
    assert not np.array_equal(after.problem.lattice.positions, start.problem.lattice.positions)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("crane",), "expected a frame; designs of springs are not refined"),
        (("crane", "--tolerance"), "expected a frame; designs of springs are not refined"),
        (("machine:crane", "--evaluations", "0"), "--evaluations: expected at least 1, got 0"),
        (("machine:crane", "--largest-move", "2.5"), "--largest-move: expected above 0"),
        (("machine:crane", "--picture", "both.pic"), "both.pic"),
        (("machine:crane", "--widest", "0.5"), "--widest: expected a number from 1 to 4, got 0.5"),
    ],
)
def test_what_cannot_be_refined_is_refused(
    here: Path, words: tuple[str, ...], message: str
) -> None:
    assert message in refusal("refine", *words, folder=here)


def test_a_file_of_a_design_without_beams_is_refused(here: Path) -> None:
    crane = find_problem("crane")
    write_design(crane.full_design(), here / "springs.json")
    assert "expected a frame" in refusal("refine", "springs.json", folder=here)
