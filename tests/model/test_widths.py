"""Beams of different widths, and nodes elsewhere."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from bellcrank.errors import InvalidProblem, InvalidSettings
from bellcrank.mechanics import FrameEvaluator
from bellcrank.model import (
    Problem,
    Section,
    find_problem,
    problem_from_dict,
    problem_to_dict,
)
from bellcrank.part import PartSpec, frame_problem, spring_problem


@pytest.fixture
def crane() -> Problem:
    return replace(find_problem("crane"), section=Section(0.2, 0.5, joint=0.06))


def test_one_width_for_all_beams_equals_a_section_of_that_width(crane: Problem) -> None:
    wide = crane.with_geometry(crane.lattice.positions, np.full(352, 0.3))
    alike = replace(crane, section=Section(0.3, 0.5, joint=0.09))
    for elements in (None, 4):
        found, expected = (
            FrameEvaluator(each, elements=elements).evaluate(crane.initial)
            for each in (wide, alike)
        )
        assert found.energy == pytest.approx(expected.energy, rel=1e-12)
        assert found.efficiency == pytest.approx(expected.efficiency, rel=1e-9)
    strains = []
    for each in (wide, alike):
        evaluator = FrameEvaluator(each)
        evaluator.evaluate(crane.initial)
        strains.append(evaluator.largest_strain())
    assert strains[0] == pytest.approx(strains[1], rel=1e-9)


def test_widths_and_positions_are_kept_in_files(crane: Problem) -> None:
    rng = np.random.default_rng(0)
    positions = crane.lattice.positions + 0.01 * rng.normal(size=crane.lattice.positions.shape)
    changed = crane.with_geometry(positions, rng.uniform(0.2, 0.3, 352))
    again = problem_from_dict(json.loads(json.dumps(problem_to_dict(changed))))
    assert again.hash == changed.hash
    assert again.hash != crane.hash
    assert np.array_equal(again.beam_widths, changed.beam_widths)
    assert "widths" not in problem_to_dict(crane)


@pytest.mark.parametrize(
    ("widths", "message"),
    [
        (np.full(3, 0.2), r"widths: expected shape \(352,\), one for each beam, got \(3,\)"),
        (np.full(352, -0.1), r"widths\[0\]: expected a number above 0, got -0.1"),
        (np.full(352, 1.5), "beams 1.5 wide are not slender"),
        (np.full(352, np.nan), "widths"),
    ],
)
def test_wrong_widths_are_refused(crane: Problem, widths: np.ndarray, message: str) -> None:
    with pytest.raises(InvalidProblem, match=message):
        crane.with_geometry(crane.lattice.positions, widths)


def test_springs_have_no_widths(crane: Problem) -> None:
    wide = crane.with_geometry(crane.lattice.positions, np.full(352, 0.3))
    assert spring_problem(wide).widths is None
    with pytest.raises(InvalidProblem, match="springs have no width"):
        replace(find_problem("crane"), widths=np.full(352, 0.3))


def test_widths_scale_with_another_part(crane: Problem) -> None:
    wide = crane.with_geometry(crane.lattice.positions, np.full(352, 0.3))
    thin = frame_problem(wide, PartSpec(width=1.0))
    assert thin.beam_widths == pytest.approx(np.full(352, 0.15))


def test_parts_keep_the_ratios_of_widths(crane: Problem) -> None:
    widths = np.full(352, 0.2)
    widths[7] = 0.3
    design = crane.with_geometry(crane.lattice.positions, widths).full_design()
    part = PartSpec(width=1.0).of(design)
    assert part.widths[7] == pytest.approx(1.5)
    assert np.delete(part.widths, 7) == pytest.approx(1.0)
    assert PartSpec().of(crane.full_design()).widths == pytest.approx(2.0)
    assert part.outline().area > PartSpec(width=1.0).of(crane.full_design()).outline().area
    widths[7] = 0.6
    slender = crane.with_geometry(crane.lattice.positions, widths).full_design()
    with pytest.raises(InvalidSettings, match="struts 12 mm wide are not slender"):
        PartSpec(width=4.0).of(slender)


def test_a_joint_is_at_most_half_as_long_as_the_section_is_wide() -> None:
    with pytest.raises(InvalidProblem, match=r"section.joint: expected a length from 0 to half"):
        Section(0.2, 0.5, joint=0.11)
    with pytest.raises(InvalidSettings, match="joint: expected a length from 0 to half the width"):
        PartSpec(width=2.0, joint=1.5)
    assert Section(2.0, 5.0, joint=0.5).scaled(0.1).joint == pytest.approx(0.05)
    assert Section.round(0.2, 0.05).to_dict() == {
        "shape": "round", "diameter": 0.2, "joint": 0.05,
    }  # fmt: skip
