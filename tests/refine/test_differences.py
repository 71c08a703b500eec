"""Corrections of a refinement by better models."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.mechanics import VERIFICATION_INCREMENT, Channel, StrokeRecord
from bellcrank.model import gallery_design
from bellcrank.refine import RefinementSettings, refine_design
from bellcrank.refine.differences import NO_DIFFERENCE, Difference, difference, on_same_path
from bellcrank.refine.row_evaluator import RowEvaluator
from bellcrank.refine.variables import variables_of
from bellcrank.search import SpecificationEvaluator

from .designs import unloaded_crane

if TYPE_CHECKING:
    from bellcrank.model import Design
    from bellcrank.refine.differences import Records

MOTION = Channel("motion", "output")
FRACTIONS = np.array([0.5, 1.0])


def record(motion: np.ndarray, clearance: float = np.inf) -> StrokeRecord:
    return StrokeRecord(FRACTIONS, {MOTION: motion}, {"clearance": clearance})


def test_a_difference_makes_channels_those_of_the_better_model() -> None:
    rng = np.random.default_rng(0)
    here, better = rng.normal(size=(2, 2, 3))
    found = difference({"push": record(better, 0.1)}, {"push": record(here)}, {"push": 0.25})
    assert found.added_to("push", {MOTION: here})[MOTION] == pytest.approx(better)
    many = np.repeat(here[None], 5, axis=0)
    assert found.added_to("push", {MOTION: many})[MOTION].shape == (5, 2, 3)
    assert found.added_to("pull", {MOTION: here})[MOTION] == pytest.approx(here)
    assert found.overlaps["push"] == pytest.approx(0.15)


def test_what_a_model_does_not_know_is_not_corrected() -> None:
    here = np.ones((2, 3))
    unknown = np.full((2, 3), np.nan)
    found = difference({"push": record(unknown)}, {"push": record(here)}, {})
    assert found.added_to("push", {MOTION: here})[MOTION] == pytest.approx(here)


def test_the_motion_lost_under_a_payload_is_multiplied() -> None:
    loaded = Channel("loaded_motion", "output")
    motion = np.array([[0.5, 0.0, 0.0], [1.0, 0.1, 0.0]])
    here = StrokeRecord(FRACTIONS, {MOTION: motion, loaded: np.array([[0.8, 0.1, 0.0]])}, {})
    better = StrokeRecord(
        FRACTIONS, {MOTION: 1.1 * motion, loaded: np.array([[0.3, 0.2, 0.0]])}, {}
    )
    found = difference({"push": better}, {"push": here}, {})
    after = found.added_to("push", here.channels)
    assert after[MOTION] == pytest.approx(1.1 * motion)
    assert after[loaded] == pytest.approx(np.array([[0.3, 0.2, 0.0]]))
    # A stiffer geometry, whose payload takes half as much in one model, and so in the other.
    stiffer = {MOTION: motion, loaded: np.array([[0.9, 0.1, 0.0]])}
    assert found.added_to("push", stiffer)[loaded][0, 0] == pytest.approx(1.1 - 0.4)
    many = {each: np.repeat(value[None], 4, axis=0) for each, value in stiffer.items()}
    assert found.added_to("push", many)[loaded][:, 0, 0] == pytest.approx(0.7)
    assert stiffer[loaded][0, 0] == 0.9


def test_models_on_other_branches_are_recognised() -> None:
    first = np.array([[0.5, 0.0, 0.0], [1.0, 0.1, 0.0]])
    assert on_same_path({"push": record(first)}, {"push": record(1.2 * first)})
    assert not on_same_path({"push": record(first)}, {"push": record(-0.2 * first)})
    assert not on_same_path({"push": record(first)}, {"push": record(first + np.nan)})


def test_items_must_be_met_in_every_model() -> None:
    design = unloaded_crane()
    wanted = design.problem.specification
    assert wanted is not None
    width = design.problem.section.width
    variables = variables_of(design, 0.3, (width, width))
    vector = np.zeros(variables.count)
    shift = np.zeros((16, 3))
    shift[:, 2] = 0.3
    other = Difference({wanted.case: {Channel("motion", wanted.output): shift}})
    one, both = (
        RowEvaluator(variables, design.mask, wanted.items, models=models).evaluate(vector)
        for models in ((NO_DIFFERENCE,), (NO_DIFFERENCE, other))
    )
    assert one is not None
    assert both is not None
    off_axis = [
        np.array([v for v, name in zip(rows.constraints, rows.names, strict=True)
                  if name.endswith("off_axis")])
        for rows in (one, both)
    ]  # fmt: skip
    assert len(off_axis[1]) == 2 * len(off_axis[0])
    assert off_axis[1][: len(off_axis[0])] == pytest.approx(off_axis[0])
    assert np.abs(off_axis[1][len(off_axis[0]) :] - off_axis[0]).min() > 0.01


@pytest.mark.slow
def test_a_refinement_meets_a_sheet_that_differs_from_frames() -> None:
    """The sheet is a frame whose output moves farther off its axis, by 20 % of the
    input."""
    calls = []

    def sheet(design: Design) -> Records:
        evaluator = SpecificationEvaluator(design.problem, 8)
        evaluator.evaluate(design.mask, VERIFICATION_INCREMENT)
        (case, found), *_ = evaluator.records.items()
        channel = next(each for each in found.channels if each.name == "motion")
        moved = found.channels[channel].copy()
        aside = np.sign(moved[-1, 2]) * 0.2 * design.problem.input.amount
        moved[:, 2] += aside * found.fractions
        calls.append(case)
        return {case: replace(found, channels={**found.channels, channel: moved})}

    found = refine_design(unloaded_crane(), RefinementSettings(steps=20), sheet=sheet)
    assert len(calls) > 1
    assert found.after.met
    assert all(item.met for item in found.after.items)
    assert all(item.met for item in found.after.sheet)


def test_the_given_design_is_kept_if_all_better_ones_are_on_other_paths_in_the_sheet() -> None:
    """The sheet is the frame for the given geometry, and not stable for others."""
    crane = gallery_design("machine", "crane")
    assert crane is not None
    given = crane.problem.lattice.positions
    calls = []

    def sheet(design: Design) -> Records | None:
        calls.append(design)
        if not np.array_equal(design.problem.lattice.positions, given):
            return None
        evaluator = SpecificationEvaluator(design.problem, 8)
        evaluator.evaluate(design.mask, VERIFICATION_INCREMENT)
        return evaluator.records

    found = refine_design(crane, RefinementSettings(steps=4, evaluations=20), sheet=sheet)
    assert len(calls) > 2
    assert found.design is crane
    assert not found.improved
    assert found.reason == "in the sheet, all better geometries are on other paths"
    assert found.after.is_near_sheet


def test_a_state_of_a_refinement_can_be_sent_to_another_process() -> None:
    found = refine_design(unloaded_crane(), RefinementSettings(steps=1))
    sent = pickle.loads(pickle.dumps(found))
    assert sent.design.problem.hash == found.design.problem.hash
    assert [each.item.name for each in sent.after.items] == [
        each.item.name for each in found.after.items
    ]
    assert not sent.design.problem.lattice.positions.flags.writeable
