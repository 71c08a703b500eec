"""What `bellcrank design` leaves behind."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from matplotlib.image import imread

from bellcrank.model import Elasticity, Section, find_problem, read_design, write_problem
from bellcrank.part import PartSpec
from bellcrank.search import MetropolisSettings, pieces
from tests.reference3d import read_reference

from .helpers import PART_RESULTS, PROBLEM, RESULTS, ROWS, call, colours, design_of, files, table

if TYPE_CHECKING:
    from pathlib import Path

    from .helpers import Outcome


def test_a_job_says_on_standard_output_what_it_found(first_run: tuple[Path, Outcome]) -> None:
    folder, outcome = first_run
    rows = [line.split(maxsplit=1) for line in outcome.out.splitlines()]
    assert [row[0] for row in rows] == [
        "spring", "efficiency", "off-axis", "rotation", "input", "before", "initial", "beams",
        "verified", "designs", "results",
    ]  # fmt: skip
    assert float(rows[1][1].split()[-1]) == pytest.approx(design_of(folder)["efficiency"], abs=5e-5)
    assert rows[9][1].split()[-1] == str(ROWS)
    assert rows[10][1].strip() == f"{folder}/"


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
    assert "|  | spring model |" in text
    assert f"| efficiency (displacement) | {design['efficiency']:.6f} |" in text
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
    assert sorted(files(here / "crane")) == sorted([*PART_RESULTS, "comparison.png"])
    assert_shows_something(here / "crane" / "comparison.png")
    data = json.loads((here / "crane" / "summary.json").read_text())
    assert data["human_efficiency"] == pytest.approx(1.176043, abs=1e-5)


def test_a_design_that_is_not_stable_in_a_check_is_written_and_says_so(
    here: Path, lift: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    checks = {"increments of 1/32": 1.0, "adaptive increments": math.nan}
    monkeypatch.setattr("bellcrank.workflows.design.verify", lambda *_: checks)
    outcome = call("design", lift, "--steps", "250", "--chains", "1")
    assert "not stable in adaptive increments" in outcome.out
    (folder,) = [path.parent for path in here.glob("*/summary.json")]
    for name in ("summary.json", "design.json"):
        data = json.loads((folder / name).read_text())
        found = data if name == "summary.json" else data["provenance"]
        assert found["checks"] == {"increments of 1/32": 1.0, "adaptive increments": None}
    assert not json.loads((folder / "summary.json").read_text())["verified"]


def test_a_problem_of_ones_own_is_designed_into_a_folder_of_its_name(here: Path, lift: str) -> None:
    outcome = call("design", lift, "--steps", "300", "--chains", "1")
    assert outcome.code == 0, outcome.err
    assert sorted(files(here / "lift")) == PART_RESULTS
    assert len(table(here / "lift")["step"]) == 300


def test_a_job_can_begin_with_a_design(here: Path) -> None:
    outcome = call("design", "--from", "human:crane", "--steps", "250", "--chains", "1")
    assert outcome.code == 0, outcome.err
    data = json.loads((here / "crane" / "summary.json").read_text())
    assert data["initial_efficiency"] == pytest.approx(1.176043, abs=1e-5)
    assert data["efficiency"] >= data["initial_efficiency"]
    assert table(here / "crane")["mask"][0] != find_problem("crane").full_design().mask_hex


# ---- models


@pytest.fixture(scope="module")
def part(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a short job for the default part."""
    folder = tmp_path_factory.mktemp("part") / "run"
    words = ("--steps", "600", "--chains", "2", "--seed", "3", "--workers", "2")
    outcome = call("design", PROBLEM, *words, "--out", folder)
    assert outcome.code == 0, outcome.err
    (folder.parent / "out.txt").write_text(outcome.out)
    return folder


def test_a_part_is_designed_as_a_frame_by_default(part: Path) -> None:
    design = read_design(part / "design.json")
    assert design.problem.section == Section(0.2, 0.5, joint=0.06)
    spec = PartSpec.from_dict(design.provenance["part"])
    assert spec == PartSpec(width=2.0, thickness=5.0, scale=10.0, material="ninjaflex")
    (row,) = call("evaluate", part, "--elements", "8", "--json").data["results"]
    assert (row["model"], row["elements"]) == ("frames", 8)
    assert row["efficiency"] == pytest.approx(design.efficiency, abs=1e-9)


def test_a_part_must_not_touch_itself_unless_goals_are_given(part: Path, here: Path) -> None:
    summary = json.loads((part / "summary.json").read_text())
    assert summary["settings"]["goals"] == ["no-contact 0.2"]
    outcome = call(
        "design",
        PROBLEM,
        "--steps",
        "100",
        "--chains",
        "1",
        "--goal",
        "connected",
        "--out",
        "other",
    )
    assert outcome.code in (0, 3), outcome.err
    summary = json.loads((here / "other" / "summary.json").read_text())
    assert summary["settings"]["goals"] == ["connected"]


def test_the_record_of_a_part_has_the_figures_of_both_numbers_of_elements(part: Path) -> None:
    data = json.loads((part / "summary.json").read_text())
    one, eight = data["figures"]
    assert (data["model"], one["elements"], eight["elements"]) == ("frames", 1, 8)
    assert (one["bowing"], eight["bowing"]) == (True, False)
    assert one["efficiency"] == pytest.approx(data["search_efficiency"], abs=1e-9)
    assert eight["efficiency"] == pytest.approx(data["efficiency"], abs=1e-9)
    (row,) = call("evaluate", part, "--elements", "8", "--json").data["results"]
    (searched,) = call("evaluate", part, "--json").data["results"]
    assert (searched["elements"], searched["bowing"]) == (1, True)
    for key in ("efficiency", "off_axis", "output_rotation_deg", "input_force", "energy"):
        assert row[key] == pytest.approx(eight[key], rel=1e-9)
        assert searched[key] == pytest.approx(one[key], rel=1e-9)
    verified = data["verification"]
    assert verified["fault"] is None
    assert verified["status"] == "converged"
    assert verified["efficiency"] == pytest.approx(eight["efficiency"], abs=1e-9)
    relative = (eight["efficiency"] - one["efficiency"]) / one["efficiency"]
    assert verified["difference"] == pytest.approx(relative, rel=1e-6)
    # The same part by the frame analysis of `validate`.
    assert data["as_part"]["efficiency"] == pytest.approx(eight["efficiency"], abs=1e-8)
    assert data["as_part"]["principal_strain"] == pytest.approx(verified["principal_strain"])


def test_a_part_is_reported_with_the_model_of_every_figure(part: Path) -> None:
    data = json.loads((part / "summary.json").read_text())
    printed = (part.parent / "out.txt").read_text()
    text = (part / "summary.md").read_text()
    one, eight = data["figures"]
    difference = f"({data['verification']['difference']:+.1%})"
    rows = [
        ("", "frames, as searched", "frames, 8 elements"),
        ("off-axis motion at full stroke", f"{one['off_axis']:.1%}", f"{eight['off_axis']:.1%}"),
        (
            "rotation at full stroke",
            *(f"{each['output_rotation_deg']:.1f} deg" for each in (one, eight)),
        ),
    ]
    lines = printed.splitlines()
    for name, *values in rows:
        assert any(
            re.fullmatch(rf"{name}\s+{values[0]}\s+{values[1]}\s*", line) for line in lines
        ), name
        assert f"| {name} | {' | '.join(values)} |" in text
    for figure, number in ((printed, ".4f"), (text, ".6f")):
        assert f"{data['search_efficiency']:{number}}" in figure
        assert f"{data['efficiency']:{number}} {difference}" in figure
    force = float(printed.split("input force, largest along the stroke")[1].split()[0])
    recorded = json.loads((part / "validation.json").read_text())["results"][0]
    assert force == pytest.approx(data["part_figures"][0]["largest_input_force_N"], rel=5e-3)
    assert force >= recorded["input_push_N"] * (1.0 - 1e-2)


def test_struts_of_another_size_are_designed_on_request(here: Path) -> None:
    words = ("--strut-width", "1.6mm", "--thickness", "4mm", "--scale", "8mm", "--material", "pla")
    call("design", PROBLEM, "--steps", "5", "--chains", "1", *words, "--out", "run")
    design = read_design(here / "run" / "design.json")
    assert design.problem.section == Section(0.2, 0.5, joint=0.06)
    assert design.problem.material.poisson == 0.35
    part = design.provenance["part"]
    assert (part["width"], part["thickness"], part["scale"], part["material"]) == (1.6, 4, 8, "pla")


def test_a_problem_with_a_section_keeps_it(here: Path) -> None:
    problem = replace(
        find_problem(PROBLEM), section=Section(0.15, 0.4), material=Elasticity(3.0, 0.4)
    )
    write_problem(problem, here / "thin.json")
    call("design", "thin.json", "--steps", "5", "--chains", "1", "--out", "run")
    design = read_design(here / "run" / "design.json")
    assert (design.problem.section, design.problem.material) == (
        Section(0.15, 0.4), Elasticity(3.0, 0.4)
    )  # fmt: skip
    assert design.provenance["part"]["width"] == 1.5
    call("design", "--from", "run", "--steps", "5", "--chains", "1", "--out", "again")
    assert read_design(here / "again" / "design.json").problem.section == Section(0.15, 0.4)


def test_the_paper_is_one_switch(here: Path) -> None:
    words = ("--steps", "300", "--chains", "1", "--seed", "4")
    outcome = call("design", PROBLEM, "--paper", *words, "--out", "one")
    assert outcome.code == 0, outcome.err
    settings = json.loads((here / "one" / "run.json").read_text())["settings"]
    assert settings == MetropolisSettings(steps=300, chains=1, seed=4).to_dict() | {
        "strokes": [1.0], "goals": [], "moves": ["flip"]
    }  # fmt: skip
    long = ("--model", "springs", "--search", "paper", "--unloaded-beams", "keep")
    assert call("design", PROBLEM, *long, *words, "--out", "two").code == 0
    assert table(here / "one") == table(here / "two")
    assert read_design(here / "one" / "design.json").problem.hash == find_problem(PROBLEM).hash


def test_a_frame_in_space_is_designed(here: Path) -> None:
    problem, _ = read_reference("octet-crane")
    write_problem(problem, here / "octet.json")
    outcome = call("design", "octet.json", "--steps", "20", "--chains", "1", "--out", "run")
    assert outcome.code in {0, 3}, outcome.err
    assert "frames, 8 elements" in outcome.out
    (row,) = call("evaluate", "run", "--elements", "8", "--json").data["results"]
    assert row["efficiency"] == pytest.approx(design_of(here / "run")["efficiency"], abs=1e-9)
