"""Loss of stability along the stroke is recognised, and only that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import Problem, Stiffness, gallery_design, human_design

from .problems import frame

K = 5.0


def column(shortening: float, joint: float = 0.1) -> Problem:
    """A perfectly straight, clamped chain of beams, compressed at its end.

    Two beams of length r = 1 - a/2 are free to buckle at the joint between them. Moving
    it by v costs 10 lambda (v/r)^2 in the joints and gains 2 k (1/r - 1) v^2.
    """
    problem = frame(
        [(0, 0), (1, 0), (2, 0), (3, 0)],
        [(0, 1), (1, 2), (2, 3)],
        fixed=[0, 1],
        drive=(3, (-1.0, 0.0), shortening),
        watch=(2, (0.0, 1.0)),
    )
    return replace(problem, stiffness=Stiffness(K, joint))


def buckling_shortening(joint: float) -> float:
    return float(brentq(lambda a: K * (1 - a / 2) * (a / 2) - 5 * joint, 0.0, 1.0))


@pytest.mark.parametrize("joint", [0.05, 0.1])
def test_a_perfect_column_buckles_at_its_critical_load(joint: float) -> None:
    critical = buckling_shortening(joint)
    assert status(column(0.97 * critical, joint)) is Status.CONVERGED
    assert status(column(1.03 * critical, joint)) is Status.SNAPPED


def status(problem: Problem) -> Status:
    return SpringEvaluator(problem).evaluate(problem.initial).status


def test_a_buckled_column_ends_in_a_stable_state_off_the_axis() -> None:
    problem = column(1.15 * buckling_shortening(0.1))
    response = SpringEvaluator(problem).evaluate(problem.initial)
    assert abs(response.displacement[2, 1]) > 0.05
    straight = 2 * K * (problem.input.amount / 2) ** 2
    assert response.energy < straight


def test_a_stiff_column_is_not_flagged() -> None:
    response = SpringEvaluator(column(0.4, joint=1.0)).evaluate(np.ones(3, dtype=bool))
    assert response.status is Status.CONVERGED
    assert response.displacement[2, 1] == 0.0


HEIGHT = 0.3
SOFT = 1e-4


def truss(force: float, height: float = HEIGHT, joint: float = SOFT) -> Problem:
    """A shallow von Mises truss: two beams in a flat roof, its ridge pulled down by a stem."""
    problem = frame(
        [(-1, 0), (0, height), (1, 0), (0, height - 1)],
        [(0, 1), (1, 2), (1, 3)],
        fixed=[0, 2],
        drive=(3, (0.0, -1.0), force),
        watch=(1, (0.0, -1.0)),
        force=True,
    )
    return replace(problem, stiffness=Stiffness(K, joint))


def limit_load(height: float) -> float:
    """Largest force that the pin-jointed truss can resist on its way down."""
    rest = np.hypot(1.0, height)

    def negative_force(depth: float) -> float:
        length = np.hypot(1.0, height - depth)
        return -float(4 * K * (rest - length) * (height - depth) / length)

    return -float(minimize_scalar(negative_force, bounds=(0.0, height), method="bounded").fun)


@pytest.mark.parametrize("height", [0.2, 0.3, 0.4])
def test_a_shallow_truss_snaps_through_at_its_limit_load(height: float) -> None:
    limit = limit_load(height)
    assert status(truss(0.8 * limit, height)) is Status.CONVERGED
    assert status(truss(1.2 * limit, height)) is Status.SNAPPED


def test_a_truss_that_snapped_hangs_below_its_supports() -> None:
    snapped = truss(1.2 * limit_load(HEIGHT))
    response = SpringEvaluator(snapped).evaluate(snapped.initial)
    assert HEIGHT + response.displacement[1, 1] < -0.3


def test_a_truss_that_hangs_from_the_start_does_not_snap() -> None:
    hanging = truss(1.2 * limit_load(HEIGHT), height=-HEIGHT)
    assert status(hanging) is Status.CONVERGED


def test_a_truss_with_stiff_joints_does_not_snap() -> None:
    stiff = truss(1.2 * limit_load(HEIGHT), joint=5.0)
    assert status(stiff) is Status.CONVERGED


def test_finer_increments_do_not_change_the_verdict() -> None:
    for problem in (column(0.2), column(0.26), truss(0.8 * limit_load(HEIGHT)), truss(0.2)):
        evaluator = SpringEvaluator(problem)
        coarse = evaluator.evaluate(problem.initial)
        fine = evaluator.evaluate(problem.initial, largest_increment=1 / 200)
        assert coarse.status is fine.status
        if coarse.status is Status.CONVERGED:
            assert coarse.efficiency == pytest.approx(fine.efficiency, abs=1e-8)


def test_sensitivity_is_defined_on_either_side_of_a_snap() -> None:
    problem = truss(1.2 * limit_load(HEIGHT))
    assert np.isfinite(SpringEvaluator(problem).sensitivity(problem.initial)).all()


@pytest.mark.parametrize("parts", [20, 24, 28, 30, 32, 48])
def test_any_increment_leads_to_the_full_stroke(parts: int) -> None:
    design = human_design("crane")
    assert design is not None
    response = SpringEvaluator(design.problem).evaluate(design.mask, 1.0 / parts)
    assert response.status is Status.CONVERGED


@pytest.mark.parametrize("name", ["pliers", "crane", "discs"])
def test_soft_designs_reach_the_full_load_in_fine_increments(name: str) -> None:
    design = gallery_design("machine", name)
    assert design is not None
    for parts in (24, 32):
        response = SpringEvaluator(design.problem).evaluate(design.mask, 1.0 / parts)
        assert response.status is Status.CONVERGED
