"""`bellcrank design` with goals and strokes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from bellcrank.mechanics import Core, SpringEvaluator, near_pairs
from bellcrank.model import read_design
from bellcrank.search.constraints import mass_of
from bellcrank.search.symmetry import beam_images

from .helpers import PROBLEM, call, colours, refusal

QUICK = ("--steps", "500", "--chains", "2", "--seed", "5")


@pytest.fixture(scope="module")
def light(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a job with two goals and two strokes."""
    folder = tmp_path_factory.mktemp("goals") / "run"
    outcome = call(
        "design", PROBLEM, *QUICK, "--goal", "mass <= 0.6", "--goal", "no-contact 0.2",
        "--strokes", "0.5,1", "--out", folder,
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    assert "goals satisfied" in outcome.out
    assert "mass <= 0.6, no-contact 0.2" in outcome.out
    return folder


def test_the_design_keeps_its_goals(light: Path) -> None:
    design = read_design(light / "design.json")
    evaluator = SpringEvaluator(design.problem)
    moved = design.problem.lattice.positions + evaluator.evaluate(design.mask).displacement
    assert mass_of(design.problem, Core(evaluator).of(design.mask)) <= 0.6
    near, _ = near_pairs(moved, design.problem.lattice.beams[design.mask], 0.2)
    assert len(near) == 0
    assert design.provenance["settings"]["goals"] == ["mass <= 0.6", "no-contact 0.2"]


def test_the_efficiency_is_the_mean_over_the_strokes(light: Path) -> None:
    design = read_design(light / "design.json")
    summary = json.loads((light / "summary.json").read_text())
    assert design.efficiency == summary["efficiency"]
    assert summary["verified"]
    full = SpringEvaluator(design.problem).evaluate(design.mask).efficiency
    assert abs(full - summary["efficiency"]) > 1e-5
    assert "| goals satisfied | mass <= 0.6, no-contact 0.2 |" in (light / "summary.md").read_text()


def test_a_finished_run_with_goals_can_be_drawn_again(light: Path, tmp_path: Path) -> None:
    outcome = call("plot", light, "--paths", "--out", tmp_path / "again.png")
    assert outcome.code == 0, outcome.err
    assert colours(tmp_path / "again.png") > 5


def test_a_mirror_symmetric_design_stays_so_when_it_is_cleaned(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    outcome = call("design", PROBLEM, *QUICK, "--goal", "mirror x", "--out", folder)
    assert outcome.code == 0, outcome.err
    design = read_design(folder / "design.json")
    present = design.mask[design.problem.designable]
    assert (present == present[beam_images(design.problem, "x")]).all()
    assert 0 < present.sum() < len(present)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--goal", "mass < 1"), "goal 'mass < 1': expected 'mass <= NUMBER'"),
        (("--goal", "weight <= 1"), "unknown goal 'weight'; known: stiffness, input-stiffness"),
        (("--goal", ""), "goal '': expected a text like 'mass <= 0.6'"),
        (("--goal", "mirror y"), "goal 'mirror y': problem 'scaling-8' is not symmetric in y"),
        (("--goal", "degree >= 9"), "goal 'degree >= 9': no node of problem 'scaling-8' has more"),
        (("--strokes", "1,a"), "--strokes 1,a: expected numbers separated by commas"),
        (("--strokes", "0"), "strokes: expected fractions of the full input above 0, got 0.0"),
        (("--strokes", "2"), "strokes: expected a fraction from 0 to 1, got 2.0"),
        (("--strokes", "1,1"), "strokes: expected different fractions of the full input"),
    ],
)
@pytest.mark.usefixtures("here")
def test_bad_goals_are_refused_before_anything_is_written(
    words: tuple[str, ...], message: str
) -> None:
    assert refusal("design", PROBLEM, *words).startswith(f"error: {message}")


@pytest.mark.usefixtures("here")
def test_goals_that_no_design_keeps_are_named_at_the_end() -> None:
    outcome = call("design", PROBLEM, *QUICK, "--goal", "stiffness >= 500", "--out", "run")
    assert outcome.code == 3
    assert "error: problem 'scaling-8'" in outcome.err
    assert "goals (stiffness >= 500)" in outcome.err
    assert json.loads(Path("run/run.json").read_text())["status"] == "stopped"
