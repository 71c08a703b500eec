"""Searches with constraints, several strokes and load cases."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings, NoDesignFound
from bellcrank.mechanics import Core, SpringEvaluator, Status
from bellcrank.model import Input, Problem, find_problem, unpack_mask
from bellcrank.search import (
    BLOCK,
    Candidate,
    HoppingSettings,
    MetropolisSettings,
    Verdict,
    advance_chain,
    chain_blocks,
    make_evaluator,
    read_settings,
    select,
    start_chain,
)
from bellcrank.search.constraints import (
    ConstrainedEvaluator,
    DeformedDesign,
    LoadCase,
    at_strokes,
    parse_goal,
    penalty_of,
)

GOALS = {
    "mass <= 0.5": {},
    "degree >= 3": {},
    "connected": {},
    "mirror x": {},
    "stiffness >= 1.5": {},
    "strain <= 0.02": {},
    "no-contact 0.3": {},
    "no-snapping": {},
}


@pytest.fixture(scope="module")
def small() -> Problem:
    return find_problem("scaling-8")


@pytest.fixture(scope="module")
def crane() -> Problem:
    return find_problem("crane")


def violation(problem: Problem, text: str, mask: np.ndarray) -> float:
    """Measured by a new evaluator, as the searches of the core see it."""
    evaluator = SpringEvaluator(problem, unloaded_beams="prune_all")
    response = evaluator.evaluate(mask)
    core = Core(evaluator).of(mask)
    constraint = parse_goal(text).constraint(problem)
    total = (
        0.0
        if constraint.structure_violation is None
        else constraint.structure_violation(mask, core)
    )
    if constraint.response_violation is not None:
        total += constraint.response_violation(DeformedDesign(evaluator, mask, core, response))
    return total


def run(problem: Problem, evaluator: ConstrainedEvaluator, settings: MetropolisSettings):
    """Masks, efficiencies, acceptance and status of all proposals of one chain."""
    blocks = [rows for _, rows in chain_blocks(evaluator, settings, 0)]
    mask = np.concatenate([np.unpackbits(rows.mask, axis=1) for rows in blocks])
    columns = ("efficiency", "accepted", "status", "cost")
    rest = [np.concatenate([getattr(rows, name) for rows in blocks]) for name in columns]
    return mask[:, : problem.lattice.beam_count].astype(bool), *rest


def test_without_goals_the_evaluator_is_a_plain_one(crane: Problem) -> None:
    assert isinstance(make_evaluator(crane, HoppingSettings()), SpringEvaluator)
    assert isinstance(
        make_evaluator(crane, HoppingSettings(goals=("connected",))), ConstrainedEvaluator
    )
    assert isinstance(make_evaluator(crane, HoppingSettings(strokes=(0.5,))), ConstrainedEvaluator)


@pytest.mark.parametrize("search", ["basin-hopping", "paper", "tempering"])
def test_a_goal_that_always_holds_changes_no_result(small: Problem, search: str) -> None:
    settings = read_settings({"search": search, "steps": BLOCK})
    plain = [rows for _, rows in chain_blocks(make_evaluator(small, settings), settings, 0)]
    harmless = replace(settings, goals=("strain <= 100",))
    goals = [rows for _, rows in chain_blocks(make_evaluator(small, harmless), harmless, 0)]
    for one, other in zip(plain, goals, strict=True):
        assert np.array_equal(one.mask, other.mask)
        assert np.array_equal(one.accepted, other.accepted)
        assert np.allclose(one.efficiency, other.efficiency, equal_nan=True, atol=1e-8)


@pytest.mark.parametrize(
    "goal",
    [
        pytest.param(goal, marks=pytest.mark.slow) if goal.startswith("no-") else goal
        for goal in GOALS
    ],
)
def test_a_search_with_a_goal_ends_with_designs_that_satisfy_it(small: Problem, goal: str) -> None:
    settings = HoppingSettings(steps=2 * BLOCK, goals=(goal,))
    evaluator = make_evaluator(small, settings)
    assert isinstance(evaluator, ConstrainedEvaluator)
    mask, efficiency, accepted, status, _ = run(small, evaluator, settings)
    kept = accepted & (status == Status.CONVERGED)
    assert kept.any()
    evaluator = SpringEvaluator(small, unloaded_beams="prune_all")
    for index in np.flatnonzero(kept)[-20:]:
        assert violation(small, goal, mask[index]) <= 1e-6
        assert efficiency[index] == pytest.approx(
            evaluator.evaluate(mask[index]).efficiency, abs=1e-7
        )
    for index in np.flatnonzero(accepted & (status == Verdict.UNMET))[:20]:
        assert violation(small, goal, mask[index]) > 0.0
    rows = np.flatnonzero(kept)
    candidates = [
        Candidate(float(efficiency[i]), 0, int(i), np.packbits(mask[i]).tobytes()) for i in rows
    ]
    verifier = make_evaluator(small, replace(settings, unloaded_beams="keep"))
    chosen = select(small, candidates, evaluator=verifier)
    assert violation(small, goal, chosen.design.mask) <= 1e-6
    assert chosen.efficiency_after == pytest.approx(
        SpringEvaluator(small).evaluate(chosen.design.mask).efficiency, abs=1e-7
    )


@pytest.mark.parametrize("move", [pytest.param("flip", marks=pytest.mark.slow), "balanced"])
def test_the_violation_never_increases_along_a_chain(crane: Problem, move: str) -> None:
    settings = MetropolisSettings(
        steps=600, goals=("mass <= 0.9",), unloaded_beams="prune_all", moves=(move,),
        cost="negative", schedule="constant", cold=0.1,
    )  # fmt: skip
    evaluator = make_evaluator(crane, settings)
    mask, _, accepted, status, _ = run(crane, evaluator, settings)
    violations = np.array([violation(crane, "mass <= 0.9", one) for one in mask[accepted]])
    assert violations[0] > 0.0
    assert (np.diff(violations) <= 1e-6).all()
    first = int(np.argmax(violations == 0.0))
    assert first > 10
    assert (status[accepted][:first] == Verdict.UNMET).all()
    assert (status[accepted][first:] == Status.CONVERGED).all()
    refused = status == Verdict.FORBIDDEN
    assert refused.any() or move == "balanced"  # which predicts most of them
    assert not accepted[refused].any()


def test_records_keep_the_true_efficiency_and_the_cost_that_was_compared(small: Problem) -> None:
    settings = MetropolisSettings(steps=BLOCK, goals=("mass <= 0.9",), cost="negative")
    evaluator = make_evaluator(small, settings)
    mask, efficiency, _, status, cost = run(small, evaluator, settings)
    unmet = np.flatnonzero(status == Verdict.UNMET)[:15]
    assert len(unmet)
    evaluator = SpringEvaluator(small)
    for index in unmet:
        penalty = 100.0 + 30.0 * (1.0 - 0.9 / _mass(small, mask[index]))
        assert cost[index] + efficiency[index] == pytest.approx(penalty)
        assert efficiency[index] == pytest.approx(
            evaluator.evaluate(mask[index]).efficiency, abs=1e-7
        )


def _mass(problem: Problem, mask: np.ndarray) -> float:
    core = SpringEvaluator(problem).load_bearing(mask)[problem.designable]
    length = problem.lattice.rest_length[problem.designable]
    return float(length[core].sum() / length.sum())


def test_forbidden_by_the_beams_means_no_response_was_computed(crane: Problem) -> None:
    evaluator = ConstrainedEvaluator([LoadCase(crane)], ["mass <= 0.99"])
    fewer = crane.initial.copy()
    fewer[crane.designable[::40]] = False
    assert evaluator.evaluate(fewer).status is Status.CONVERGED
    evaluator.set_reference()
    displacement = evaluator.evaluators[0].displacement.copy()
    answer = evaluator.evaluate(crane.initial, warm_start=True)
    assert answer.status is Verdict.FORBIDDEN
    assert not answer.is_admissible
    assert np.isnan(answer.efficiency)
    assert answer.penalty == pytest.approx(penalty_of(0.01))
    assert np.array_equal(displacement, evaluator.evaluators[0].displacement)
    assert evaluator.evaluate(crane.initial).status is Verdict.UNMET


def test_a_design_forbidden_by_its_response_has_an_efficiency(crane: Problem) -> None:
    stiff = ConstrainedEvaluator([LoadCase(crane)], ["stiffness >= 5.7"])
    assert stiff.evaluate(crane.initial).status is Status.CONVERGED
    stiff.set_reference()
    mask = crane.initial.copy()
    mask[crane.designable[::20]] = False
    answer = stiff.evaluate(mask, warm_start=True)
    assert answer.status is Verdict.FORBIDDEN
    assert answer.efficiency == pytest.approx(
        SpringEvaluator(crane).evaluate(mask).efficiency, abs=1e-7
    )
    assert stiff.violated(mask) == ["stiffness >= 5.7"]


def test_expensive_constraints_are_not_evaluated_without_improvement(
    crane: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    evaluator = ConstrainedEvaluator([LoadCase(crane)], ["no-contact 0.1", "strain <= 10"])
    evaluator.evaluate(crane.initial)
    evaluator.set_reference()
    mask = crane.initial.copy()
    mask[crane.designable[50]] = False
    assert evaluator.evaluate(mask, warm_start=True).status is Status.CONVERGED
    monkeypatch.setattr("bellcrank.search.constraints.response.near_pairs", None)
    assert evaluator.evaluate(mask, warm_start=True, lower_bound=1.0).status is Status.UNVERIFIED


def test_several_strokes_are_averaged(crane: Problem) -> None:
    strokes = (0.25, 0.5, 1.0)
    evaluator = make_evaluator(crane, MetropolisSettings(strokes=strokes))
    mask = crane.initial.copy()
    mask[crane.designable[::4]] = False
    each = []
    for stroke in strokes:
        push = Input(
            crane.input.nodes, crane.input.direction, "displacement", stroke * crane.input.amount
        )
        each.append(SpringEvaluator(replace(crane, input=push)).evaluate(mask))
    response = evaluator.evaluate(mask)
    assert np.ptp([one.efficiency for one in each]) > 1e-3
    assert response.efficiency == pytest.approx(np.mean([one.efficiency for one in each]), abs=1e-7)
    assert np.allclose(response.displacement, each[-1].displacement, atol=1e-7)
    evaluator.set_reference()
    assert evaluator.evaluate(mask, warm_start=True).efficiency == pytest.approx(
        response.efficiency, abs=1e-7
    )


def test_load_cases_are_weighted_and_predictions_with_them(crane: Problem) -> None:
    other = find_problem("anti-parallel")
    evaluator = ConstrainedEvaluator([LoadCase(crane, 3.0), LoadCase(other, 1.0)])
    one, two = (SpringEvaluator(p).evaluate(crane.initial).efficiency for p in (crane, other))
    before = evaluator.evaluate(crane.initial).efficiency
    assert before == pytest.approx(0.75 * one + 0.25 * two, abs=1e-8)
    prediction = evaluator.predict_flips(crane.initial)
    assert prediction is not None
    evaluator.set_reference()
    for index in np.argsort(-np.abs(prediction.change))[:20]:
        mask = crane.initial.copy()
        mask[prediction.beams[index]] = False
        change = evaluator.evaluate(mask, warm_start=True).efficiency - before
        assert prediction.change[index] == pytest.approx(change, rel=0.1)


def test_a_search_reaches_target_displacements(small: Problem) -> None:
    strokes, wanted = [0.5, 1.0], np.array([0.02, 0.05])
    evaluator = ConstrainedEvaluator(
        at_strokes(small, strokes, wanted), unloaded_beams="prune_dead_ends"
    )
    settings = HoppingSettings(steps=3 * BLOCK)
    start = evaluator.evaluate(small.initial)
    mask, efficiency, accepted, _, _ = run(small, evaluator, settings)
    best = mask[accepted][np.argmax(efficiency[accepted])]
    assert efficiency[accepted].max() > 0.1 * start.efficiency
    for stroke, motion in zip(strokes, wanted, strict=True):
        amount = stroke * small.input.amount
        part = replace(small, input=replace(small.input, amount=amount))
        reached = (
            SpringEvaluator(part, unloaded_beams="prune_dead_ends").evaluate(best).efficiency
            * amount
        )
        assert reached == pytest.approx(motion, rel=0.1)


def test_mirror_images_are_proposed_and_recorded_together(small: Problem) -> None:
    settings = MetropolisSettings(steps=BLOCK, goals=("mirror x",))
    evaluator = make_evaluator(small, settings)
    assert len(evaluator.problem.designable) == 88
    mask, _, _, status, _ = run(small, evaluator, settings)
    assert not np.isin(status, [Verdict.FORBIDDEN, Verdict.UNMET]).any()
    assert max(violation(small, "mirror x", one) for one in mask[::10]) == 0.0
    assert (np.diff(mask.astype(int), axis=0) != 0).any()


def test_predictions_for_mirror_images_are_of_both_flips(small: Problem) -> None:
    evaluator = ConstrainedEvaluator([LoadCase(small)], ["mirror x"])
    before = evaluator.evaluate(small.initial).efficiency
    prediction = evaluator.predict_flips(small.initial)
    assert prediction is not None
    evaluator.set_reference()
    real = []
    for beam in prediction.beams:
        mask = small.initial.copy()
        mask[beam] = False
        real.append(evaluator.evaluate(mask, warm_start=True).efficiency - before)
    assert np.corrcoef(prediction.change, real)[0, 1] > 0.98


def test_a_chain_with_goals_resumes_from_plain_data_to_the_same_bit(small: Problem) -> None:
    settings = HoppingSettings(
        steps=3 * BLOCK, goals=("mass <= 0.6", "stiffness >= 0.5"), strokes=(0.5, 1.0)
    )
    evaluator = make_evaluator(small, settings)
    whole = [rows for _, rows in chain_blocks(evaluator, settings, 1)]
    state = start_chain(make_evaluator(small, settings), settings, 1)
    for rows in whole:
        state, again = advance_chain(make_evaluator(small, settings), settings, 1, state)
        for one, other in zip(rows, again, strict=True):
            assert np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
        state = type(state).from_dict(state.to_dict())
    assert read_settings(settings.to_dict()) == settings
    assert unpack_mask(state.mask, small.lattice.beam_count).any()


def test_a_design_that_violates_a_goal_is_rejected_and_the_goal_is_named(crane: Problem) -> None:
    full = Candidate(1.0, 0, 0, np.packbits(crane.initial).tobytes())
    verifier = ConstrainedEvaluator(
        [LoadCase(crane)], ["mass <= 0.5", "connected", "stiffness >= 50"]
    )
    with pytest.raises(NoDesignFound, match=r"1 violates mass <= 0.5, stiff"):
        select(crane, [full], evaluator=verifier)
    with pytest.raises(NoDesignFound, match=r"goals \(mass <= 0.5, "):
        select(crane, [], evaluator=verifier)


def test_bad_settings_are_refused(crane: Problem) -> None:
    for goals in ("connected", 3, ["connected"]):
        with pytest.raises(InvalidSettings, match="goals: expected texts"):
            HoppingSettings(goals=goals)
    for strokes in ((), (0.5, 0.5), 0.5):
        with pytest.raises(InvalidSettings, match="strokes: expected different fractions"):
            HoppingSettings(strokes=strokes)
    for stroke in (0.0, -1.0, float("nan"), 1.5, "a"):
        with pytest.raises(InvalidSettings, match="strokes: expected"):
            HoppingSettings(strokes=(stroke,))


def test_incompatible_load_cases_are_refused(crane: Problem) -> None:
    with pytest.raises(InvalidSettings, match=r"cases\[1\]: problem 'scaling-8' has other posit"):
        ConstrainedEvaluator([LoadCase(crane), LoadCase(find_problem("scaling-8"))])
    with pytest.raises(InvalidSettings, match="other designable beams"):
        ConstrainedEvaluator(
            [LoadCase(crane), LoadCase(replace(crane, designable=crane.designable[:5]))]
        )
    with pytest.raises(InvalidSettings, match="at least one"):
        ConstrainedEvaluator([])
    with pytest.raises(InvalidSettings, match="weight of a case"):
        LoadCase(crane, 0.0)
    with pytest.raises(InvalidSettings, match="targets: expected one for each of 2 strokes, got 1"):
        at_strokes(crane, [0.5, 1.0], [0.1])
