"""Responses of the shared reference problems, from an independent implementation.

The files lie beside the repository, not in it; without them these tests are skipped.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import Problem, read_problem, unpack_mask

REFERENCE = Path(__file__).parents[3] / "shared" / "reference"
SAME_EFFICIENCY = 1e-6
SAME_ENERGY = 1e-8


def names() -> list[str]:
    found = sorted(path.name.split(".")[0] for path in REFERENCE.glob("*.problem.json"))
    absent = pytest.param("any", marks=pytest.mark.skip(f"no reference problems at {REFERENCE}"))
    return found or [absent]


@cache
def load(name: str) -> tuple[Problem, list[dict[str, Any]]]:
    if not (REFERENCE / f"{name}.problem.json").is_file():
        pytest.skip(f"no reference problem {name} at {REFERENCE}")
    text = (REFERENCE / f"{name}.results.json").read_text()
    return read_problem(REFERENCE / f"{name}.problem.json"), json.loads(text)["results"]


def check(evaluator: SpringEvaluator, line: dict[str, Any]) -> None:
    mask = unpack_mask(line["mask"], evaluator.problem.lattice.beam_count)
    response = evaluator.evaluate(mask)
    if line.get("snaps"):
        assert response.status is Status.SNAPPED
        return
    assert response.status is Status.CONVERGED
    assert response.efficiency == pytest.approx(line["efficiency"], abs=SAME_EFFICIENCY)
    assert response.energy == pytest.approx(line["energy"], abs=SAME_ENERGY)
    moved = response.displacement[evaluator.problem.output.nodes]
    np.testing.assert_allclose(moved, line["output_displacements"], rtol=0, atol=1e-5)


@pytest.mark.parametrize("name", names())
def test_newton_agrees_with_every_reference_response(name: str) -> None:
    problem, lines = load(name)
    evaluator = SpringEvaluator(problem)
    for line in lines:
        check(evaluator, line)


def test_the_reference_design_that_snaps_is_recognised() -> None:
    problem, lines = load("crane")
    snapping = [line for line in lines if line.get("snaps")]
    assert len(snapping) == 1
    check(SpringEvaluator(problem), snapping[0])


def test_the_snapping_design_snaps_however_finely_it_is_loaded() -> None:
    problem, lines = load("crane")
    mask = unpack_mask(lines[-1]["mask"], problem.lattice.beam_count)
    evaluator = SpringEvaluator(problem)
    for increment in (1.0, 1 / 16, 1 / 100, 1 / 1000):
        assert evaluator.evaluate(mask, increment).status is Status.SNAPPED


def test_no_other_reference_design_is_flagged_at_fine_increments() -> None:
    for name in ("crane", "scaling8", "discs1000", "crane_force"):
        problem, lines = load(name)
        evaluator = SpringEvaluator(problem)
        for line in lines:
            mask = unpack_mask(line["mask"], problem.lattice.beam_count)
            fine = evaluator.evaluate(mask, 1 / 50)
            assert (fine.status is Status.SNAPPED) == bool(line.get("snaps"))
