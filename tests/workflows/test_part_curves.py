"""Curves of a part along its stroke."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bellcrank.model import human_design
from bellcrank.part import PartSpec, frame_problem
from bellcrank.workflows.part_figures import STATES, part_figures


def test_the_curves_of_a_part_begin_at_rest_and_end_with_its_figures() -> None:
    spec, design = PartSpec(), human_design("crane")
    assert design is not None
    design = replace(design, problem=frame_problem(design.problem, spec))
    (row,) = part_figures(design, spec, elements=None)
    curve = row["curve"]
    assert {len(values) for values in curve.values()} == {STATES + 1}
    assert {values[0] for values in curve.values()} == {0.0}
    for name, figure in (
        ("input_mm", "input_mm"), ("output_mm", "travel_mm"), ("input_force_N", "input_force_N"),
    ):  # fmt: skip
        assert curve[name][-1] == pytest.approx(row[figure], rel=1e-4)
    assert max(map(abs, curve["rotation_deg"])) == pytest.approx(row["rotation_deg"], rel=1e-4)
    assert curve["input_mm"] == sorted(curve["input_mm"])
