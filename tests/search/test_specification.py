"""Searches for designs that meet a specification."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import VERIFICATION_INCREMENT, Status
from bellcrank.model import Item
from bellcrank.search import (
    HoppingSettings,
    SpecificationEvaluator,
    Verdict,
    chain_blocks,
    make_evaluator,
    read_settings,
    relaxed,
    with_stable_initial,
)
from bellcrank.search.choice import nondominated
from bellcrank.search.stroke_states import fractions_of
from bellcrank.task import find_task, task_from_dict
from bellcrank.workflows.specification import results_for

if TYPE_CHECKING:
    from bellcrank.mechanics import Response
    from bellcrank.model import Problem


def problem_of(name: str) -> Problem:
    task = find_task(name)
    assert task is not None
    return task.problem


@pytest.fixture(scope="module")
def slider() -> Problem:
    return problem_of("slider")


def diluted(problem: Problem, seed: int, density: float = 0.8) -> np.ndarray:
    rng = np.random.default_rng(seed)
    mask = problem.initial.copy()
    mask[problem.designable] = rng.random(len(problem.designable)) < density
    return mask


def stable(problem: Problem, evaluator: SpecificationEvaluator) -> tuple[np.ndarray, Response]:
    for seed in range(50):
        mask = diluted(problem, seed)
        response = evaluator.evaluate(mask)
        if response.is_admissible:
            return mask, response
    raise AssertionError("no stable design")


@pytest.mark.parametrize("name", ["slider", "selector", "gripper", "arc", "switch"])
def test_a_bound_rejects_only_designs_that_are_no_better(name: str) -> None:
    problem = problem_of(name)
    evaluator, exact = SpecificationEvaluator(problem), SpecificationEvaluator(problem)
    mask, response = stable(problem, evaluator)
    evaluator.evaluate(mask)
    evaluator.set_reference()
    rejected = 0
    for beam in evaluator.problem.designable[::5]:
        flipped = mask.copy()
        flipped[beam] ^= True
        bounded = evaluator.evaluate(flipped, warm_start=True, lower_bound=response.score)
        full = exact.evaluate(flipped)
        if bounded.status is Status.UNVERIFIED:
            rejected += 1
            assert not full.is_admissible or full.score <= response.score + 1e-6
        elif bounded.is_admissible and full.is_admissible:
            assert bounded.score == pytest.approx(full.score, abs=1e-4)
    assert rejected > 0


def test_a_design_that_misses_an_item_is_unmet_and_penalised(slider: Problem) -> None:
    evaluator = SpecificationEvaluator(slider)
    response = evaluator.evaluate(slider.initial)
    assert response.status is Verdict.UNMET
    missed = [result for result in evaluator.results() if not result.met]
    assert "case.output.gain" in [result.item.name for result in missed]
    total = sum(result.violation for result in missed)
    assert response.efficiency < 0.0
    assert response.score == pytest.approx(response.efficiency - 100.0 - 3.0 * total)


def test_the_score_weighs_an_objective_against_violations_only_where_items_are_missed() -> None:
    score = SpecificationEvaluator.score(
        np.array([0.0, 0.0, np.log(2.0), np.log(2.0)]), np.array([4.0, -1.0, 4.0, -1.0])
    )
    assert score == pytest.approx([4.0, -1.0, -100.0 + 4.0 / 8.0, -101.0 - 3.0 * np.log(2.0)])


def test_predicted_scores_of_flips_rank_the_real_ones(slider: Problem) -> None:
    from scipy.stats import spearmanr

    evaluator = SpecificationEvaluator(slider)
    mask, response = stable(slider, evaluator)
    evaluator.evaluate(mask)
    evaluator.set_reference()
    prediction = evaluator.predict_flips(mask)
    assert prediction is not None
    real = np.full(len(prediction.beams), np.nan)
    for row, beam in enumerate(prediction.beams):
        flipped = mask.copy()
        flipped[beam] ^= True
        found = evaluator.evaluate(flipped, warm_start=True)
        if found.is_admissible:
            real[row] = found.score - response.score
    known = np.isfinite(real) & (prediction.change != 0.0) & (np.abs(prediction.strain) < 0.1)
    assert known.sum() > 100
    assert spearmanr(real[known], prediction.change[known]).statistic > 0.7


def test_a_flip_of_a_beam_without_load_changes_nothing(slider: Problem) -> None:
    evaluator = SpecificationEvaluator(slider)
    mask = slider.initial.copy()
    node = slider.lattice.node_count // 2
    at_node = np.flatnonzero((slider.lattice.beams == node).any(axis=1))
    mask[at_node] = False
    evaluator.evaluate(mask)
    prediction = evaluator.predict_flips(mask)
    assert prediction is not None
    dead_ends = np.isin(prediction.beams, at_node)
    assert dead_ends.sum() > 2
    assert (prediction.change[dead_ends] == 0.0).all()


def test_a_verified_design_is_evaluated_at_more_states(slider: Problem) -> None:
    evaluator = SpecificationEvaluator(slider)
    evaluator.evaluate(slider.initial)
    assert len(evaluator.records["case"].fractions) == 4
    evaluator.evaluate(slider.initial, VERIFICATION_INCREMENT)
    assert len(evaluator.records["case"].fractions) == 16
    items = problem_of("arc").specification.items
    assert len(fractions_of(items, verified=False)) == 8


def test_mirror_images_are_flipped_together() -> None:
    problem = problem_of("gripper")
    evaluator = SpecificationEvaluator(problem)
    assert len(evaluator.problem.designable) < len(problem.designable)
    mask = evaluator.problem.initial.copy()
    mask[evaluator.problem.designable[3]] = False
    design = evaluator.groups.expand(mask)
    assert problem.initial.sum() - design.sum() == 2
    evaluator.evaluate(mask)
    left, right = (result.value for result in evaluator.results() if result.item.quantity == "gain")
    assert left == pytest.approx(right, abs=1e-9)


def test_a_symmetry_that_the_lattice_has_not_is_refused(slider: Problem) -> None:
    wanted = replace(slider.specification, symmetry=("x",))
    with pytest.raises(InvalidSettings, match=r"limits.symmetry: problem 'slider' is not symmet"):
        make_evaluator(replace(slider, specification=wanted), HoppingSettings())


def test_goals_and_strokes_do_not_go_with_a_specification(slider: Problem) -> None:
    with pytest.raises(InvalidSettings, match=r"goals and strokes: problem 'slider' has a specif"):
        make_evaluator(slider, HoppingSettings(goals=("mass <= 0.5",)))


def test_a_search_begins_with_a_stable_design() -> None:
    problem = problem_of("twist")
    evaluator = SpecificationEvaluator(problem)
    assert not evaluator.evaluate(evaluator.problem.initial).is_admissible
    begun = with_stable_initial(problem, HoppingSettings(seed=3))
    evaluator = SpecificationEvaluator(begun)
    assert evaluator.evaluate(evaluator.problem.initial).is_admissible
    again = with_stable_initial(problem, HoppingSettings(seed=3))
    assert np.array_equal(begun.initial, again.initial)


@pytest.mark.parametrize("name", ["inverter", "selector"])
def test_a_short_search_meets_an_easy_specification(name: str) -> None:
    problem = problem_of(name)
    evaluator = make_evaluator(problem, HoppingSettings())
    met = None
    for state, proposals in chain_blocks(evaluator, HoppingSettings(steps=3000), chain=0):
        taken = proposals.accepted & (proposals.status == Status.CONVERGED)
        if taken.any():
            met = state.step
            break
    assert met is not None


def test_the_same_chain_is_computed_again_from_a_stored_state(slider: Problem) -> None:
    settings = HoppingSettings(steps=1000)
    whole = [state for state, _ in chain_blocks(make_evaluator(slider, settings), settings, 0)]
    again = chain_blocks(make_evaluator(slider, settings), settings, 0, whole[1])
    assert [state for state, _ in again] == whole[2:]


def test_nondominated_vectors_are_beaten_by_no_other_one() -> None:
    rng = np.random.default_rng(1)
    vectors = rng.integers(0, 5, (40, 3)).astype(float).tolist()
    front = nondominated(vectors)
    for index, own in enumerate(vectors):
        beaten = any(
            other != own and all(a <= b for a, b in zip(other, own, strict=True))
            for other in vectors
        )
        assert (index in front) <= (not beaten)
        if not beaten:
            assert own in [vectors[place] for place in front]


def test_a_given_design_is_evaluated_as_it_is_even_if_it_lacks_the_symmetry_of_its_task() -> None:
    problem = problem_of("gripper")
    mask = problem.initial.copy()
    mask[problem.designable[3]] = False
    results = results_for(problem, mask)
    assert results is not None
    left, right = (result.value for result in results if result.item.quantity == "gain")
    assert abs(left - right) > 0.01


def test_bounds_that_a_refinement_meets_are_relaxed_before_it(slider: Problem) -> None:
    wanted = slider.specification
    assert wanted is not None
    own = {"case": wanted.case, "output": wanted.output}
    given = (
        Item(quantity="off_axis", at_most=0.02, **own),
        Item(quantity="off_axis", at_most=0.3, **own),
        Item(quantity="rotation", at_least=-2.0, at_most=1.0, **own),
        Item(quantity="rotation", at_least=20.0, **own),
        Item(quantity="gain", at_least=2.99, at_most=3.01, **own),
        Item(quantity="travel", at_least=-0.1, at_most=0.1, **own),
        Item(quantity="sag", at_most=0.1, **own),
    )
    problem = replace(slider, specification=replace(wanted, items=given, maximise=()))
    found = relaxed(problem).specification
    assert found is not None
    bounds = [(item.quantity, item.at_least, item.at_most) for item in found.items]
    assert bounds == [
        ("off_axis", None, 0.1),
        ("off_axis", None, 0.3),
        ("rotation", -5.0, 5.0),
        ("rotation", 20.0, None),
        ("gain", pytest.approx(2.55), pytest.approx(3.45)),
        ("travel", -0.1, 0.1),
        ("sag", None, 0.1),
    ]
    assert [(each.quantity, each.output) for each in found.maximise] == [("gain", wanted.output)]
    assert relaxed(slider).specification.maximise == wanted.maximise
    settings = read_settings({"before_refinement": True})
    mask = problem.initial
    searched = make_evaluator(problem, settings, reserve=0.0)
    searched.evaluate(mask)
    bound = SpecificationEvaluator(relaxed(problem))
    bound.evaluate(mask)
    assert searched.violations == pytest.approx(bound.violations)


def test_flips_of_a_design_without_beams_are_predicted() -> None:
    """In space all beams may leave, where the ports are single nodes."""
    data = {
        "name": "small",
        "domain": {"size": [24, 24, 24], "cells": "cubic"},
        "supports": [{"at": {"face": "bottom"}}],
        "cases": [
            {
                "inputs": [
                    {"at": {"point": [2, 2, 22]}, "direction": "down", "displacement": "1 mm"}
                ],
                "outputs": [{"at": {"point": [22, 22, 22]}, "direction": "up", "gain": "maximise"}],
            }
        ],
    }
    problem = task_from_dict(data).problem
    evaluator = SpecificationEvaluator(problem)
    none = np.zeros(problem.lattice.beam_count, dtype=bool)
    assert evaluator.evaluate(none).is_admissible
    found = evaluator.predict_flips(none)
    assert found is not None
    assert not found.change.any()
