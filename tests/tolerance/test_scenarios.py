"""Scenarios: deviations of widths, nodes and input, and lost struts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.model import Design, find_problem, human_design
from bellcrank.part import PartSpec, frame_problem
from bellcrank.task import find_task
from bellcrank.tolerance import Deviations, Scenario, scenarios_of


@pytest.fixture(scope="module")
def crane() -> Design:
    design = human_design("crane")
    assert design is not None
    return replace(design, problem=frame_problem(design.problem, PartSpec()))


def named(design: Design, name: str, **changes: float) -> Scenario:
    found = scenarios_of(design.problem, design.mask, Deviations(**changes), 10.0)
    return next(scenario for scenario in found if scenario.name == name)


def test_widths_deviate_by_lengths_and_by_parts(crane: Design) -> None:
    wide = named(crane, "widths +0.1 mm").of(crane.problem)
    assert wide.beam_widths == pytest.approx(np.full(352, 0.21))
    thin = named(crane, "widths -20 %").of(crane.problem)
    assert thin.beam_widths == pytest.approx(np.full(352, 0.16))


def test_joints_follow_the_widths_of_their_struts(crane: Design) -> None:
    given = replace(crane.problem, joints=np.full((352, 2), 0.05))
    widths = np.linspace(0.5, 1.5, 352)
    changed = Scenario(name="", kind="print", widths=widths).of(given)
    assert changed.joints == pytest.approx(0.05 * np.stack([widths, widths], axis=1))


def test_the_input_turns_and_stretches_in_all_cases() -> None:
    problem = find_task("selector").problem
    changed = Scenario(name="", kind="input", angle=30.0, stroke=0.5).of(problem)
    for name, case in problem.cases.items():
        before, after = case.input, changed.cases[name].input
        cosine = (before.direction * after.direction).sum(axis=1)
        assert cosine == pytest.approx(np.full(len(cosine), np.cos(np.pi / 6)))
        assert after.amount == 0.5 * before.amount


def test_directions_turn_in_two_planes_in_space() -> None:
    design = find_problem("orthogonal").full_design()
    problem = frame_problem(design.problem, PartSpec())
    few = Deviations(prints=0, struts=False)
    inputs = [
        each for each in scenarios_of(problem, design.mask, few, 10.0) if each.kind == "input"
    ]
    assert len(inputs) == 4
    along = problem.input.direction[0]
    for scenario in inputs:
        turned = scenario.of(problem).input.direction[0]
        assert np.linalg.norm(turned) == pytest.approx(1.0)
        assert turned @ along == pytest.approx(np.cos(np.radians(5.0)))


def test_prints_are_random_within_their_limits_and_repeat_with_their_seed(crane: Design) -> None:
    prints = [
        scenarios_of(crane.problem, crane.mask, Deviations(prints=40, seed=seed), 10.0)
        for seed in (3, 3, 4)
    ]
    first, again, other = ([each for each in found if each.kind == "print"] for found in prints)
    assert len(first) == 40
    for one, two, three in zip(first, again, other, strict=True):
        assert np.array_equal(one.widths, two.widths)
        assert np.array_equal(one.moves, two.moves)
        assert not np.array_equal(one.moves, three.moves)
    moves = np.array([each.moves for each in first])
    assert np.abs(moves).max() <= 0.01  # 0.1 mm
    assert np.abs(moves).max() > 0.0099
    widths = np.array([each.widths for each in first])
    assert abs(widths.mean() - 1.0) < 0.03
    own = widths / widths.mean(axis=1, keepdims=True)
    assert own.std() == pytest.approx(0.05, rel=0.05)
    assert max(abs(each.angle) for each in first) <= 5.0


def test_fewer_prints_are_the_first_of_more(crane: Design) -> None:
    few, more = (
        [
            each.widths
            for each in scenarios_of(crane.problem, crane.mask, Deviations(prints=count), 10.0)
            if each.kind == "print"
        ]
        for count in (3, 9)
    )
    assert np.array_equal(few, more[:3])


def test_every_strut_that_is_not_in_the_support_is_lost_once(crane: Design) -> None:
    found = scenarios_of(crane.problem, crane.mask, Deviations(prints=0), 10.0)
    lost = [each.missing for each in found if each.kind == "strut"]
    held = np.isin(crane.problem.lattice.beams, crane.problem.supports.fixed).all(axis=1)
    assert lost == np.flatnonzero(crane.mask & ~held).tolist()


@pytest.mark.parametrize(
    ("name", "value"),
    [("width", -0.1), ("thin", 1.0), ("prints", -1), ("longest", 4.0)],
)
def test_sizes_out_of_range_are_refused(name: str, value: float) -> None:
    with pytest.raises(InvalidSettings, match=f"^{name}: expected"):
        Deviations(**{name: value})
