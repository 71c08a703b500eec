"""What is predicted of each flip is one Newton step, and exact where the response is linear."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.stats import spearmanr

from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import find_problem

from .problems import arm_on, patch, random_masks
from .test_sensitivity import flipped, kind_of_flip, prop, reached, sparse_patch
from .twin import Twin, efficiency, free_coordinates, stiffness

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem


def hessian_of_rotation(problem: Problem, u: NDArray[np.float64], beam: int):
    """(2N, 2N) second derivative of the rotation of a beam: -(n t' + t n') / r^2."""
    a, b = problem.lattice.beams[beam]
    now = problem.lattice.positions + u
    along = now[b] - now[a]
    r = np.linalg.norm(along)
    n = along / r
    t = np.array([-n[1], n[0]])
    block = -(np.outer(n, t) + np.outer(t, n)) / r**2
    whole = np.zeros((u.size, u.size))
    for p, sign_p in ((a, -1.0), (b, 1.0)):
        for q, sign_q in ((a, -1.0), (b, 1.0)):
            whole[2 * p : 2 * p + 2, 2 * q : 2 * q + 2] = sign_p * sign_q * block
    return whole


def torques(problem: Problem, mask: NDArray[np.bool_], u: NDArray[np.float64]):
    """(M,) torque of the angular springs on each beam."""
    twin = Twin(problem, mask)
    ends = {frozenset(pair): beam for beam, pair in enumerate(problem.lattice.beams.tolist())}
    total = np.zeros(problem.lattice.beam_count)
    moments = 2 * problem.stiffness.angle * twin.angle_changes(u)
    for (node, first, second), moment in zip(twin.springs, moments, strict=True):
        total[ends[frozenset((int(node), int(second)))]] += moment
        total[ends[frozenset((int(node), int(first)))]] -= moment
    return total


def newton_step(problem: Problem, mask: NDArray[np.bool_], beam: int, u: NDArray[np.float64]):
    """One dense Newton step after a flip, the neighbours' torques in the stiffness as before."""
    other = flipped(mask, beam)
    free = free_coordinates(problem, reached(problem, mask | other))
    twin = Twin(problem, other)
    k = stiffness(twin, u, free)
    change = torques(problem, other, u) - torques(problem, mask, u)
    for neighbour in np.flatnonzero(other & mask):
        if abs(change[neighbour]) > 1e-14:
            hessian = hessian_of_rotation(problem, u, neighbour)
            k -= change[neighbour] * hessian[np.ix_(free, free)]
    load = np.zeros_like(u)
    if problem.input.drive == "force":
        load[problem.input.nodes] = problem.input.amount * problem.input.direction
    after = u.copy()
    after.ravel()[free] -= np.linalg.solve(k, (twin.gradient(u) - load).ravel()[free])
    return after


@pytest.mark.parametrize("share", [1.0, 0.8])
def test_the_prediction_is_one_newton_step(share: float) -> None:
    problem = patch()
    mask = problem.initial if share == 1.0 else random_masks(problem, share, 1, seed=3)[0]
    evaluator = SpringEvaluator(problem)
    response = evaluator.evaluate(mask)
    screening = evaluator.predict_flips(mask, np.arange(problem.lattice.beam_count))
    compared = 0
    for beam, predicted in enumerate(screening.change):
        ends = problem.lattice.beams[beam]
        if not reached(problem, mask)[ends].all() or "dead" in kind_of_flip(problem, mask, beam):
            continue
        after = newton_step(problem, mask, beam, response.displacement)
        expected = efficiency(problem, after) - response.efficiency
        # A part in a million of a removed beam stays, so that loose ends follow.
        assert predicted == pytest.approx(expected, abs=3e-5, rel=1e-3), beam
        compared += 1
    assert compared > 15


def with_small_input(problem: Problem) -> Problem:
    return replace(problem, input=replace(problem.input, amount=1e-5 * problem.input.amount))


def predicted_and_gained(problem: Problem, mask: NDArray[np.bool_], unloaded_beams: str):
    """(beam, predicted, gained) of each flip that leaves a design with a response."""
    problem = with_small_input(problem)
    evaluator = SpringEvaluator(problem, unloaded_beams=unloaded_beams)
    before = evaluator.evaluate(mask).efficiency
    screening = evaluator.predict_flips(mask, np.arange(problem.lattice.beam_count))
    for beam, predicted in enumerate(screening.change):
        after = evaluator.evaluate(flipped(mask, beam))
        if after.status is Status.CONVERGED:
            yield beam, predicted, after.efficiency - before


def test_predictions_are_exact_for_small_strokes() -> None:
    problem, mask = sparse_patch()
    kinds = set()
    for beam, predicted, gained in predicted_and_gained(problem, mask, "keep"):
        kinds.add(kind_of_flip(problem, mask, beam))
        assert predicted == pytest.approx(gained, abs=1e-5, rel=1e-4), beam
    assert kinds == {"present", "absent", "present dead end", "absent dead end"}


def test_predictions_are_exact_for_small_forces() -> None:
    problem = patch(force=True)
    mask = random_masks(problem, 0.9, 1)[0]
    compared = [
        (predicted, gained)
        for beam, predicted, gained in predicted_and_gained(problem, mask, "keep")
        if kind_of_flip(problem, mask, beam) in ("present", "absent")
    ]
    assert len(compared) > 20
    for predicted, gained in compared:
        assert predicted == pytest.approx(gained, abs=1e-5, rel=1e-4)


def test_dead_ends_are_foreseen_to_change_nothing_where_they_do_not_count() -> None:
    problem, mask = sparse_patch()
    dead = 0
    for beam, predicted, gained in predicted_and_gained(problem, mask, "prune_dead_ends"):
        if kind_of_flip(problem, mask, beam).endswith("dead end"):
            dead += 1
            assert predicted == gained == 0.0
    assert dead > 3


def test_a_beam_to_a_support_of_its_own_is_foreseen() -> None:
    problem = prop()
    problem = replace(problem, input=replace(problem.input, amount=1e-6))
    mask = np.array([True, True, True, False])
    evaluator = SpringEvaluator(problem)
    before = evaluator.evaluate(mask).efficiency
    predicted = evaluator.predict_flips(mask, [3]).change[0]
    gained = evaluator.evaluate(problem.initial).efficiency - before
    assert predicted == pytest.approx(gained, rel=1e-3)


def test_strain_is_that_of_the_beam_and_of_the_gap() -> None:
    problem = patch()
    mask = random_masks(problem, 0.8, 1, seed=3)[0]
    evaluator = SpringEvaluator(problem)
    moved = problem.lattice.positions + evaluator.evaluate(mask).displacement
    screening = evaluator.predict_flips(mask)
    a, b = problem.lattice.beams[screening.beams].T
    length = np.linalg.norm(moved[b] - moved[a], axis=1)
    expected = length / problem.lattice.rest_length[screening.beams] - 1
    assert screening.strain == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("share", "least"), [(1.0, 0.97), (0.9, 0.8)])
def test_predictions_rank_the_flips_of_the_crane(share: float, least: float) -> None:
    crane = find_problem("crane")
    mask = crane.initial if share == 1.0 else random_masks(crane, share, 1, seed=1)[0]
    evaluator = SpringEvaluator(crane)
    before = evaluator.evaluate(mask).efficiency
    screening, slope = evaluator.predict_flips(mask), evaluator.sensitivity(mask)[crane.designable]
    gained = [evaluator.evaluate(flipped(mask, b)).efficiency - before for b in screening.beams]
    predicted = spearmanr(screening.change, gained).statistic
    assert predicted > least
    assert predicted > spearmanr(slope, gained).statistic


def test_an_unstable_design_has_no_predictions() -> None:
    problem = arm_on(fixed=[0])
    evaluator = SpringEvaluator(problem)
    assert evaluator.evaluate(problem.initial).status is Status.MECHANISM
    assert evaluator.predict_flips(problem.initial) is None
