"""What `bellcrank design` leaves behind."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
import pytest
from matplotlib.image import imread

from bellcrank.model import find_problem, read_design
from bellcrank.search import pieces

from .helpers import PROBLEM, RESULTS, ROWS, call, colours, design_of, files, table

if TYPE_CHECKING:
    from pathlib import Path

    from .helpers import Outcome


def test_a_job_says_on_standard_output_what_it_found(first_run: tuple[Path, Outcome]) -> None:
    folder, outcome = first_run
    rows = [line.split(maxsplit=1) for line in outcome.out.splitlines()]
    assert [row[0] for row in rows] == [
        "efficiency", "before", "initial", "beams", "verified", "designs", "results",
    ]  # fmt: skip
    assert "spring model" in rows[0][1]
    assert float(rows[0][1].split()[-1]) == pytest.approx(design_of(folder)["efficiency"], abs=5e-5)
    assert rows[5][1].split()[-1] == str(ROWS)
    assert rows[6][1].strip() == f"{folder}/"


def test_a_job_leaves_its_results_and_nothing_else(whole: Path) -> None:
    assert sorted(files(whole)) == RESULTS


def test_the_history_has_a_row_for_each_step_of_each_chain(whole: Path) -> None:
    columns = table(whole)
    assert columns["chain"] == [0] * (ROWS // 2) + [1] * (ROWS // 2)
    assert columns["step"] == [*range(ROWS // 2)] * 2
    assert len(set(columns["mask"])) > 100


def test_the_design_is_in_one_piece_and_converged(whole: Path) -> None:
    design = read_design(whole / "design.json")
    assert pieces(design.problem, design.mask) == 1
    assert design.beam_count > 10
    assert design.provenance["status"] == "converged"
    assert json.loads((whole / "summary.json").read_text())["status"] == "converged"


def test_the_design_only_differs_where_it_may(whole: Path) -> None:
    design = read_design(whole / "design.json")
    changed = np.flatnonzero(design.mask != design.problem.initial)
    assert len(changed) > 10
    removed_elsewhere = set(changed.tolist()) - set(design.problem.designable.tolist())
    # Cleaning may take what no load reaches anywhere, but nothing is ever added.
    assert not design.mask[sorted(removed_elsewhere)].any()


@pytest.mark.parametrize("what", ["run", "design.json"])
def test_the_design_has_the_efficiency_it_says(whole: Path, what: str) -> None:
    outcome = call("evaluate", whole if what == "run" else whole / what, "--json")
    (result,) = outcome.data["results"]
    said = design_of(whole)
    assert result["status"] == "converged"
    assert result["mask"] == said["mask"]
    assert result["efficiency"] == pytest.approx(said["efficiency"], abs=1e-9)


def test_the_design_is_better_than_the_full_lattice(whole: Path) -> None:
    outcome = call("evaluate", PROBLEM, "--json")
    (full,) = outcome.data["results"]
    assert design_of(whole)["efficiency"] > full["efficiency"] + 0.5


def test_the_summary_agrees_with_design_and_history(whole: Path) -> None:
    data = json.loads((whole / "summary.json").read_text())
    design = design_of(whole)
    assert data["problem"] == PROBLEM
    assert data["mask"] == design["mask"]
    assert data["efficiency"] == design["efficiency"]
    assert data["proposals"] == ROWS
    assert data["verified"] is True
    columns = table(whole)
    taken = [
        (chain, float.fromhex(efficiency))
        for chain, efficiency, accepted in zip(
            columns["chain"], columns["efficiency"], columns["accepted"], strict=True
        )
        if accepted
    ]
    best = [max(efficiency for number, efficiency in taken if number == k) for k in (0, 1)]
    assert data["best_by_chain"] == best
    found = data["found"]["chain"] * (ROWS // 2) + data["found"]["step"]
    assert columns["accepted"][found]


def test_the_summary_for_people_shows_figures_and_pictures(whole: Path) -> None:
    text = (whole / "summary.md").read_text()
    design = design_of(whole)
    assert text.startswith(f"# {PROBLEM}\n")
    assert f"spring model | {design['efficiency']:.6f} |" in text
    assert f"| designs evaluated | {ROWS} |" in text
    for picture in ("motion.png", "efficiency.png"):
        assert f"]({picture})" in text
        assert (whole / picture).exists()


@pytest.mark.parametrize("name", ["efficiency.png", "motion.png"])
def test_the_pictures_show_something(whole: Path, name: str) -> None:
    assert_shows_something(whole / name)


def assert_shows_something(path: Path) -> None:
    picture = imread(path)
    assert min(picture.shape[:2]) > 300
    assert colours(path) > 20


def test_a_problem_with_a_human_design_is_compared_with_it(here: Path) -> None:
    outcome = call("design", "crane", "--steps", "250", "--chains", "1")
    assert outcome.code == 0, outcome.err
    assert sorted(files(here / "crane")) == sorted([*RESULTS, "comparison.png"])
    assert_shows_something(here / "crane" / "comparison.png")
    data = json.loads((here / "crane" / "summary.json").read_text())
    assert data["human_efficiency"] == pytest.approx(1.0104575, abs=1e-6)


def test_a_problem_of_ones_own_is_designed_into_a_folder_of_its_name(here: Path, lift: str) -> None:
    outcome = call("design", lift, "--steps", "300", "--chains", "1")
    assert outcome.code == 0, outcome.err
    assert sorted(files(here / "lift")) == RESULTS
    assert len(table(here / "lift")["step"]) == 300


def test_a_job_can_begin_with_a_design(here: Path) -> None:
    outcome = call("design", "--from", "human:crane", "--steps", "250", "--chains", "1")
    assert outcome.code == 0, outcome.err
    data = json.loads((here / "crane" / "summary.json").read_text())
    assert data["initial_efficiency"] == pytest.approx(1.0104575, abs=1e-6)
    assert data["efficiency"] >= data["initial_efficiency"]
    assert table(here / "crane")["mask"][0] != find_problem("crane").full_design().mask_hex
