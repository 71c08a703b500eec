"""Which designs of a search are refined."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank.mechanics import ItemResult
from bellcrank.model import Design, Item
from bellcrank.part import PartSpec
from bellcrank.refine import Refinement
from bellcrank.refine.refinement import Progress
from bellcrank.refine.state import State
from bellcrank.search.selection import Candidate, Finalist, Selection
from bellcrank.task import find_task
from bellcrank.web import refinement_progress
from bellcrank.web.refinement_progress import RefinementReporter
from bellcrank.workflows import refinement
from bellcrank.workflows.refinement import BATCHES, refine_selection, with_refined
from bellcrank.workflows.refiners import GeometryCount

if TYPE_CHECKING:
    from collections.abc import Sequence

CHAINS = 2
ITEM = Item(quantity="gain", case="case", output="output", at_least=1.0)
GOOD, BAD = ItemResult(ITEM, 2.0, 0.0, 1.0), ItemResult(ITEM, 0.5, 0.5, -0.5)


def selection() -> Selection:
    """Return six copies of the full slider, three for each chain."""
    task = find_task("slider")
    assert task is not None
    design: Any = Design(task.problem, task.problem.initial)
    response: Any = SimpleNamespace(efficiency=1.0)
    candidates = [Candidate(1.0, chain, 0, b"") for chain in (0, 1, 0, 1, 0, 1)]
    others = tuple(Finalist(each, design, response) for each in candidates[1:])
    return Selection(design, response, candidates[0], 1.0, 1.0, {}, others=others)


@pytest.mark.parametrize(
    ("frames", "sheet", "sheets", "batches", "best"),
    [
        ([True] * 4, [BAD, GOOD, BAD, BAD], 1, 1, 1),
        ([True] * 4, [BAD, BAD, BAD, GOOD], 1, 2, 3),
        ([True] * 6, [BAD] * 6, 1, BATCHES, 0),
        ([True] * 6, [None] * 6, 1, BATCHES, 0),
        ([True] * 4, [None] * 4, 0, 1, 0),
        ([False] * 4, [None] * 4, 0, 1, 0),
        ([False, True, True, True], [None, BAD, GOOD, BAD], 1, 2, 2),
    ],
    ids=["first", "second", "none", "unstable", "without a sheet", "infeasible", "one"],
)
def test_others_are_refined_if_the_best_miss_items_in_the_sheet_only(
    monkeypatch: pytest.MonkeyPatch,
    frames: list[bool],
    sheet: list[ItemResult | None],
    sheets: int,
    batches: int,
    best: int,
) -> None:
    given = selection()
    state = State(1.0, (GOOD,), met=True)
    plain = Refinement(given.design, state, state, 1, 1, 0, "500 geometries", improved=True)
    further: list[Refinement] = []

    def refine(designs: Sequence[Design], spec: PartSpec | None, *_: Any) -> list[Refinement]:
        if spec is None:
            return [plain] * len(designs)
        found = []
        for _ in designs:
            number = len(further)
            own = sheet[number]
            after = replace(state, met=frames[number], sheet=() if own is None else (own,))
            further.append(replace(plain, after=after, sheets=sheets, steps=number))
            found.append(further[-1])
        return found

    monkeypatch.setattr(refinement, "refine_designs", refine)
    verification: Any = SimpleNamespace(fault=None)
    monkeypatch.setattr(
        refinement,
        "_verified",
        lambda finalist, _design: replace(finalist, verification=verification),
    )
    _, chosen = refine_selection(given, PartSpec())
    assert len(further) == CHAINS * batches
    assert chosen is not None
    assert chosen.after is further[best].after


@pytest.mark.parametrize(
    ("met", "sheet", "is_refined"),
    [(True, GOOD, False), (True, BAD, True), (False, None, True)],
    ids=["met", "missed in the sheet", "missed"],
)
def test_the_reserve_is_refined_only_if_no_other_design_meets_all_items(
    monkeypatch: pytest.MonkeyPatch, met: bool, sheet: ItemResult | None, is_refined: bool
) -> None:
    given = selection()
    reserve = tuple(replace(each, efficiency=2.0) for each in (given.design,) * CHAINS)
    finalists = tuple(
        Finalist(Candidate(1.0, chain, 0, b""), design, given.response)
        for chain, design in enumerate(reserve)
    )
    given = replace(given, reserve=finalists)
    state = State(1.0, (GOOD,), met=True)
    plain = Refinement(given.design, state, state, 1, 1, 0, "500 geometries", improved=True)
    reported: list[int] = []

    def refine(
        designs: Sequence[Design], spec: PartSpec | None, report: Any, *_: Any
    ) -> list[Refinement]:
        rows: Any = None
        progress = Progress(0, 0, np.zeros(0), rows, 1.0)
        for index in range(len(designs)):
            report(index, progress)
        of_reserve = designs[0].efficiency == 2.0
        missed = replace(state, met=met, sheet=() if sheet is None else (sheet,))
        after = replace(state, sheet=(GOOD,)) if of_reserve else missed
        after = state if spec is None else after
        sheets = int(bool(after.sheet))
        return [replace(plain, design=each, after=after, sheets=sheets) for each in designs]

    monkeypatch.setattr(refinement, "refine_designs", refine)
    verification: Any = SimpleNamespace(fault=None)
    monkeypatch.setattr(
        refinement,
        "_verified",
        lambda finalist, design: replace(finalist, design=design, verification=verification),
    )
    found, chosen = refine_selection(given, PartSpec(), lambda number, _: reported.append(number))
    assert chosen is not None
    assert (found.design.efficiency == 2.0) == is_refined
    # Designs of the reserve have numbers of their own.
    assert (max(reported) >= 1 + len(given.others)) == is_refined


@pytest.mark.parametrize(
    ("faults", "chosen"),
    [
        ([0.4, 0.2, 0.3], 1),
        ([0.4, 0.5, 0.6], 0),
        ([0.4, 0.2, 0.0], 2),
        ([0.0, 0.2, 0.3], 0),
    ],
    ids=["nearest", "the search is nearest", "met", "the search meets them"],
)
def test_a_stopped_refinement_leaves_the_design_nearest_to_the_items(
    monkeypatch: pytest.MonkeyPatch, faults: list[float], chosen: int
) -> None:
    given = selection()
    designs = [given.design, *(replace(given.design, efficiency=float(k)) for k in (1, 2))]

    def verified(finalist: Finalist, design: Design) -> Finalist:
        (own,) = (fault for fault, each in zip(faults, designs, strict=True) if each is design)
        items = [ItemResult(ITEM, 1.0 - own, own, -own)]
        found: Any = SimpleNamespace(fault="missed" if own else None, is_stable=True, items=items)
        return replace(finalist, design=design, verification=found, items=tuple(items))

    monkeypatch.setattr(refinement, "_verified", verified)
    assert with_refined(given, designs[1:]).design is designs[chosen]


def test_the_geometry_that_is_shown_is_the_nearest_until_one_meets_all_items() -> None:
    design = selection().design
    reporter = RefinementReporter(PartSpec(), GeometryCount(), only_met=True)
    shown = []
    for number, violation, objective in (
        (0, 0.5, 3.0), (1, 0.2, 2.0), (0, 0.4, 5.0), (0, 0.0, 1.0), (1, 0.1, 9.0), (1, 0.0, 2.0),
    ):  # fmt: skip
        rows: Any = SimpleNamespace(violation=violation, objective=objective)
        own = replace(design, efficiency=objective)
        progress: Any = SimpleNamespace(
            rows=rows, design=own, evaluations=1, sheets=0, share=None,
            has_objective=True,
        )  # fmt: skip
        reporter.add(number, progress)
        shown.append(None if reporter.design is None else reporter.design.efficiency)
        reporter.only_met = False
    # The first one is not shown beside a design that meets all items.
    assert shown == [None, 2.0, 2.0, 1.0, 1.0, 2.0]
    assert [each.efficiency for each in reporter.designs()] == [2.0, 1.0]


def test_the_time_of_a_geometry_is_known_from_the_second_one_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = iter([100.0, 101.0, 130.0])
    monkeypatch.setattr(refinement_progress, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    reporter = RefinementReporter(PartSpec(), GeometryCount(most=40))
    rows: Any = SimpleNamespace(violation=1.0, objective=0.0)
    found = []
    for evaluations in (1, 16):
        progress: Any = SimpleNamespace(
            rows=rows,
            design=None,
            evaluations=evaluations,
            sheets=0,
            share=None,
            has_objective=True,
        )
        reporter.add(0, progress)
        summary = reporter.summary()
        assert summary is not None
        found.append((summary["geometries"], summary["most"], summary["seconds"]))
    assert found == [(1, 40, None), (16, 40, 2.0)]
