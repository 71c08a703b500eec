"""Sensitivity and predicted flips of frames, in the plane and in space."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bellcrank.mechanics import FrameEvaluator
from bellcrank.mechanics.status import Status
from bellcrank.model import (
    Input,
    Lattice,
    Output,
    Problem,
    Section,
    Supports,
    find_problem,
    unpack_mask,
)
from bellcrank.part import PartSpec, frame_problem

FOUND = "fffffffffffffffffd2fffff88115b230010276e8ebede104abddc60c981afd7ec07ffbbfafffff57f9fff37"
"""A design of the crane, found by ``bellcrank design crane``."""


@cache
def actuator() -> Problem:
    return frame_problem(find_problem("scaling-8"), PartSpec())


@cache
def block() -> Problem:
    """Return a small cubic lattice with all diagonals, pushed at one corner."""
    positions = np.argwhere(np.ones((3, 3, 3))).astype(float)
    first, second = np.triu_indices(len(positions), 1)
    length = np.linalg.norm(positions[first] - positions[second], axis=1)
    near = (length < 1.5) & (length > 0.0)
    beams = np.stack([first, second], axis=1)[near]
    top, bottom = positions[:, 2] == 2.0, np.flatnonzero(positions[:, 2] == 0.0)
    corner = np.flatnonzero(top & (positions[:, 0] == 2.0) & (positions[:, 1] > 0.5))
    opposite = np.flatnonzero(top & (positions[:, 0] == 0.0) & (positions[:, 1] < 1.5))
    return Problem(
        name="block",
        lattice=Lattice(positions, beams),
        supports=Supports(fixed=bottom),
        input=Input(nodes=corner, direction=[0, 0, -1], drive="displacement", amount=0.1),
        output=Output(nodes=opposite, direction=[-1, 0, 0]),
        section=Section.round(0.2),
    )


def diluted(problem: Problem, removed: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    mask = problem.initial.copy()
    mask[rng.choice(problem.designable, removed, replace=False)] = False
    return mask


@pytest.mark.parametrize("problem", [actuator, block])
@pytest.mark.parametrize("elements", [None, 1])
def test_sensitivity_is_the_derivative_by_presence(problem, elements: int | None) -> None:
    """The efficiency with a beam of a part of its stiffness, by finite differences."""
    case = problem()
    evaluator = FrameEvaluator(case, elements=elements)
    mask = diluted(case, 20, 1)
    found = evaluator.sensitivity(mask)
    carrying = np.flatnonzero(evaluator.load_bearing(mask))
    chosen = np.random.default_rng(2).choice(np.intersect1d(carrying, case.designable), 5)
    full = evaluator.frame.section.copy()
    for beam in chosen:
        step, values = 1e-4, []
        for sign in (1.0, -1.0):
            evaluator.frame.section[beam] = full[beam] * (1.0 + sign * step)
            values.append(evaluator.evaluate(mask).efficiency)
        evaluator.frame.section[beam] = full[beam]
        derivative = (values[0] - values[1]) / (2.0 * step)
        assert -found[beam] == pytest.approx(derivative, rel=1e-5, abs=1e-8)


@pytest.mark.parametrize("problem", [actuator, block])
def test_predicted_flips_are_those_of_one_newton_step(problem) -> None:
    """Small changes of a soft structure are predicted exactly to first order, and ranked."""
    case = problem()
    evaluator = FrameEvaluator(case)
    mask = diluted(case, 25, 3)
    before = evaluator.evaluate(mask).efficiency
    prediction = evaluator.predict_flips(mask)
    assert prediction is not None
    other = FrameEvaluator(case)
    gained = np.full(len(prediction.beams), np.nan)
    for index, beam in enumerate(prediction.beams):
        flipped = mask.copy()
        flipped[beam] ^= True
        response = other.evaluate(flipped)
        if response.is_admissible:
            gained[index] = response.efficiency - before
    compared = np.isfinite(gained) & (prediction.change != 0.0)
    assert compared.sum() > 30
    rank = [np.argsort(np.argsort(each[compared])) for each in (prediction.change, gained)]
    assert np.corrcoef(rank[0], rank[1])[0, 1] > 0.9
    unchanged = np.isfinite(gained) & (prediction.change == 0.0)
    assert np.abs(gained[unchanged]).max(initial=0.0) < 1e-7


def test_flips_of_beams_without_load_change_nothing() -> None:
    case = actuator()
    evaluator = FrameEvaluator(case)
    mask = diluted(case, 60, 4)
    evaluator.evaluate(mask)
    idle = np.flatnonzero(mask & ~evaluator.load_bearing(mask))
    prediction = evaluator.predict_flips(mask, idle)
    assert prediction is not None
    assert len(idle)
    assert not prediction.change.any()


def test_a_warm_start_gives_the_response_from_rest() -> None:
    case = actuator()
    warm, cold = FrameEvaluator(case), FrameEvaluator(case)
    rng = np.random.default_rng(5)
    mask = case.initial.copy()
    warm.evaluate(mask)
    warm.set_reference()
    compared = 0
    for beam in rng.choice(case.designable, 150):
        flipped = mask.copy()
        flipped[beam] ^= True
        response, expected = warm.evaluate(flipped, warm_start=True), cold.evaluate(flipped)
        assert response.status == expected.status
        if response.is_admissible:
            assert response.efficiency == pytest.approx(expected.efficiency, abs=1e-8)
            compared += 1
            mask = flipped
            warm.set_reference()
    assert compared > 100


def test_a_flip_far_from_its_neighbour_has_no_path_in_a_search() -> None:
    """Without a bound it is loaded from rest, with one it is refused."""
    case = frame_problem(find_problem("crane"), PartSpec())
    design = unpack_mask(FOUND, case.lattice.beam_count)
    evaluator = FrameEvaluator(case)
    assert evaluator.evaluate(design).is_admissible
    evaluator.set_reference()
    refused = 0
    for beam in case.designable[design[case.designable]]:
        flipped = design.copy()
        flipped[beam] = False
        bounded = evaluator.evaluate(flipped, warm_start=True, lower_bound=-100.0)
        if bounded.status is Status.UNCONVERGED:
            refused += 1
            assert np.isnan(bounded.efficiency)
            followed = evaluator.evaluate(flipped, warm_start=True)
            assert followed.status in {Status.CONVERGED, Status.SNAPPED}
    assert refused > 0
