"""Refinement of several designs at a time."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.machines.bundled import bundled_part
from bellcrank.model import Design, Tolerances, gallery_design
from bellcrank.part import PartSpec
from bellcrank.refine import RefinementSettings
from bellcrank.refine.state import state_of
from bellcrank.task import find_task
from bellcrank.workflows import refiners
from bellcrank.workflows.refiners import (
    EVALUATIONS,
    KEPT_EVALUATIONS,
    GeometryCount,
    refine_designs,
    second_model,
    sheet_of,
    with_imperfections,
)

if TYPE_CHECKING:
    from bellcrank.refine.refinement import Progress


def designs() -> list[Design]:
    """Return the free crane for two tasks of a straight one, without a payload."""
    task, crane = find_task("straight-crane"), gallery_design("machine", "crane")
    assert task is not None
    assert crane is not None
    wanted = task.problem.specification
    assert wanted is not None
    found = []
    for largest in (0.1, 0.3):
        items = tuple(
            replace(item, at_most=largest) if item.quantity == "off_axis" else item
            for item in wanted.items
            if item.quantity != "payload"
        )
        problem = replace(task.problem, specification=replace(wanted, items=items))
        found.append(Design(problem, crane.mask))
    return found


def test_results_do_not_depend_on_the_number_of_workers() -> None:
    settings = RefinementSettings(steps=4)
    steps: dict[int, list[tuple[int, int]]] = {1: [], 2: []}

    def report(workers: int, number: int, progress: Progress) -> None:
        steps[workers].append((number, progress.step))

    results = [
        refine_designs(
            designs(), None, lambda *words, workers=workers: report(workers, *words), workers,
            threading.Event(), settings,
        )
        for workers in (1, 2)
    ]  # fmt: skip
    assert [len(each) for each in results] == [2, 2]
    for alone, parallel in zip(*results, strict=True):
        assert alone.after.objective == parallel.after.objective
        assert np.array_equal(
            alone.design.problem.lattice.positions, parallel.design.problem.lattice.positions
        )
    assert sorted(steps[1]) == sorted(steps[2])
    assert {number for number, _ in steps[1]} == {0, 1}


def test_a_stop_ends_the_processes() -> None:
    stop = threading.Event()
    stopped: list[float] = []

    def report(_number: int, _progress: Progress) -> None:
        if not stop.is_set():
            stopped.append(time.monotonic())
            stop.set()

    results = refine_designs(designs(), None, report, 2, stop, RefinementSettings(steps=400))
    assert len(results) < 2
    assert time.monotonic() - stopped[0] < 20.0


def column() -> Design:
    design = bundled_part("twist-column")
    assert design is not None
    return design


def test_parts_in_space_are_verified_with_imperfections() -> None:
    design = column()
    check = sheet_of(PartSpec(), design)
    assert check is not None
    first, second = check(design), check(design)
    assert first is not None
    assert second is not None
    own = state_of(design.problem, design.mask).records
    for channel, values in first["case"].channels.items():
        assert np.array_equal(values, second["case"].channels[channel])
        assert values.shape == own["case"].channels[channel].shape
    rotations = [each["case"].of("rotation", "output")[-1] for each in (own, first)]
    assert rotations[0] != rotations[1]
    assert rotations[0] == pytest.approx(rotations[1], rel=0.05)
    assert second_model(design.problem) == "imperfections"


def test_parts_whose_imperfections_matter_are_on_another_path(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    design = column()
    assert with_imperfections(design, 0.01) is not None
    assert with_imperfections(design, 0.06) is None
    monkeypatch.setattr(refiners, "DEPARTURE", 1e-6)
    assert with_imperfections(design, 0.01) is None


def test_in_the_plane_the_second_model_is_the_sheet() -> None:
    (design, _) = designs()
    assert second_model(design.problem) == "sheet"
    assert sheet_of(None, design) is None


def test_the_number_of_geometries_is_larger_where_deviations_keep_the_efficiency() -> None:
    task = find_task("straight-crane")
    assert task is not None
    wanted = task.problem.specification
    assert wanted is not None
    kept = replace(wanted, tolerances=Tolerances(width=0.2, keep=0.8))
    plain = GeometryCount(2, task.problem).most
    more = GeometryCount(2, replace(task.problem, specification=kept)).most
    assert more - plain == 2 * (KEPT_EVALUATIONS - EVALUATIONS)
