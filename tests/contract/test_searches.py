"""Contract of every registered search: it can be stopped, stored as plain data and resumed."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import (
    VERIFICATION_INCREMENT,
    FlipPrediction,
    Response,
    SpringEvaluator,
    Status,
)
from bellcrank.model import Problem, find_problem
from bellcrank.search import (
    BLOCK,
    SearchSettings,
    State,
    advance_chain,
    chain_blocks,
    is_done,
    make_evaluator,
    read_settings,
    read_state,
    searches,
    start_chain,
)
from bellcrank.storage import Proposals
from tests.search.snapping import Snapping

STEPS = 3 * BLOCK + 10


@pytest.fixture(scope="module")
def small() -> Problem:
    return find_problem("scaling-8")


@pytest.fixture(params=list(searches))
def settings(request: pytest.FixtureRequest) -> SearchSettings:
    return read_settings({"search": request.param, "steps": STEPS, "seed": 3})


def joined(parts: list[Proposals]) -> Proposals:
    return Proposals(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def whole(problem: Problem, settings: SearchSettings, chain: int = 0) -> tuple[State, Proposals]:
    blocks = list(chain_blocks(make_evaluator(problem, settings), settings, chain))
    return blocks[-1][0], joined([proposals for _, proposals in blocks])


def same(first: Proposals, second: Proposals) -> bool:
    return all(
        np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
        for a, b in zip(first, second, strict=True)
    )


def test_settings_survive_json(settings: SearchSettings) -> None:
    assert read_settings(json.loads(json.dumps(settings.to_dict()))) == settings
    assert settings.to_dict()["search"] == settings.name


def test_only_the_search_of_the_paper_keeps_unloaded_beams(settings: SearchSettings) -> None:
    assert settings.unloaded_beams == ("keep" if settings.name == "paper" else "prune_all")


def test_an_unknown_setting_is_refused(settings: SearchSettings) -> None:
    with pytest.raises(InvalidSettings, match=f"search '{settings.name}' has no setting 'color'"):
        read_settings({"search": settings.name, "color": 1})


def test_a_chain_resumed_from_json_is_the_same_to_the_last_bit(
    small: Problem, settings: SearchSettings
) -> None:
    end, proposals = whole(small, settings)
    state, parts = start_chain(make_evaluator(small, settings), settings, 0), []
    while not is_done(state, settings):
        state = read_state(settings, json.loads(json.dumps(state.to_dict())))
        state, rows = advance_chain(make_evaluator(small, settings), settings, 0, state)
        parts.append(rows)
    assert state == end
    assert same(joined(parts), proposals)


def test_blocks_end_at_fixed_steps_with_one_row_for_each(
    small: Problem, settings: SearchSettings
) -> None:
    ends, rows = [], 0
    for state, proposals in chain_blocks(make_evaluator(small, settings), settings, 0):
        ends.append(state.step)
        rows += len(proposals.status)
        assert rows == state.step
    assert ends == [BLOCK, 2 * BLOCK, 3 * BLOCK, STEPS]


def test_accepted_designs_have_the_efficiency_that_was_recorded(
    small: Problem, settings: SearchSettings
) -> None:
    state, proposals = whole(small, settings)
    evaluator = SpringEvaluator(small, unloaded_beams=settings.unloaded_beams)
    bits = np.unpackbits(proposals.mask, axis=1)[:, : small.lattice.beam_count].astype(bool)
    taken = np.flatnonzero(proposals.accepted)
    assert len(taken) == state.accepted > 20
    for index in taken[::7]:
        response = evaluator.evaluate(bits[index])
        assert response.status is Status.CONVERGED
        assert response.efficiency == pytest.approx(proposals.efficiency[index], abs=1e-8)
    assert (proposals.status[taken] == Status.CONVERGED).all()


def test_only_designable_beams_change(small: Problem, settings: SearchSettings) -> None:
    _, proposals = whole(small, settings)
    bits = np.unpackbits(proposals.mask, axis=1)[:, : small.lattice.beam_count].astype(bool)
    others = np.setdiff1d(np.arange(small.lattice.beam_count), small.designable)
    assert (bits[:, others] == small.initial[others]).all()


def test_seeds_and_chains_differ(small: Problem, settings: SearchSettings) -> None:
    runs = [
        whole(small, replace(settings, seed=seed), chain)[1].efficiency
        for seed, chain in [(0, 0), (0, 1), (1, 0)]
    ]
    assert not np.array_equal(runs[0], runs[1], equal_nan=True)
    assert not np.array_equal(runs[0], runs[2], equal_nan=True)


def test_designs_that_snap_are_never_accepted(small: Problem, settings: SearchSettings) -> None:
    evaluator = Snapping(small, 3)
    state = start_chain(evaluator, settings, 0)
    _, proposals = advance_chain(evaluator, settings, 0, state)
    snapped = proposals.status == Status.SNAPPED
    assert snapped.sum() > 20
    assert not proposals.accepted[snapped].any()
    assert proposals.accepted.any()


def test_a_search_continues_without_predictions(small: Problem, settings: SearchSettings) -> None:
    class Blind(Snapping):
        def predict_flips(self, mask: np.ndarray) -> FlipPrediction | None:  # noqa: ARG002
            return None

    evaluator = Blind(small, 3)
    state = start_chain(evaluator, settings, 0)
    _, proposals = advance_chain(evaluator, settings, 0, state)
    assert len(proposals.status) == BLOCK


def test_a_search_cannot_start_from_a_design_without_response(
    small: Problem, settings: SearchSettings
) -> None:
    class Broken(Snapping):
        def evaluate(
            self, mask: np.ndarray, largest_increment: float = 1.0, **start: Any
        ) -> Response:
            response = super().evaluate(mask, largest_increment, **start)
            return response if start else replace(response, status=Status.MECHANISM)

    with pytest.raises(InvalidSettings, match="cannot start"):
        start_chain(Broken(small, 3), settings, 0)


def test_a_chain_resumes_only_from_a_state_between_blocks(
    small: Problem, settings: SearchSettings
) -> None:
    evaluator = make_evaluator(small, settings)
    state = replace(start_chain(evaluator, settings, 0), step=7)
    with pytest.raises(InvalidSettings, match="multiple of 250 steps, got step 7"):
        advance_chain(evaluator, settings, 0, state)


def test_the_best_candidate_of_a_search_is_verified(
    small: Problem, settings: SearchSettings
) -> None:
    _, proposals = whole(small, settings)
    taken = np.flatnonzero(proposals.accepted)
    candidates = searches[settings.name].candidate_rule(
        proposals.efficiency[taken], proposals.mask[taken]
    )
    best = max(candidates, key=lambda index: proposals.efficiency[taken][index])
    mask = np.unpackbits(proposals.mask[taken[best]])[: small.lattice.beam_count].astype(bool)
    response = SpringEvaluator(small, unloaded_beams=settings.unloaded_beams).evaluate(
        mask, VERIFICATION_INCREMENT
    )
    assert response.efficiency == pytest.approx(proposals.efficiency[taken[best]], abs=1e-8)
    assert response.efficiency > 0.1
