"""`bellcrank characterise`: what it prints, keeps and refuses."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from bellcrank.machines import read_characterisation
from bellcrank.machines.library import find_entry
from bellcrank.model import write_design
from tests.machines.test_two_port import unstable_actuator

from .helpers import call, colours, files, refusal, write

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.usefixtures("here")


def test_a_table_says_what_a_design_does_at_its_ports() -> None:
    outcome = call("characterise", "human:crane", "--points", 4)
    assert outcome.code == 0, outcome.err
    rows = {line.split("  ")[1].strip(): line for line in outcome.out.splitlines() if "  " in line}
    assert rows["efficiency, output free"].split()[-1] == "0.8178"
    assert "spring:0.123" in outcome.out
    free = next(line.split() for line in outcome.out.splitlines() if line.split()[:1] == ["free"])
    assert free == ["free", "0.433", "0.4682", "0.4375", "1.01", "0", "converged"]
    assert outcome.err == ""


def test_json_is_the_record_that_is_kept(here: Path) -> None:
    outcome = call(
        "characterise", "crane", "--points", 2, "--load", "free", "--json", "--out", "a.json"
    )
    assert outcome.code == 0, outcome.err
    assert outcome.data == json.loads((here / "a.json").read_text())
    assert outcome.data["schema"] == "bellcrank/two-port/1"
    assert [curve["load"] for curve in outcome.data["curves"]] == ["free"]
    assert outcome.err == "wrote a.json\n"
    assert read_characterisation(here / "a.json").beams == 352


def test_a_folder_takes_record_and_picture(here: Path) -> None:
    words = ("characterise", "human:pliers", "--points", 3, "--out", "port")
    outcome = call(*words)
    assert outcome.code == 0, outcome.err
    assert set(files(here / "port")) == {"two-port.json", "two-port.png"}
    assert colours(here / "port" / "two-port.png") > 100
    assert "port/two-port.json: exists already" in refusal(*words)
    assert call(*words, "--overwrite").code == 0


@pytest.mark.parametrize("name", ["port.png", "port.svg", "port.pdf"])
def test_a_picture_alone(here: Path, name: str) -> None:
    outcome = call("characterise", "human:crane", "--points", 2, "--out", name)
    assert outcome.code == 0, outcome.err
    assert set(files(here)) == {name}


def test_no_figure_of_the_table_is_cut_off() -> None:
    load = "spring:0.012345678"
    outcome = call("characterise", "human:crane", "--points", 1, "--load", load, width=70)
    assert "…" not in outcome.out
    first = "".join(line[2:13].strip() for line in outcome.out.splitlines())
    assert load in first


def test_loads_of_ones_own_and_a_loss_of_stability(here: Path) -> None:
    write_design(unstable_actuator(), here / "unstable.json")
    words = ("--load", "blocked", "--load", "force:-1e-3", "--load", "spring:2e-3", "--points", 5)
    outcome = call("characterise", "unstable.json", *words)
    assert outcome.code == 0, outcome.err
    assert "snapped at 46" in outcome.out
    assert "warning: blocked: stability is lost at 46" in outcome.err
    assert "force:-0.001" in outcome.out


def test_a_design_whose_output_is_loose_is_characterised_and_said_to_be(
    small: str, here: Path
) -> None:
    data = json.loads((here / small).read_text())
    # Nodes 4 and 5 on top: without the beams 5 (2, 4) and 7 (4, 5) the output has none left.
    data["initial"] = "fa"
    write(here / "loose.json", data)
    outcome = call("characterise", "loose.json", "--points", 2)
    assert outcome.code == 0, outcome.err
    assert "the output is not connected to the input" in outcome.err
    assert "blocked" not in outcome.out.split("at the end of the stroke")[1]


def test_bad_input_is_refused_in_one_line(here: Path) -> None:
    assert "--points: expected at least one, got 0" in refusal(
        "characterise", "crane", "--points", 0
    )
    assert "load 'heavy': expected free" in refusal("characterise", "crane", "--load", "heavy")
    assert "unloaded_beams must be one of" in refusal(
        "characterise", "crane", "--unloaded-beams", "some"
    )
    assert "unknown" in refusal("characterise", "nowhere")
    assert "a.txt: expected a record (.json)" in refusal("characterise", "crane", "--out", "a.txt")
    write(here / "mine.json", "{}")
    assert "mine.json: exists already" in refusal("characterise", "crane", "--out", "mine.json")
    assert "no folder" in refusal("characterise", "crane", "--out", "no/where.json", code=1)


def test_a_record_says_of_which_model_it_is(here: Path) -> None:
    own, springs, frames = (
        call("characterise", name, "--points", 1, "--load", "free", *model, "--json").data
        for name, model in (
            ("human:crane", ()),
            ("down-9-straight-50g", ("--model", "springs")),
            ("down-9-straight-50g", ()),
        )
    )
    assert [each["model"] for each in (own, springs, frames)] == ["springs", "springs", "frames"]
    assert springs["mask"] == frames["mask"]
    assert springs["rest"]["efficiency"] < 0.8 * frames["rest"]["efficiency"]
    del own["model"]
    write(here / "old.json", own)
    assert read_characterisation(here / "old.json").model == "springs"
    name = "down-9-straight-50g"
    beams = find_entry(name).design.beam_count
    assert f"{beams} beams; frames" in call("characterise", name, "--points", 1).out
    assert "unknown model 'beams'" in refusal("characterise", name, "--model", "beams")
