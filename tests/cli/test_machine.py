"""`bellcrank machine`: from a plan to one design, or to one line that says what is wrong."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from bellcrank.machines import elementary
from bellcrank.machines.bundled.contact import bundled_contact
from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import read_design, write_design

from .helpers import call, refusal

if TYPE_CHECKING:
    from pathlib import Path

PLAN = """
name = "pair"

[parts.first]
entry = "lever.json"

[parts.second]
entry = "lever.json"
join = "first.output"
rotate = 300

[input]
ports = ["first.input"]

[output]
ports = ["second.output"]
"""


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    """Write a plan and the design that it is made of, in a folder of their own."""
    write_design(elementary(7, "down").full_design(), tmp_path / "lever.json")
    path = tmp_path / "pair.toml"
    path.write_text(PLAN)
    return path


def test_a_plan_becomes_a_design_that_every_command_takes(plan: Path) -> None:
    told = call("machine", "build", plan, "--json").data
    assert told["parts"] == ["first", "second"]
    design = read_design(plan.with_suffix(".json"))
    assert design.problem.name == "pair"
    assert (told["beams"], told["nodes"]) == (
        design.beam_count, design.problem.lattice.node_count,
    )  # fmt: skip
    found = SpringEvaluator(design.problem).evaluate(design.mask).efficiency
    assert (told["model"], design.problem.section) == ("springs", None)
    assert told["efficiency"] == pytest.approx(found, abs=1e-8)
    evaluated = call("evaluate", plan.with_suffix(".json"), "--json").data["results"][0]
    assert evaluated["efficiency"] == told["efficiency"]
    assert evaluated["mask"] == design.mask_hex


def test_it_says_what_it_made(plan: Path, tmp_path: Path) -> None:
    outcome = call("machine", "build", plan, "--out", tmp_path / "made.json")
    assert outcome.code == 0, outcome.err
    for words in ("pair", "first, second", "efficiency", "designable"):
        assert words in outcome.out
    assert (tmp_path / "made.json").exists()


@pytest.mark.parametrize("model", ["springs", "frames"])
def test_prediction_and_simulation_are_compared(plan: Path, model: str) -> None:
    chosen = ("--model", model)
    found = call("machine", "predict", plan, "--points", 4, *chosen, "--json").data
    built = call("machine", "build", plan, *chosen, "--json").data
    assert found["model"] == built["model"] == model
    assert found["rest"]["efficiency"] == pytest.approx(built["efficiency"], rel=0.2)
    assert found["rest"]["input_stiffness"] > 0.0
    predicted, simulation = found["prediction"], found["simulation"]
    assert simulation["efficiency"] == pytest.approx(built["efficiency"], rel=1e-6)
    within = 0.05 if model == "springs" else 1e-6
    assert predicted["efficiency"] == pytest.approx(simulation["efficiency"], rel=within)
    assert (simulation["status"], simulation["reached"]) == ("converged", 1.0)
    assert len(simulation["motion"]) == len(predicted["output"]) == 5
    outcome = call("machine", "predict", plan, "--points", 2, *chosen)
    for words in (model, "predicted from its parts, full stroke", "simulated, full stroke"):
        assert words in outcome.out


def test_parts_of_different_models_are_refused_in_one_line(plan: Path) -> None:
    plan.write_text(PLAN.replace('entry = "lever.json"\njoin', 'entry = "strut-6"\njoin'))
    said = refusal("machine", "predict", plan)
    assert "parts first and second have different models (--model reads all parts as one)" in said
    assert "springs against frames" in said
    assert "unknown model 'beams'" in refusal("machine", "build", plan, "--model", "beams")


def test_a_stroke_that_snaps_is_reported(plan: Path) -> None:
    plan.write_text(PLAN.replace('ports = ["first.input"]', 'ports = ["first.input"]\namount = 60'))
    outcome = call("machine", "predict", plan, "--points", 2)
    assert outcome.code == 0, outcome.err
    assert "full stroke" not in outcome.out
    assert "of the stroke, where it snaps" in outcome.out
    assert "at least one" in refusal("machine", "predict", plan, "--points", 0)


def test_the_list_states_the_contact_of_struts() -> None:
    rows = {line.split()[0]: line for line in call("machine", "list", width=200).out.splitlines()}
    for name in ("reverser", "sorter-left"):
        assert bundled_contact(name).message in rows[name]


def test_a_bundled_machine_is_a_design_by_its_name(here: Path) -> None:
    built = call("machine", "build", "sorter-left", "--out", here / "sorter.json", "--json").data
    for name in ("sorter-left", "machine:sorter-left"):
        found = call("evaluate", name, "--json").data["results"][0]
        # `evaluate` leaves out the shortening of bent beams.
        assert found["efficiency"] == pytest.approx(built["efficiency"], rel=0.02)


def test_a_bundled_machine_is_built_by_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "amplifier").mkdir()
    monkeypatch.chdir(tmp_path)
    told = call("machine", "build", "amplifier", "--json").data
    assert told["parts"] == ["first", "second"]
    kept = json.loads((tmp_path / "amplifier.json").read_text())
    assert kept["efficiency"] == told["efficiency"]


@pytest.mark.parametrize("name", ["", ".", "nosuch"])
@pytest.mark.parametrize("words", [("build",), ("predict",)])
def test_what_is_no_plan_is_said(name: str, words: tuple[str, ...]) -> None:
    assert f"unknown plan {name!r}: expected a TOML file or one of amplifier" in refusal(
        "machine", *words, name
    )


def test_what_is_wrong_is_said_in_one_line(plan: Path, tmp_path: Path) -> None:
    assert "ending in .json" in refusal("machine", "build", plan, "--out", tmp_path / "two.stl")
    call("machine", "build", plan)
    assert "exists" in refusal("machine", "build", plan)
    assert call("machine", "build", plan, "--overwrite").code == 0
    assert "no such file" in refusal("machine", "build", tmp_path / "absent.toml")
    plan.write_text(PLAN.replace("lever.json", "absent.json"))
    assert "absent.json" in refusal("machine", "build", plan, "--overwrite")
    plan.write_text(PLAN.replace("rotate = 300", "rotate = 60"))
    assert "parts first and second overlap near" in refusal("machine", "build", plan, "--overwrite")
    plan.write_text(PLAN.replace("rotate", "turn"))
    assert "unknown key" in refusal("machine", "build", plan, "--overwrite")


def test_a_machine_is_designed_further_from_what_it_is(plan: Path) -> None:
    built = call("machine", "build", plan, "--model", "frames", "--json").data
    whole = plan.with_suffix(".json")
    out = plan.parent / "better"
    call("design", "--from", whole, "--steps", "200", "--chains", "1", "--out", out)
    summary = json.loads((out / "summary.json").read_text())
    # `design` reports frames of eight elements a beam.
    assert summary["initial_efficiency"] == pytest.approx(built["efficiency"], rel=2e-3)
    assert summary["efficiency"] > summary["initial_efficiency"]
