"""Worst values, percentiles and yield of given results."""

from __future__ import annotations

import math

import pytest

from bellcrank.mechanics import ItemResult
from bellcrank.mechanics.items import margin
from bellcrank.model import Item, ObjectiveTerm
from bellcrank.tolerance import Scenario, ScenarioResult, Tolerance

OFF_AXIS = Item(quantity="off_axis", case="push", output="tip", at_most=0.1)
GAIN = ObjectiveTerm(quantity="gain", case="push", output="tip")


def result(off_axis: float, gain: float) -> ScenarioResult:
    if math.isnan(gain):
        return ScenarioResult("snapped", math.nan, [], [math.nan])
    own = margin(OFF_AXIS, off_axis)
    item = ItemResult(OFF_AXIS, off_axis, max(0.0, -own), own)
    return ScenarioResult("converged", gain, [item], [gain])


def tolerance(*rows: tuple[str, float, float]) -> Tolerance:
    scenarios = [
        Scenario(name=f"{kind} {k}", kind=kind, missing=k if kind == "strut" else None)
        for k, (kind, _, _) in enumerate(rows)
    ]
    return Tolerance(scenarios, [result(*row[1:]) for row in rows], [GAIN])


def test_the_worst_value_is_the_nearest_to_violating_the_item() -> None:
    found = tolerance(
        ("nominal", 0.05, 4.0), ("widths", 0.02, 5.0), ("widths", 0.12, 4.5), ("input", 0.06, 3.9),
    )  # fmt: skip
    item, gain = found.rows()
    assert (item.nominal, gain.nominal) == (0.05, 4.0)
    assert {kind: worst.value for kind, worst in item.worst.items()} == {
        "widths": 0.12, "input": 0.06
    }  # fmt: skip
    assert item.worst["widths"].scenario.name == "widths 2"
    assert gain.worst["widths"].value == 4.5
    assert not item.worst["widths"].met
    assert item.worst["input"].met
    assert gain.worst["widths"].met
    assert math.isnan(item.share)
    assert math.isnan(found.print_yield)


def test_yield_and_percentile_count_prints_that_lose_their_path() -> None:
    prints = [("print", 0.001 * k, 4.0 + 0.01 * k) for k in range(1, 18)]
    lost = [("print", math.nan, math.nan)] * 2
    found = tolerance(("nominal", 0.05, 4.0), *prints, ("print", 0.15, 6.0), *lost)
    item = found.rows()[0]
    assert item.share == found.print_yield == pytest.approx(17 / 20)
    # One of 20 prints may be worse; the second worst has lost its path.
    assert math.isnan(item.percentile)
    assert math.isnan(item.worst["print"].value)
    assert not found.rows()[1].worst["print"].met
    few = tolerance(("nominal", 0.05, 4.0), *[("print", 0.001 * k, 5.0) for k in range(100)])
    assert few.rows()[0].percentile == pytest.approx(0.094)
    assert few.print_yield == 1.0


def test_losses_of_struts_are_parts_of_the_efficiency() -> None:
    found = tolerance(
        ("nominal", 0.05, 4.0), ("strut", 0.05, 3.0), ("strut", 0.05, -1.0),
        ("strut", math.nan, math.nan),
    )  # fmt: skip
    assert found.strut_losses() == {1: 0.25, 2: 1.25, 3: math.inf}
    assert found.kinds == ["strut"]


def test_losses_of_struts_are_parts_of_a_rotation_that_is_maximised() -> None:
    turn = ObjectiveTerm(quantity="rotation", case="push", output="tip")
    names = ("nominal", "strut")
    scenarios = [
        Scenario(name=name, kind=name, missing=1 if name == "strut" else None) for name in names
    ]
    results = [ScenarioResult("converged", 0.9, [], [angle]) for angle in (60.0, 15.0)]
    found = Tolerance(scenarios, results, [turn])
    assert found.measure == "rotation"
    assert found.strut_losses() == {1: 0.75}
