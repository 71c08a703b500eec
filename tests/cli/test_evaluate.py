"""What `bellcrank problems` and `bellcrank evaluate` say, and where they say it."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank import __version__
from bellcrank.model import (
    Section,
    builtin,
    find_problem,
    gallery_design,
    problem_to_dict,
    read_design,
    write_design,
)
from tests.reference3d import NAMES, read_reference

from .helpers import SMALL, Outcome, call, files, table, write

if TYPE_CHECKING:
    from pathlib import Path

FULL = {"crane": -0.0640859, "anti-parallel": 0.0420422}
"""Efficiencies of the full lattices."""


def results_of(outcome: Outcome) -> list[dict[str, Any]]:
    assert outcome.code == 0, outcome.err
    assert outcome.err == ""
    assert list(outcome.data) == ["results"]
    results: list[dict[str, Any]] = outcome.data["results"]
    return results


def test_the_version_is_told() -> None:
    outcome = call("--version")
    assert (outcome.code, outcome.out, outcome.err) == (0, f"bellcrank {__version__}\n", "")


@pytest.mark.parametrize("command", [(), ("design",), ("evaluate",), ("plot",), ("problems",)])
def test_help_is_a_result(command: tuple[str, ...]) -> None:
    outcome = call(*command, "--help")
    assert outcome.code == 0
    assert outcome.err == ""
    assert "Usage: bellcrank" in outcome.out


def test_all_built_in_problems_are_listed_with_their_numbers_of_beams() -> None:
    outcome = call("problems", width=80)
    assert outcome.code == 0
    assert outcome.err == ""
    for name in builtin:
        problem = find_problem(name)
        (line,) = (line for line in outcome.out.splitlines() if f" {name} " in line)
        assert f" {problem.lattice.beam_count} " in line
        assert f" {len(problem.designable)} " in line
        there = [gallery_design(kind, name) is not None for kind in ("human", "machine")]
        assert line.count(" yes ") == sum(there)


@pytest.mark.parametrize("problem", FULL)
@pytest.mark.usefixtures("here")
def test_full_lattices_have_the_known_efficiencies(problem: str) -> None:
    (result,) = results_of(call("evaluate", problem, "--json"))
    assert result["efficiency"] == pytest.approx(FULL[problem], abs=1e-6)
    assert result["status"] == "converged"
    assert result["beams"] == find_problem(problem).lattice.beam_count


@pytest.mark.usefixtures("here")
def test_a_human_design_moves_as_far_as_published() -> None:
    (result,) = results_of(call("evaluate", "human:crane", "--json"))
    assert result["efficiency"] == pytest.approx(1.0104575, abs=1e-6)


def masks_of(whole: Path) -> list[str]:
    """Return some designs a chain went through, out of order, one of them twice."""
    columns = table(whole)
    taken = [
        mask
        for mask, accepted in zip(columns["mask"], columns["accepted"], strict=True)
        if accepted
    ]
    return [taken[k].hex() for k in (90, 3, 40, 3)]


@pytest.mark.parametrize("form", ["masks", "results"])
def test_designs_are_evaluated_in_the_order_they_are_given(
    here: Path, whole: Path, form: str
) -> None:
    masks = masks_of(whole)
    assert len(set(masks)) == 3
    content = {"masks": masks} if form == "masks" else {"results": [{"mask": m} for m in masks]}
    write(here / "masks.json", content)
    as_searched = ("--unloaded-beams", "prune_all")
    results = results_of(
        call("evaluate", "scaling-8", "--designs", "masks.json", "--json", *as_searched)
    )
    assert [result["mask"] for result in results] == masks
    columns = table(whole)
    recorded = dict(
        zip((mask.hex() for mask in columns["mask"]), columns["efficiency"], strict=True)
    )
    for result in results:
        assert result["status"] == "converged"
        told = float.fromhex(recorded[result["mask"]])
        assert result["efficiency"] == pytest.approx(told, abs=1e-6)


def test_results_can_be_given_back_as_designs(here: Path, small: str) -> None:
    write(here / "masks.json", {"masks": ["ff", "e7"]})
    first = call("evaluate", small, "--designs", "masks.json", "--json")
    write(here / "again.json", first.out)
    assert call("evaluate", small, "--designs", "again.json", "--json") == first
    assert [result["beams"] for result in results_of(first)] == [8, 6]


def test_a_design_that_carries_nothing_has_no_efficiency_to_speak_of(
    here: Path, small: str
) -> None:
    write(here / "masks.json", {"masks": ["00"]})
    (result,) = results_of(call("evaluate", small, "--designs", "masks.json", "--json"))
    assert (result["efficiency"], result["beams"]) == (0.0, 0)


def test_no_designs_give_no_results(here: Path, small: str) -> None:
    write(here / "masks.json", {"masks": []})
    assert results_of(call("evaluate", small, "--designs", "masks.json", "--json")) == []


def test_a_table_is_printed_for_people(here: Path, small: str) -> None:
    (result,) = results_of(call("evaluate", small, "--json"))
    outcome = call("evaluate", small)
    assert outcome.err == ""
    (row,) = (line for line in outcome.out.splitlines() if "converged" in line)
    assert f" {result['efficiency']:.7f} " in row
    assert sorted(files(here)) == [small]


def test_the_objective_changes_the_efficiency(small: str) -> None:
    plain, strict = (
        results_of(call("evaluate", small, "--objective", name, "--json"))[0]["efficiency"]
        for name in ("displacement", "directional:6")
    )
    assert plain != strict


def test_a_process_of_its_own_keeps_results_and_messages_apart(here: Path) -> None:
    write(here / "small.json", SMALL)
    words = [sys.executable, "-m", "bellcrank", "evaluate"]
    good = subprocess.run([*words, "small.json", "--json"], capture_output=True, check=False)
    assert results_of(Outcome(good.returncode, good.stdout.decode(), good.stderr.decode()))
    bad = subprocess.run([*words, "gone.json", "--json"], capture_output=True, check=False)
    assert (bad.returncode, bad.stdout) == (2, b"")
    assert bad.stderr.startswith(b"error: ")
    assert b"Traceback" not in bad.stderr


@pytest.mark.slow
def test_a_design_keeps_the_objective_of_its_search(here: Path) -> None:
    settings = ("--search", "paper", "--steps", "200", "--chains", "1")
    made = call("design", "scaling-8", *settings, "--objective", "directional:200", "--out", "made")
    assert made.code in {0, 3}, made.err  # so few steps need not find a design that works
    summary = json.loads((here / "made" / "summary.json").read_text())
    searched = summary["figures"][0]["efficiency"]
    (result,) = results_of(call("evaluate", "made", "--json"))
    assert result["efficiency"] == searched
    assert result["objective"] == "directional:200"
    (motion,) = results_of(call("evaluate", "made", "--objective", "displacement", "--json"))
    assert motion["efficiency"] > searched + 0.01
    frames = call("validate", "made", "--elements", "1", "--json").data
    assert frames["objective"] == "directional:200"
    design = read_design(here / "made" / "design.json")
    same = replace(design, problem=replace(design.problem, objective=None))
    write_design(same, here / "motion.json")
    by_motion = call("validate", "motion.json", "--elements", "1", "--json").data
    assert by_motion["objective"] == "displacement"
    assert frames["efficiency"] < by_motion["efficiency"] - 0.01


def test_efficiencies_by_other_definitions_are_labelled(here: Path) -> None:
    assert "efficiency (force)" in call("evaluate", "pliers").out
    assert "efficiency (displacement)" in call("evaluate", "crane").out
    outcome = call("plot", "human:crane", "--compare", "human:pliers", "--out", "two.svg")
    assert outcome.code == 0, outcome.err
    picture = (here / "two.svg").read_text()
    assert "human:crane (displacement)" in picture
    assert "human:pliers (force)" in picture


# ---- models


@pytest.mark.usefixtures("here")
def test_the_model_is_a_frame_where_the_problem_has_a_section(here: Path) -> None:
    crane = find_problem("crane")
    for name, joint in (("frame", 0.06), ("points", 0.0)):
        section = Section(0.2, 0.5, joint=joint)
        write(here / f"{name}.json", problem_to_dict(replace(crane, section=section)))
    (springs,) = results_of(call("evaluate", "crane", "--json"))
    (frame,) = results_of(call("evaluate", "frame.json", "--json"))
    (default,) = results_of(call("evaluate", "crane", "--model", "frames", "--json"))
    (back,) = results_of(call("evaluate", "frame.json", "--model", "springs", "--json"))
    assert (springs["model"], frame["model"]) == ("springs", "frames")
    assert (frame["elements"], frame["bowing"]) == (1, True)
    assert "elements" not in springs
    assert back == springs
    # The default part has struts of 2 mm x 5 mm on 10 mm whose ends of 0.6 mm do not deform;
    # efficiencies do not depend on E.
    assert default["efficiency"] == pytest.approx(frame["efficiency"], abs=1e-9)
    assert "spring model" in call("evaluate", "crane").out
    assert "frames, as searched" in call("evaluate", "frame.json").out
    (linear,) = results_of(call("evaluate", "points.json", "--elements", "1", "--json"))
    assert (linear["elements"], linear["bowing"]) == (1, False)
    assert linear["efficiency"] == pytest.approx(-0.0558174726, abs=1e-9)
    assert "frames, 1 element" in call("evaluate", "frame.json", "--elements", "1").out


@pytest.mark.usefixtures("here")
def test_more_elements_bend_struts_between_their_ends() -> None:
    options = ("--model", "frames", "--json")
    (one,) = results_of(call("evaluate", "human:crane", "--elements", "1", *options))
    (eight,) = results_of(call("evaluate", "human:crane", "--elements", "8", *options))
    (searched,) = results_of(call("evaluate", "human:crane", *options))
    assert one["efficiency"] == pytest.approx(1.24696, abs=1e-4)
    assert eight["efficiency"] == pytest.approx(1.17604, abs=1e-4)
    assert searched["efficiency"] == pytest.approx(1.16887, abs=1e-4)
    assert (eight["elements"], eight["bowing"]) == (8, False)


@pytest.mark.parametrize("model", ["springs", "frames"])
@pytest.mark.usefixtures("here")
def test_the_motion_of_the_output_and_the_input_force_are_reported(model: str) -> None:
    (row,) = results_of(call("evaluate", "human:crane", "--model", model, "--json"))
    crane = find_problem("crane")
    moved = np.array(row["output_displacement"])
    assert moved @ [-1.0, 0.0] == pytest.approx(row["efficiency"] * crane.input.amount)
    assert row["off_axis"] == pytest.approx(abs(moved[1] / moved[0]))
    assert 0.0 < abs(row["output_rotation_deg"]) < 90.0
    force = np.array(row["input_force"])
    assert force[1] < 0.0
    # The mean force along the path is about half of the force at its end.
    work = 0.5 * crane.input.amount * -force[1]
    assert row["energy"] == pytest.approx(work, rel=0.3)


@pytest.mark.parametrize("name", NAMES)
def test_frames_agree_with_an_independent_code(here: Path, name: str) -> None:
    problem, data = read_reference(name)
    write(here / "frame.json", problem_to_dict(problem))
    rows = [
        row
        for row in data["results"]
        if row["element"] == "corotational" and row["theory"] == "bernoulli"
        and row["amount"] == data["input"]["amount"]
    ]  # fmt: skip
    write(here / "masks.json", {"masks": [row["mask"] for row in rows]})
    options = ("--designs", "masks.json", "--elements", "1", "--json")
    found = results_of(call("evaluate", "frame.json", *options))
    plane = problem.lattice.dimension == 2
    error = 1e-10 if plane else 1e-3
    for one, known in zip(found, rows, strict=True):
        assert one["status"] == "converged"
        assert one["efficiency"] == pytest.approx(known["efficiency"], abs=error)
        wanted = known["mean_output_displacement"][: problem.lattice.dimension]
        assert one["output_displacement"] == pytest.approx(wanted, abs=error)
        rotation = known["output_rotation_deg"]
        assert one["output_rotation_deg"] == pytest.approx(
            rotation[2] if plane else rotation, abs=10.0 * error
        )
        force = known["input_force"][: problem.lattice.dimension]
        assert one["input_force"] == pytest.approx(force, abs=5.0 * error * max(map(abs, force)))


def test_a_design_without_response_has_no_figures(here: Path) -> None:
    write(here / "masks.json", {"masks": ["0" * 88]})
    words = ("evaluate", "crane", "--designs", "masks.json", "--json")
    for model in ("springs", "frames"):
        (row,) = results_of(call(*words, "--model", model))
        assert row["beams"] == 0
        assert row["off_axis"] is None
