"""Curves of searches that ran under an earlier server."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.model import ObjectiveTerm
from bellcrank.search import SpecificationEvaluator, read_settings
from bellcrank.search.scores import SCORE_COLUMNS, recorded_scores
from bellcrank.task import find_task
from bellcrank.web.curves import read_curves
from bellcrank.workflows import complete_design, start_design

if TYPE_CHECKING:
    from pathlib import Path


def test_the_curve_of_a_task_is_that_of_its_objective(tmp_path: Path) -> None:
    """It was that of the motion, whatever the task maximises."""
    task = find_task("straight-crane")
    assert task is not None
    wanted = task.problem.specification
    assert wanted is not None
    turned = ObjectiveTerm(quantity="rotation", case=wanted.case, output=wanted.output)
    own = replace(wanted, items=(), maximise=(turned,), tolerances=None)
    problem = replace(task.problem, specification=own)
    settings = read_settings({"search": "basin-hopping", "chains": 1, "steps": 60})
    folder = start_design(problem, settings, tmp_path / "run", refine=False)
    assert complete_design(folder, workers=1) is not None
    records = folder.read(0, ["mask", *SCORE_COLUMNS])
    scores = recorded_scores(records, settings, problem)
    best = int(np.nanargmax(scores))
    evaluator = SpecificationEvaluator(problem)
    bits = np.unpackbits(records["mask"][best], count=problem.lattice.beam_count).astype(bool)
    response = evaluator.evaluate(bits)
    score = response.efficiency - response.penalty
    assert scores[best] == pytest.approx(score, rel=1e-6)
    assert abs(score - response.efficiency) > 1.0
    (curve,) = read_curves(folder).values()
    assert curve[-1][2] == pytest.approx(score, abs=1e-5)
    assert np.isnan(scores[~records["accepted"]]).all()
