"""The compiled energy, gradient and stiffness equal those of the paper's formula."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import Problem, Supports, find_problem

from .compiled import assemble_stiffness, energy_and_gradient
from .problems import patch, random_masks
from .twin import Twin, free_coordinates, stiffness

if TYPE_CHECKING:
    from numpy.typing import NDArray

NAMES = ["patch", "force", "isotropic", "rollers", "scaling-8", "discs", "pliers"]


def make_problem(name: str) -> Problem:
    if name == "rollers":
        return replace(patch(), supports=Supports(fixed=[0, 1], fixed_x=[4, 8], fixed_y=[2, 3]))
    by_hand = {
        "patch": patch,
        "force": lambda: patch(force=True),
        "isotropic": lambda: patch(force=True, kind="isotropic"),
    }
    return by_hand[name]() if name in by_hand else find_problem(name)


def driven_designs(evaluator: SpringEvaluator, count: int) -> list[NDArray[np.bool_]]:
    """Random designs that are no mechanism, the full one among them."""
    masks = [evaluator.problem.initial]
    for share in (0.85, 0.7):
        masks += random_masks(evaluator.problem, share, count)
    return [m for m in masks if evaluator.evaluate(m).status is not Status.MECHANISM]


def random_displacement(evaluator: SpringEvaluator, seed: int) -> NDArray[np.float64]:
    """Small random motion of the free coordinates that the drive can reach, and of the input."""
    problem, structure = evaluator.problem, evaluator.structure
    free = free_coordinates(problem, structure.active == 1)
    rng = np.random.default_rng(seed)
    u = np.zeros(2 * problem.lattice.node_count)
    u[free] = rng.uniform(-0.1, 0.1, len(free))
    u = u.reshape(-1, 2)
    if problem.input.drive == "displacement":
        u[problem.input.nodes] = problem.input.amount * problem.input.direction
    return u


def kernel_energy(
    evaluator: SpringEvaluator, mask: NDArray[np.bool_], u: NDArray[np.float64]
) -> float:
    return energy_and_gradient(
        evaluator.system, mask.astype(np.uint8), u, evaluator.structure, evaluator.scratch
    )


def kernel_gradient(
    evaluator: SpringEvaluator, mask: NDArray[np.bool_], u: NDArray[np.float64]
) -> NDArray[np.float64]:
    kernel_energy(evaluator, mask, u)
    return evaluator.scratch.gradient.copy()


def kernel_stiffness(
    evaluator: SpringEvaluator, mask: NDArray[np.bool_], u: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Dense (2 N, 2 N) matrix from the blocks the kernel assembles."""
    system, structure, scratch = evaluator.system, evaluator.structure, evaluator.scratch
    assemble_stiffness(system, mask.astype(np.uint8), u, structure, scratch)
    nodes = len(u)
    dense = np.zeros((nodes, 2, nodes, 2))
    node_of = {int(block): node for node, block in enumerate(system.block) if block >= 0}
    for column, node in node_of.items():
        xx, xy, _, yy = scratch.diagonal[column]
        dense[node, :, node, :] = [[xx, xy], [xy, yy]]
        for entry in range(structure.column_start[column], structure.column_start[column + 1]):
            row = node_of[int(structure.row[entry])]
            block = scratch.off_diagonal[entry].reshape(2, 2)
            dense[row, :, node, :] = block
            dense[node, :, row, :] = block.T
    return dense.reshape(2 * nodes, 2 * nodes)


@pytest.mark.parametrize("name", NAMES)
def test_energy_equals_the_paper_s_formula(name: str) -> None:
    evaluator = SpringEvaluator(make_problem(name))
    for seed, mask in enumerate(driven_designs(evaluator, 4)):
        evaluator.evaluate(mask)
        u = random_displacement(evaluator, seed)
        expected = Twin(evaluator.problem, mask).energy(u)
        assert kernel_energy(evaluator, mask, u) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", ["patch", "isotropic", "force"])
def test_the_twin_s_gradient_is_the_derivative_of_its_energy(name: str) -> None:
    problem = make_problem(name)
    twin = Twin(problem, random_masks(problem, 0.8, 1)[0])
    u = np.random.default_rng(1).uniform(-0.1, 0.1, problem.lattice.positions.shape)
    for index in np.ndindex(u.shape):
        shift = np.zeros_like(u)
        shift[index] = 1e-6
        slope = (twin.energy(u + shift) - twin.energy(u - shift)) / 2e-6
        assert twin.gradient(u)[index] == pytest.approx(slope, abs=1e-8)


@pytest.mark.parametrize("name", NAMES)
def test_gradient_is_the_derivative_of_the_energy(name: str) -> None:
    evaluator = SpringEvaluator(make_problem(name))
    problem = evaluator.problem
    for seed, mask in enumerate(driven_designs(evaluator, 3)):
        evaluator.evaluate(mask)
        free = free_coordinates(problem, evaluator.structure.active == 1)
        u = random_displacement(evaluator, seed)
        expected = np.zeros(u.size)
        expected[free] = Twin(problem, mask).gradient(u).ravel()[free]
        found = kernel_gradient(evaluator, mask, u).ravel()
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["patch", "force", "isotropic", "rollers", "scaling-8"])
def test_stiffness_is_the_derivative_of_the_gradient(name: str) -> None:
    evaluator = SpringEvaluator(make_problem(name))
    problem = evaluator.problem
    for seed, mask in enumerate(driven_designs(evaluator, 2)):
        evaluator.evaluate(mask)
        free = free_coordinates(problem, evaluator.structure.active == 1)
        u = random_displacement(evaluator, seed)
        found = kernel_stiffness(evaluator, mask, u)[np.ix_(free, free)]
        np.testing.assert_allclose(
            found, stiffness(Twin(problem, mask), u, free), rtol=0, atol=2e-8
        )


def test_reported_energy_is_that_of_the_reported_displacement() -> None:
    for name in ("patch", "isotropic", "scaling-8"):
        evaluator = SpringEvaluator(make_problem(name))
        for mask in driven_designs(evaluator, 4):
            response = evaluator.evaluate(mask)
            twin = Twin(evaluator.problem, mask)
            assert response.energy == pytest.approx(twin.energy(response.displacement), abs=1e-13)


@pytest.mark.parametrize("name", ["patch", "force", "rollers", "scaling-8", "discs"])
def test_reported_equilibria_are_balanced_and_stable(name: str) -> None:
    evaluator = SpringEvaluator(make_problem(name))
    problem = evaluator.problem
    load = np.zeros_like(problem.lattice.positions)
    if problem.input.drive == "force":
        load[problem.input.nodes] = problem.input.amount * problem.input.direction
    for mask in driven_designs(evaluator, 3):
        response = evaluator.evaluate(mask)
        if response.status is not Status.CONVERGED:
            continue
        free = free_coordinates(problem, evaluator.structure.active == 1)
        twin = Twin(problem, mask)
        residual = (twin.gradient(response.displacement) - load).ravel()[free]
        assert np.abs(residual).max(initial=0.0) < 1e-9
        assert np.linalg.eigvalsh(stiffness(twin, response.displacement, free))[0] > 0.0
