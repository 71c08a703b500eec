"""Refinement over deviations of print and drive, and over losses of struts."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.mechanics.frames.joints import with_joints
from bellcrank.model import Design, Item, Tolerances
from bellcrank.refine import RefinementSettings, refine_design
from bellcrank.refine.active import FAR, ROOM, ActiveRows
from bellcrank.refine.choice import LARGER, ScenarioChoice
from bellcrank.refine.row_evaluator import RowEvaluator
from bellcrank.refine.scenarios import NEAR, PARTS, KeptRows, ScenarioRows, reduced_rows
from bellcrank.refine.variables import variables_of
from bellcrank.search import SpecificationEvaluator
from bellcrank.search.strut_loss import StrutLosses
from bellcrank.tolerance import Deviations, Scenario, ScenarioEvaluator, scenarios_of

from .designs import straight_crane
from .test_gradients import compared_rows

if TYPE_CHECKING:
    from collections.abc import Callable

TOLERANCES = Tolerances(width=0.15, angle=4.0, node=0.01)


def tolerant_crane(*items: Item, tolerances: Tolerances | None = TOLERANCES) -> Design:
    design = straight_crane()
    wanted = design.problem.specification
    assert wanted is not None
    wanted = replace(wanted, items=(*wanted.items, *items), tolerances=tolerances)
    return replace(design, problem=replace(design.problem, specification=wanted))


def a_print(design: Design) -> Scenario:
    deviations = Deviations(tolerances=TOLERANCES, prints=1, struts=False)
    return scenarios_of(design.problem, design.mask, deviations)[-1]


@pytest.mark.parametrize("with_own_joints", [False, True])
def test_rows_in_a_scenario_have_the_derivatives_of_differences(*, with_own_joints: bool) -> None:
    """With joints whose lengths follow the drawn part, and are printed wider or thinner."""
    design = tolerant_crane()
    if with_own_joints:
        design = replace(design, problem=with_joints(design.problem, design.mask))
        assert design.problem.joints is not None
    wanted = design.problem.specification
    assert wanted is not None
    variables = variables_of(design, 0.4, (0.2, 0.4))
    rows = RowEvaluator(variables, design.mask, wanted.items, scenario=a_print(design))
    rng = np.random.default_rng(2)
    start = np.where(variables.moves, 0.02, 0.01) * rng.normal(size=variables.count)
    compared = compared_rows(rows, start, rng.normal(size=variables.count))
    assert {"case.output.off_axis", "case.output.payload"} <= compared
    assert not {"length of struts", "holes between struts"} & compared  # of the drawn part alone


@pytest.mark.parametrize("with_own_joints", [False, True])
def test_the_loss_of_a_strut_has_the_derivative_of_differences(*, with_own_joints: bool) -> None:
    """The joints remain those of the whole drawn part."""
    design = tolerant_crane()
    if with_own_joints:
        design = replace(design, problem=with_joints(design.problem, design.mask))
    losses = StrutLosses(design.problem).by_strut(design.mask)
    beam = max((each for each in losses if losses[each] < 0.6), key=losses.__getitem__)
    variables = variables_of(design, 0.4, (0.2, 0.4))
    lost = Scenario(name="", kind="strut", missing=beam)
    rows = KeptRows(variables, design.mask, 0.7, lost)
    found = rows.evaluate(np.zeros(variables.count), slopes=True)
    assert found is not None
    # The efficiency is the mean motion over that of the input, as the gain is.
    assert found.constraints[0] == pytest.approx(losses[beam] / 0.3 - 1.0, abs=1e-6)
    way, step = np.random.default_rng(0).normal(size=variables.count), 1e-6
    ahead, behind = (rows.evaluate(sign * step * way) for sign in (1.0, -1.0))
    assert ahead is not None
    assert behind is not None
    expected = (ahead.constraints[0] - behind.constraints[0]) / (2.0 * step)
    assert found.constraint_slopes[0] @ way == pytest.approx(expected, rel=1e-4)


def test_the_kept_efficiency_has_the_derivative_of_differences() -> None:
    design = tolerant_crane()
    variables = variables_of(design, 0.4, (0.2, 0.4))
    thin = Scenario(name="", kind="widths", widths=np.full(len(design.mask), 0.8))
    rows = KeptRows(variables, design.mask, 0.9, thin)
    start = np.zeros(variables.count)
    found = rows.evaluate(start, slopes=True)
    assert found is not None
    assert found.names[0] == "kept"
    assert not len(found.objectives)
    evaluator = ScenarioEvaluator(with_kept(design, 0.9))
    drawn = evaluator.evaluate(Scenario(name="", kind="nominal"))
    result = evaluator.evaluate(thin)
    ratio = result.efficiency / drawn.efficiency
    assert found.constraints[0] == pytest.approx((1.0 - ratio) / 0.1 - 1.0, abs=1e-6)
    assert result.reserve == pytest.approx(ratio / 0.9 - 1.0)
    assert result.met == (ratio >= 0.9)
    assert result.margin == result.reserve
    way, step = np.random.default_rng(0).normal(size=variables.count), 1e-6
    ahead, behind = (rows.evaluate(sign * step * way) for sign in (1.0, -1.0))
    assert ahead is not None
    assert behind is not None
    expected = (ahead.constraints - behind.constraints) / (2.0 * step)
    assert found.constraint_slopes @ way == pytest.approx(expected, rel=1e-4, abs=1e-6)
    rows.maximise_margins()
    margins = rows.evaluate(start)
    assert margins is not None
    assert margins.objectives == pytest.approx(-found.constraints[:1])


def with_kept(design: Design, keep: float) -> Design:
    """Return a design whose efficiency is to keep a part of that as drawn."""
    wanted = design.problem.specification
    assert wanted is not None
    wanted = replace(wanted, tolerances=Tolerances(width=0.2, keep=keep))
    return replace(design, problem=replace(design.problem, specification=wanted))


@pytest.mark.slow
def test_a_refinement_keeps_the_efficiency_in_most_prints() -> None:
    design = with_kept(tolerant_crane(), 0.9)
    found = refine_design(design, RefinementSettings(evaluations=120, prints=20))
    evaluator = ScenarioEvaluator(found.design)
    results = [evaluator.evaluate(each) for each in ScenarioChoice(design, 20).all]
    share = np.mean([each.met for each in results])
    assert found.after.share == pytest.approx(min(share, 0.95))
    assert found.after.share == 0.95
    assert found.after.objective > found.before.objective


def test_rows_of_scenarios_follow_those_of_the_drawn_part() -> None:
    design = tolerant_crane()
    wanted = design.problem.specification
    assert wanted is not None
    variables = variables_of(design, 0.4, (0.2, 0.4))
    drawn = RowEvaluator(variables, design.mask, wanted.items)
    turned = RowEvaluator(
        variables, design.mask, wanted.items, scenario=Scenario(name="", kind="input", angle=5.0)
    )
    start = np.zeros(variables.count)
    one, other = drawn.evaluate(start), turned.evaluate(start)
    both = ScenarioRows(drawn, [turned]).evaluate(start)
    assert one is not None
    assert other is not None
    assert both is not None
    assert np.array_equal(both.objectives, [*one.objectives, *other.objectives])
    assert both.names == one.names + other.names
    assert len(set(zip(both.names, both.keys, strict=True))) == len(both.names)


def with_little_sag(factor: float) -> Design:
    """Return a design whose only item is a largest sag: a multiple of the present one."""
    design = tolerant_crane()
    wanted = design.problem.specification
    assert wanted is not None
    given = next(item for item in wanted.items if item.quantity == "sag")
    evaluator = SpecificationEvaluator(design.problem)
    evaluator.evaluate(design.mask)
    value = next(each.value for each in evaluator.results() if each.item.name == given.name)
    wanted = replace(wanted, items=(replace(given, at_most=factor * value),))
    return replace(design, problem=replace(design.problem, specification=wanted))


def rows_of(design: Design) -> Callable[[Scenario | None], RowEvaluator]:
    """Return the function from a scenario to its rows, from None to those as drawn."""
    variables, wanted = variables_of(design, 0.4, (0.2, 0.4)), design.problem.specification
    assert wanted is not None
    return lambda scenario: RowEvaluator(variables, design.mask, wanted.items, scenario=scenario)


def active_rows(design: Design, choice: ScenarioChoice) -> ActiveRows:
    """Return the rows of active scenarios of a design that is not moved yet."""
    drawn = rows_of(design)(None)
    variables = drawn.variables

    def design_at(vector: np.ndarray) -> Design:
        return replace(design, problem=variables.problem_at(vector))

    return ActiveRows(choice, drawn, rows_of(design), design_at, np.zeros(variables.count))


def test_a_scenario_that_is_far_from_being_met_is_reduced() -> None:
    design = with_little_sag(2.0)
    start = np.zeros(rows_of(design)(None).variables.count)
    thin = Scenario(name="thin", kind="widths", widths=np.full(len(design.mask), 0.3))
    reduced = reduced_rows(rows_of(design), thin, start)
    assert reduced is not None
    assert reduced.scenario is not None
    assert reduced.scenario.widths is not None
    width = float(reduced.scenario.widths[0])
    assert any(1.0 - width == pytest.approx(0.7 * part) for part in PARTS)
    found = reduced.evaluate(start)
    assert found is not None
    assert found.violation <= NEAR
    assert reduced_rows(rows_of(with_little_sag(0.01)), thin, start) is None


def test_scenarios_that_a_geometry_misses_are_active_and_those_with_room_are_not() -> None:
    design = with_little_sag(1.2)
    choice = ScenarioChoice(design, 8)
    outcomes = choice.outcomes(design, choice.candidates)
    assert any(-FAR < each.margin < 0.0 for each in outcomes)
    rows = active_rows(design, choice)
    assert not rows.is_reduced
    met = [each.met for each in outcomes if each.scenario.kind == "print"]
    assert 0.0 < np.mean(met) < 1.0
    assert rows.share == np.mean(met)
    active = {each.name for each in choice.chosen}
    assert {each.scenario.name for each in outcomes if each.margin < 0.0} <= active
    assert len(rows.others) == len(active) < len(choice.candidates)
    assert rows.evaluate(np.zeros(rows.variables.count)) is not None
    wider = np.where(rows.variables.moves, 0.0, 0.1)
    assert rows.update(wider) == (True, None)
    assert choice.tolerances is not None
    assert rows.share == choice.tolerances.least_yield < 1.0  # all prints meet all items
    # The sag is met with room in all scenarios; those that remain bound the objective.
    moved = replace(design, problem=rows.variables.problem_at(wider))
    objectives = {}
    for each in choice.outcomes(moved, choice.candidates):
        assert each.margin > ROOM
        objectives[id(each.scenario)] = each.objective
    chosen = [objectives[id(each)] for each in choice.chosen]
    assert min(chosen) == min(objectives.values())
    assert len(chosen) < len(objectives)


def test_a_geometry_that_is_far_from_meeting_a_scenario_is_left() -> None:
    design = with_little_sag(1.5)
    rows = active_rows(design, ScenarioChoice(design, 8))
    start = np.zeros(rows.variables.count)
    assert rows.update(start).back is None
    share = rows.share
    assert rows.update(np.where(rows.variables.moves, 0.0, -0.05)).back is start
    assert rows.share == share  # that of the geometry to which it goes back
    # A design that is far from meeting all scenarios has no way back.
    design = with_little_sag(0.5)
    choice = ScenarioChoice(design, 8)
    rows = active_rows(design, choice)
    assert rows.is_reduced
    assert not choice.chosen
    assert rows.update(start).back is None


def test_scaled_deviations_leave_some_width() -> None:
    thin = Scenario(name="thin", kind="widths", widths=np.array([0.1, 0.9]), angle=2.0)
    scaled = thin.scaled(1.15)
    assert scaled.widths == pytest.approx([0.05, 0.885])
    assert scaled.angle == pytest.approx(2.3)


def test_the_scenarios_are_extreme_widths_and_directions_then_prints() -> None:
    design = tolerant_crane(Item(quantity="strut_loss", at_most=0.3))
    choice = ScenarioChoice(design, 12)
    assert [each.name for each in choice.chosen] == [
        "widths +15 %", "widths -15 %",
        "input turned by +4 degrees", "input turned by -4 degrees",
    ]  # fmt: skip
    assert len(choice.all) == len(choice.candidates) == 4 + 12
    larger, given = choice.candidates[-1].widths, choice.all[-1].widths
    assert larger is not None
    assert given is not None
    assert larger - 1.0 == pytest.approx(LARGER * (given - 1.0))
    losses = StrutLosses(design.problem).by_strut(design.mask)
    assert choice.lost == sorted(losses, key=lambda beam: -losses[beam])[: len(choice.lost)]
    found = choice.robustness(design)
    assert 0.0 <= found.share <= 0.95
    results = ScenarioEvaluator(design)
    met = [results.evaluate(each).met for each in choice.all]
    assert min(np.mean(met), 0.95) == pytest.approx(found.share)
    outcomes = choice.outcomes(design, choice.candidates)[-2:]
    choice.add(outcomes)
    choice.add(outcomes)
    assert [each.name for each in choice.chosen[4:]] == [each.scenario.name for each in outcomes]


def test_without_deviations_only_the_drawn_part_counts() -> None:
    none = Tolerances(width=0.0, each_width=0.0, node=0.0, angle=0.0)
    assert ScenarioChoice(tolerant_crane(tolerances=none), 0).is_empty
    assert ScenarioChoice(tolerant_crane(tolerances=None), 100).is_empty


@pytest.mark.slow
def test_refinement_over_tolerances_increases_the_yield() -> None:
    """By prints that the refinement does not know."""
    design = tolerant_crane()
    deviations = Deviations(tolerances=TOLERANCES, prints=40, struts=False)
    prints = scenarios_of(design.problem, design.mask, deviations)[-40:]

    def met(each: Design) -> int:
        evaluator = ScenarioEvaluator(each)
        return sum(evaluator.evaluate(scenario).met for scenario in prints)

    found = refine_design(design, RefinementSettings(evaluations=120, prints=30))
    assert found.after.met
    assert found.after.share > found.before.share
    assert met(design) == 0
    assert met(found.design) > 30


@pytest.mark.slow
def test_refinement_reduces_the_loss_of_struts() -> None:
    limit = Item(quantity="strut_loss", at_most=0.5)
    design = tolerant_crane(limit, tolerances=None)
    before = StrutLosses(design.problem).by_strut(design.mask)
    found = refine_design(design, RefinementSettings(evaluations=80))
    after = StrutLosses(found.design.problem).by_strut(found.design.mask)
    # Struts without which the path is lost, or all motion, remain.
    few = sum(loss > 0.55 for loss in after.values())
    assert few < sum(loss > 0.55 for loss in before.values())


def test_the_mass_of_the_widest_print_is_limited() -> None:
    """The mass is that of the drawn part in the refinement, and of each print in its result."""
    choice = ScenarioChoice(tolerant_crane(), 0)
    assert choice.largest_area == pytest.approx(1.15)
    assert ScenarioChoice(tolerant_crane(tolerances=None), 0).largest_area == 1.0
