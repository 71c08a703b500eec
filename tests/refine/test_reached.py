"""What refinements have reached while they go on."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from bellcrank.refine.reached import Reached


def record(reached: Reached, number: int, name: str, violation: float, **figures: Any) -> None:
    rows = SimpleNamespace(violation=violation, objective=figures.get("objective", 0.0))
    progress: Any = SimpleNamespace(
        rows=rows, design=name, share=figures.get("share"), has_objective=True
    )
    reached.add(number, progress)


def test_the_latest_geometry_that_meets_all_items_is_kept() -> None:
    reached = Reached()
    record(reached, 0, "far", 0.5)
    record(reached, 0, "nearer", 0.2)
    record(reached, 0, "farther", 0.3)
    assert reached.designs() == ["nearer"]
    assert not reached.met
    record(reached, 0, "met", 0.0, objective=3.0)
    record(reached, 0, "corrected", 0.0, objective=2.0)
    record(reached, 0, "missed", 0.1, objective=9.0)
    assert reached.designs() == ["corrected"]


def test_of_two_designs_that_of_the_larger_objective_is_first_and_missed_ones_are_last() -> None:
    reached = Reached()
    record(reached, 0, "missed", 0.1, objective=9.0)
    record(reached, 1, "small", 0.0, objective=1.0)
    record(reached, 2, "large", 0.0, objective=2.0)
    assert reached.designs() == ["large", "small", "missed"]


def test_geometries_that_more_prints_meet_are_better() -> None:
    reached = Reached()
    record(reached, 0, "many", 0.0, share=0.9, objective=1.0)
    record(reached, 0, "few", 0.0, share=0.5, objective=2.0)
    record(reached, 1, "some", 0.0, share=0.7, objective=3.0)
    assert reached.designs() == ["many", "some"]
    record(reached, 0, "as many", 0.0, share=0.9, objective=0.5)
    assert reached.designs() == ["as many", "some"]
