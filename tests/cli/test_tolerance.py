"""`bellcrank tolerance`: tables, JSON, the map of critical struts, refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from PIL import Image

from bellcrank.model import write_design
from bellcrank.workflows import find_design

from .helpers import call, refusal

pytestmark = pytest.mark.usefixtures("here")
FEW = ("--prints", 6, "--no-struts")


def test_the_table_has_each_item_and_the_objective() -> None:
    outcome = call("tolerance", "machine:crane", *FEW)
    assert outcome.code == 0, outcome.err
    assert outcome.out.startswith("16 scenarios, by frames with one element in each strut")
    head, *rows = [line for line in outcome.out.splitlines() if line[:1].isalpha()]
    assert head.split()[:5] == ["item", "wanted", "drawn", "widths", "direction"]
    assert [row.split()[0] for row in rows[:3]] == ["clearance", "strain", "gain"]
    assert "6 of 6 random prints meet all items" in outcome.out
    assert "strut" not in outcome.out.replace("each strut", "")


def test_json_has_values_in_the_units_of_the_part_and_the_scenarios() -> None:
    outcome = call("tolerance", "machine:crane", "--prints", 4, "--json", "--picture", "struts.png")
    found = json.loads(outcome.out)
    assert found["schema"] == "bellcrank/tolerance/1"
    assert found["deviations"]["prints"] == 4
    gain = found["items"][-1]
    assert gain["objective"]
    assert gain["worst"]["print"]["scenario"].startswith("print ")
    assert gain["worst"]["print"]["value"] <= gain["percentile_5"] <= 1.2 * gain["nominal"]
    assert gain["yield"] is None
    lost = [each["stable"] for each in found["struts"]]
    assert len(lost) == found["scenarios"] - 10 - 4
    assert lost == sorted(lost)  # those without a stable path come first
    with Image.open("struts.png") as picture:
        assert picture.size[0] > 800


def test_processes_and_one_process_agree() -> None:
    one, two = (
        json.loads(
            call("tolerance", "human:crane", "--prints", 60, "--json", "--workers", count).out
        )
        for count in (1, 2)
    )
    for each in (one, two):
        each.pop("provenance")
    assert one == two


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("--thin", 1.5), "thin: expected a number from 0 to 0.9, got 1.5"),
        (("--workers", 0), "--workers: expected at least 1, got 0"),
        (("--picture", "a.png", "--no-struts"), "--picture draws the loss of each strut"),
        (("--picture", "a.bmp"), "bmp"),
    ],
)
def test_bad_input_is_refused(given: tuple[object, ...], message: str) -> None:
    assert message in refusal("tolerance", "machine:crane", *given)
    assert not list(Path().iterdir())


def test_a_design_without_a_stable_path_has_no_tolerance() -> None:
    design = find_design("machine:crane")
    given = replace(design.problem.input, amount=20.0 * design.problem.input.amount)
    write_design(replace(design, problem=replace(design.problem, input=given)), "far.json")
    assert "the design has no tolerance to compute" in refusal("tolerance", "far.json", *FEW)
