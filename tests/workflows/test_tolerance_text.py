"""What a report of tolerances says of random prints."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.mechanics import ItemResult
from bellcrank.task import find_task
from bellcrank.tolerance import Scenario, ScenarioResult, Tolerance
from bellcrank.workflows.tolerance import ToleranceReport, deviations_of, tolerance_sentence

if TYPE_CHECKING:
    from bellcrank.tolerance.scenarios import Kind


def test_the_items_that_random_prints_miss_are_counted() -> None:
    task = find_task("slider")
    assert task is not None
    design = task.initial_design()
    wanted = design.problem.specification
    assert wanted is not None

    def result(*missed: str) -> ScenarioResult:
        items = [
            ItemResult(item, 0.0, float(item.quantity in missed), 0.5 - (item.quantity in missed))
            for item in wanted.items
        ]
        return ScenarioResult("converged", 1.0, items, [1.0])

    lost = ScenarioResult("snapped", math.nan, [], [math.nan])
    rows: list[tuple[Kind, ScenarioResult]] = [
        ("nominal", result()), ("input", result("off_axis")),
        ("print", result("off_axis")), ("print", result("off_axis", "rotation")),
        ("print", lost), ("print", result()),
    ]  # fmt: skip
    scenarios = [Scenario(name=f"{kind} {k}", kind=kind) for k, (kind, _) in enumerate(rows)]
    tolerance = Tolerance(scenarios, [each for _, each in rows], wanted.maximise)
    report = ToleranceReport(design, task.part, deviations_of(design, task.part), tolerance)
    text = tolerance_sentence(report)
    assert "; 1 of 4 random prints meet all items: widths up to 10% off" in text
    assert text.endswith(
        "; prints that miss items: lost: 1, off-axis motion: 2, rotation: 1; with an input turned "
        "as far, a part as drawn misses off-axis motion, too"
    )
