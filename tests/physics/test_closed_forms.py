"""Structures simple enough to be solved on paper."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import Problem, Supports

from .problems import frame, patch, random_masks
from .twin import Twin, efficiency, free_coordinates, solve, stiffness

K = 5.0
SMALL = 1e-4


def respond(problem: Problem, **options: str):
    return SpringEvaluator(problem, **options).evaluate(problem.initial)


def test_two_beams_in_line_share_the_stretch() -> None:
    pulled = frame(
        [(0, 0), (1, 0), (2, 0)],
        [(0, 1), (1, 2)],
        fixed=[0],
        drive=(2, (1.0, 0.0), 0.1),
        watch=(1, (1.0, 0.0)),
    )
    response = respond(pulled)
    assert response.efficiency == pytest.approx(0.5, abs=1e-9)
    assert response.energy == pytest.approx(2 * K * 0.05**2, abs=1e-12)


def test_beams_in_line_under_a_force_stretch_by_force_over_twice_the_stiffness() -> None:
    force = 0.2
    pulled = frame(
        [(0, 0), (1, 0), (2, 0), (3, 0)],
        [(0, 1), (1, 2), (2, 3)],
        fixed=[0],
        fixed_y=[1],
        drive=(3, (1.0, 0.0), force),
        watch=(2, (1.0, 0.0)),
        force=True,
    )
    response = respond(pulled)
    expected = force / (2 * K) * np.arange(4)
    np.testing.assert_allclose(response.displacement[:, 0], expected, atol=1e-10)
    assert response.efficiency == pytest.approx(2 / 3, abs=1e-9)


def cantilever(*, dead_end: bool) -> Problem:
    """A clamped chain of beams bent at its end, perhaps with a loose beam on its free joint.

    With c lambda the stiffness of that joint and v its deflection, the energy is
    2 lambda v^2 + c lambda (delta - 2 v)^2, least at v = c delta / (1 + 2 c).
    """
    positions = [(0, 0), (1, 0), (2, 0), (3, 0)]
    beams = [(0, 1), (1, 2), (2, 3)]
    if dead_end:
        positions.append((2, 1))
        beams.append((2, 4))
    return frame(
        positions,
        beams,
        fixed=[0, 1],
        drive=(3, (0.0, 1.0), SMALL),
        watch=(2, (0.0, 1.0)),
    )


def test_a_joint_of_two_beams_bends_with_both_its_springs() -> None:
    assert respond(cantilever(dead_end=False)).efficiency == pytest.approx(2 / 5, abs=1e-6)


def test_a_dead_end_splits_one_spring_into_two_in_series() -> None:
    joint = 1 + 1 / 2
    expected = joint / (1 + 2 * joint)
    assert respond(cantilever(dead_end=True)).efficiency == pytest.approx(expected, abs=1e-6)


def test_an_ignored_dead_end_does_not_soften_its_joint() -> None:
    response = respond(cantilever(dead_end=True), unloaded_beams="prune_dead_ends")
    assert response.efficiency == pytest.approx(2 / 5, abs=1e-6)


def test_a_lever_turns_about_its_hinge() -> None:
    # A stiff triangle, hinged at one corner: lifting one arm lifts the other by its length.
    lever = frame(
        [(0, 0), (-1, 0), (0.5, 0.0), (0, 0.8)],
        [(0, 1), (0, 2), (1, 3), (2, 3), (0, 3)],
        fixed=[0],
        drive=(2, (0.0, -1.0), SMALL),
        watch=(1, (0.0, 1.0)),
    )
    assert respond(lever).efficiency == pytest.approx(2.0, abs=1e-3)


@pytest.mark.parametrize("amount", [1e-4, 1e-5])
def test_small_strokes_give_the_linear_response(amount: float) -> None:
    problem = patch()
    problem = replace(problem, input=replace(problem.input, amount=amount))
    everywhere = np.ones(problem.lattice.node_count, dtype=bool)
    free = free_coordinates(problem, everywhere)
    held = np.setdiff1d(np.arange(2 * len(everywhere)), free)
    for mask in random_masks(problem, 1.0, 1) + random_masks(problem, 0.95, 3):
        u = np.zeros_like(problem.lattice.positions)
        full = stiffness(Twin(problem, mask), u, np.arange(u.size))
        u[problem.input.nodes] = amount * problem.input.direction
        coupling = full[np.ix_(free, held)] @ u.ravel()[held]
        u.ravel()[free] = -np.linalg.solve(full[np.ix_(free, free)], coupling)
        found = SpringEvaluator(problem).evaluate(mask)
        assert abs(found.efficiency - efficiency(problem, u)) < 20 * amount


def on_rollers() -> Problem:
    return replace(patch(), supports=Supports(fixed=[0, 1], fixed_x=[4, 8], fixed_y=[2, 3]))


@pytest.mark.parametrize(
    "problem",
    [patch(), on_rollers(), patch(force=True), patch(force=True, kind="isotropic")],
    ids=["displacement", "rollers", "directional spring", "isotropic spring"],
)
def test_large_strokes_give_the_equilibrium_that_a_dense_newton_finds(problem: Problem) -> None:
    evaluator = SpringEvaluator(problem, "displacement")
    for mask in [problem.initial, *random_masks(problem, 0.9, 4)]:
        found = evaluator.evaluate(mask)
        if found.status is not Status.CONVERGED:
            continue
        u = solve(Twin(problem, mask), evaluator.structure.active == 1)
        np.testing.assert_allclose(found.displacement, u, rtol=0, atol=1e-9)
        assert found.efficiency == pytest.approx(efficiency(problem, u), abs=1e-8)


def test_rollers_hold_exactly_what_they_hold() -> None:
    problem = on_rollers()
    for mask in random_masks(problem, 0.9, 4):
        u = SpringEvaluator(problem).evaluate(mask).displacement
        assert (u[problem.supports.fixed] == 0.0).all()
        assert (u[problem.supports.fixed_x, 0] == 0.0).all()
        assert (u[problem.supports.fixed_y, 1] == 0.0).all()
        assert (u[problem.supports.fixed_x, 1] != 0.0).all()
        assert (u[problem.supports.fixed_y, 0] != 0.0).any()


def test_the_two_kinds_of_output_spring_differ_across_the_wanted_direction() -> None:
    along, anyway = patch(force=True), patch(force=True, kind="isotropic")
    directional, isotropic = respond(along), respond(anyway)
    assert abs(directional.efficiency - isotropic.efficiency) > 1e-4
    across = abs(isotropic.displacement[13, 1])
    assert across < abs(directional.displacement[13, 1])
