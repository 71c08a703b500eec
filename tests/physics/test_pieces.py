"""What moves, what stays, what hangs and what cannot be held."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import Problem, find_problem

from .problems import arm_on, frame, patch, random_masks

if TYPE_CHECKING:
    from numpy.typing import NDArray


def connected_to(
    problem: Problem, mask: NDArray[np.bool_], nodes: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """(N,) whether present beams join a node to one of `nodes`."""
    reached = np.zeros(problem.lattice.node_count, dtype=bool)
    reached[nodes] = True
    for _ in range(problem.lattice.node_count):
        for a, b in problem.lattice.beams[mask]:
            reached[a] = reached[b] = reached[a] or reached[b]
    return reached


def springs_of(problem: Problem, mask: NDArray[np.bool_]) -> dict[tuple[int, int, int], float]:
    """Weight of each angular spring by node and beams, in units of lambda."""
    evaluator = SpringEvaluator(problem)
    structure = evaluator.structure
    evaluator.evaluate(mask)
    front, back = structure.sizes[3:5]
    listed = [*range(front), *range(back, len(structure.spring_node))]
    return {
        (int(structure.spring_node[s]), *sorted(structure.spring_beams[s].tolist())): float(
            structure.spring_weight[s] / problem.stiffness.angle
        )
        for s in listed
    }


def star() -> Problem:
    """Four beams around node 0, all held at their far ends but one."""
    return frame(
        [(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1)],
        [(0, 1), (0, 2), (0, 3), (0, 4)],
        fixed=[2, 3],
        drive=(1, (0.0, 1.0), 0.1),
        watch=(4, (1.0, 0.0)),
    )


def test_a_node_has_a_spring_for_each_pair_of_neighbouring_beams() -> None:
    all_four = springs_of(star(), np.array([True, True, True, True]))
    assert all_four == {(0, 0, 1): 1.0, (0, 1, 2): 1.0, (0, 2, 3): 1.0, (0, 0, 3): 1.0}


def test_removing_a_beam_merges_its_two_springs() -> None:
    three = springs_of(star(), np.array([True, False, True, True]))
    assert three == {(0, 0, 2): 1.0, (0, 2, 3): 1.0, (0, 0, 3): 1.0}


def test_two_beams_have_a_spring_on_either_side() -> None:
    assert springs_of(star(), np.array([True, False, True, False])) == {(0, 0, 2): 2.0}


def test_one_beam_has_no_spring() -> None:
    assert springs_of(star(), np.array([True, False, False, False])) == {}


def test_removing_and_adding_a_beam_again_restores_the_response_exactly() -> None:
    evaluator = SpringEvaluator(find_problem("scaling-8"))
    mask = random_masks(evaluator.problem, 0.9, 1)[0]
    before = evaluator.evaluate(mask)
    for beam in evaluator.problem.designable[::20]:
        other = mask.copy()
        other[beam] ^= True
        evaluator.evaluate(other)
        after = evaluator.evaluate(mask)
        assert after.efficiency == before.efficiency
        assert after.energy == before.energy
        assert (after.displacement == before.displacement).all()


@pytest.mark.parametrize("name", ["crane", "scaling-8", "discs", "pliers"])
@pytest.mark.parametrize("share", [0.3, 0.5])
def test_what_the_drive_cannot_reach_stays_exactly_at_rest(name: str, share: float) -> None:
    evaluator = SpringEvaluator(find_problem(name))
    problem = evaluator.problem
    for mask in random_masks(problem, share, 6):
        response = evaluator.evaluate(mask)
        reached = connected_to(problem, mask, problem.input.nodes)
        if response.status is not Status.MECHANISM:
            assert not reached.all()
            assert (response.displacement[~reached] == 0.0).all()


def test_a_loose_output_means_efficiency_exactly_zero() -> None:
    evaluator = SpringEvaluator(find_problem("crane"))
    problem = evaluator.problem
    cut = problem.initial.copy()
    x = problem.lattice.positions[problem.lattice.beams[:, :], 0]
    cut[problem.designable] = ~((x[problem.designable] < 3.5).any(axis=1))
    assert not connected_to(problem, cut, problem.input.nodes)[problem.output.nodes].any()
    evaluator.evaluate(problem.initial)
    evaluator.set_reference()
    for response in (evaluator.evaluate(cut), evaluator.evaluate(cut, warm_start=True)):
        assert response.status is Status.CONVERGED
        assert response.efficiency == 0.0
        assert (response.displacement[problem.output.nodes] == 0.0).all()


def hanging_chain() -> tuple[Problem, NDArray[np.bool_]]:
    """The top row of a patch, hanging from the input at its right end, cut off from the rest."""
    problem = patch()
    y = problem.lattice.positions[:, 1][problem.lattice.beams]
    return problem, (y > y.max() - 0.1).all(axis=1)


def test_a_piece_that_hangs_from_one_moved_node_follows_as_a_rigid_body() -> None:
    problem, mask = hanging_chain()
    response = SpringEvaluator(problem).evaluate(mask)
    assert response.status is Status.CONVERGED
    assert response.energy == pytest.approx(0.0, abs=1e-25)
    piece = np.arange(13, 18)
    rest = problem.lattice.positions[piece]
    moved = rest + response.displacement[piece]

    def distances(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.linalg.norm(points[:, None] - points[None], axis=2)

    np.testing.assert_allclose(distances(moved), distances(rest), rtol=0, atol=1e-14)
    assert response.displacement[17].tolist() == [0.0, -0.2]


def test_a_hanging_piece_takes_the_place_nearest_to_rest() -> None:
    problem, mask = hanging_chain()
    piece = np.arange(13, 17)
    u = SpringEvaluator(problem).evaluate(mask).displacement
    rest = problem.lattice.positions
    arm = (rest + u)[piece] - (rest + u)[17]

    def distance_to_rest(angle: float) -> float:
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        return float((((rest + u)[17] + arm @ turn.T - rest[piece]) ** 2).sum())

    assert distance_to_rest(0.0) < min(distance_to_rest(1e-4), distance_to_rest(-1e-4))


def test_a_hanging_piece_is_reproducible_whatever_came_before() -> None:
    problem, mask = hanging_chain()
    evaluator = SpringEvaluator(problem)
    first = evaluator.evaluate(mask)
    for before in [problem.initial, *random_masks(problem, 0.7, 5)]:
        evaluator.evaluate(before)
        evaluator.set_reference()
        again = evaluator.evaluate(mask, warm_start=True)
        assert again.status is first.status
        assert again.efficiency == first.efficiency
        assert (again.displacement == first.displacement).all()


def test_a_forced_piece_without_support_is_a_mechanism() -> None:
    problem = patch(force=True)
    problem = replace(problem, output=replace(problem.output, spring=None, spring_kind=None))
    _, loose = hanging_chain()
    evaluator = SpringEvaluator(problem)
    response = evaluator.evaluate(loose)
    assert response.status is Status.MECHANISM
    assert np.isnan(response.efficiency)
    assert evaluator.evaluate(problem.initial).status is Status.CONVERGED
    evaluator.set_reference()
    assert evaluator.evaluate(loose, warm_start=True).status is Status.MECHANISM


@pytest.mark.parametrize(
    ("supports", "status"),
    [
        ({"fixed": [0, 1]}, Status.CONVERGED),
        ({"fixed": [0]}, Status.MECHANISM),
        ({"fixed": [0], "fixed_y": [1]}, Status.CONVERGED),
        ({"fixed": [0], "fixed_x": [1]}, Status.MECHANISM),
        ({"fixed_x": [0], "fixed_y": [1]}, Status.MECHANISM),
        ({"fixed_y": [0, 1]}, Status.MECHANISM),
    ],
    ids=["clamped", "hinged", "hinge and roller", "useless roller", "one of each", "sliding"],
)
def test_a_forced_piece_needs_all_three_rigid_motions_held(
    supports: dict[str, list[int]], status: Status
) -> None:
    problem = arm_on(**supports)
    assert SpringEvaluator(problem).evaluate(problem.initial).status is status


def test_springs_at_the_output_hold_a_forced_piece_as_supports_do() -> None:
    clamped_by_spring = frame(
        [(0, 0), (1, 0), (2, 0)],
        [(0, 1), (1, 2)],
        fixed=[0],
        drive=(2, (0.0, 1.0), 1e-3),
        watch=(1, (0.0, 1.0)),
        force=True,
        spring=1.0,
    )
    response = SpringEvaluator(clamped_by_spring).evaluate(clamped_by_spring.initial)
    assert response.status is Status.CONVERGED
    assert response.displacement[1, 1] == pytest.approx(2e-3, rel=0.02)
