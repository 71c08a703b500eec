"""The efficiency knows nothing of place, orientation, handedness or numbering."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import Lattice, Problem, Supports, find_problem

from .problems import patch, random_masks, with_lattice

if TYPE_CHECKING:
    from numpy.typing import NDArray

SAME = 1e-9
IDENTITY = np.eye(2)
MIRROR = np.diag([-1.0, 1.0])
TURN = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])


@pytest.fixture(
    scope="module",
    params=["crane", "scaling-8", "discs", "force", "isotropic"],
)
def problem(request: pytest.FixtureRequest) -> Problem:
    if request.param in ("crane", "scaling-8", "discs"):
        return find_problem(request.param)
    kind = "directional" if request.param == "force" else "isotropic"
    return patch(force=True, kind=kind)


def efficiencies(problem: Problem, masks: list[NDArray[np.bool_]]) -> NDArray[np.float64]:
    evaluator = SpringEvaluator(problem)
    return np.array([evaluator.evaluate(mask).efficiency for mask in masks])


def designs(problem: Problem) -> list[NDArray[np.bool_]]:
    return [problem.initial, *random_masks(problem, 0.8, 3), *random_masks(problem, 0.65, 3, 1)]


def moved(problem: Problem, matrix: NDArray[np.float64], shift: tuple[float, float]) -> Problem:
    return with_lattice(problem, problem.lattice.positions @ matrix.T + shift, matrix)


@pytest.mark.parametrize(
    ("matrix", "shift"),
    [(IDENTITY, (12.25, -3.5)), (TURN, (0.0, 0.0)), (MIRROR, (0.0, 0.0)), (TURN @ MIRROR, (1, 2))],
    ids=["translation", "rotation", "mirror", "glide"],
)
def test_efficiency_survives_a_motion_of_the_whole_problem(
    problem: Problem, matrix: NDArray[np.float64], shift: tuple[float, float]
) -> None:
    masks = designs(problem)
    found = efficiencies(moved(problem, matrix, shift), masks)
    np.testing.assert_allclose(found, efficiencies(problem, masks), rtol=0, atol=SAME)


def relabelled(
    problem: Problem, rng: np.random.Generator
) -> tuple[Problem, NDArray[np.int64], NDArray[np.int64]]:
    """The same problem with nodes and beams numbered, and beams pointing, at random.

    Also returns the new number of each node and the old number of each beam.
    """
    lattice = problem.lattice
    old_node = rng.permutation(lattice.node_count)
    new_node = np.argsort(old_node)
    old_beam = rng.permutation(lattice.beam_count)
    beams = new_node[lattice.beams[old_beam]]
    turned = rng.random(len(beams)) < 0.5
    beams[turned] = beams[turned, ::-1]
    again = replace(
        problem,
        lattice=Lattice(lattice.positions[old_node], beams),
        supports=Supports(new_node[problem.supports.fixed]),
        input=replace(problem.input, nodes=new_node[problem.input.nodes]),
        output=replace(problem.output, nodes=new_node[problem.output.nodes]),
        initial=problem.initial[old_beam],
        designable=np.flatnonzero(np.isin(old_beam, problem.designable)),
    )
    return again, new_node, old_beam


def test_efficiency_survives_new_numbers_of_nodes_and_beams(problem: Problem) -> None:
    again, _, old_beam = relabelled(problem, np.random.default_rng(3))
    masks = designs(problem)
    found = efficiencies(again, [mask[old_beam] for mask in masks])
    np.testing.assert_allclose(found, efficiencies(problem, masks), rtol=0, atol=SAME)


def test_displacements_turn_with_the_problem() -> None:
    problem = find_problem("scaling-8")
    mask = random_masks(problem, 0.8, 1)[0]
    straight = SpringEvaluator(problem).evaluate(mask).displacement
    turned = SpringEvaluator(moved(problem, TURN, (0.0, 0.0))).evaluate(mask).displacement
    np.testing.assert_allclose(turned, straight @ TURN.T, rtol=0, atol=1e-10)


def test_sensitivity_survives_new_numbers_of_nodes_and_beams() -> None:
    problem = patch()
    again, _, old_beam = relabelled(problem, np.random.default_rng(4))
    mask = random_masks(problem, 0.8, 1)[0]
    straight = SpringEvaluator(problem).sensitivity(mask)
    found = SpringEvaluator(again).sensitivity(mask[old_beam])
    np.testing.assert_allclose(found, straight[old_beam], rtol=0, atol=1e-7)
