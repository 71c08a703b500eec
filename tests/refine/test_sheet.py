"""Refinement with a second model in the place of the sheet."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bellcrank.mechanics import VERIFICATION_INCREMENT
from bellcrank.model import Design, Item
from bellcrank.refine import RefinementSettings, refine_design
from bellcrank.refine.by_sheet import SHEET_RESERVE
from bellcrank.search import SpecificationEvaluator

from .designs import unloaded_crane

if TYPE_CHECKING:
    from bellcrank.refine.differences import Records

HALF = 0.02
"""Half of the range of the gain, over its mean."""
LARGER = 1.018
"""Gain of the second model over that of frames."""


def wanted_gain(design: Design) -> tuple[Design, float]:
    """Return a design whose only item is a gain of about the present one."""
    problem = design.problem
    wanted = problem.specification
    assert wanted is not None
    evaluator = SpecificationEvaluator(problem)
    gain = evaluator.evaluate(design.mask, VERIFICATION_INCREMENT).efficiency
    item = Item(
        quantity="gain", case=wanted.case, output=wanted.output,
        at_least=(1.0 - HALF) * gain, at_most=(1.0 + HALF) * gain,
    )  # fmt: skip
    own = replace(wanted, items=(item,), maximise=(), weight=None)
    return replace(design, problem=replace(problem, specification=own)), gain


def second_model(design: Design) -> Records:
    """Return the channels of frames with a larger motion."""
    evaluator = SpecificationEvaluator(design.problem, 8)
    evaluator.evaluate(design.mask, VERIFICATION_INCREMENT)
    return {
        name: replace(
            record,
            channels={
                channel: LARGER * values if channel.name == "motion" else values
                for channel, values in record.channels.items()
            },
        )
        for name, record in evaluator.records.items()
    }


def test_a_gain_with_two_bounds_keeps_a_reserve_in_the_second_model() -> None:
    """At first its gain is 1.8 % above the mean, within the bounds and not within the reserve."""
    design, gain = wanted_gain(unloaded_crane())
    found = refine_design(design, RefinementSettings(evaluations=60), sheet=second_model)
    (item,) = found.after.sheet
    assert found.sheets > 1
    assert found.after.met
    assert abs(item.value / gain - 1.0) <= (1.0 - 4.0 * SHEET_RESERVE) * HALF + 1e-9
