"""Basin hopping: local search, perturbation, Metropolis phases; the best design is never lost."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import VERIFICATION_INCREMENT, Response, SpringEvaluator, Status
from bellcrank.model import Problem, find_problem, pack_mask, unpack_mask
from bellcrank.model.builtin.scaling import scaling
from bellcrank.part import PartSpec, frame_problem
from bellcrank.search import (
    BLOCK,
    HoppingSettings,
    HoppingState,
    advance_chain,
    chain_blocks,
    make_evaluator,
    start_chain,
)
from bellcrank.search.hopping.basin_hopping import BasinHopping
from bellcrank.search.hopping.local_search import (
    LEAST_SHARE,
    MIN_GAIN,
    SEPARATION,
    LocalSearch,
    start_local_search,
)
from bellcrank.search.hopping.settings import FRAMES, SPRINGS
from bellcrank.search.hopping.state import Member
from bellcrank.search.hopping.variation import perturb, recombine
from tests.search.snapping import Snapping

if TYPE_CHECKING:
    from bellcrank.search.evaluator import Evaluator
    from bellcrank.storage import Proposals

EAGER: dict[str, Any] = {
    "phase_steps": 300, "phase_share": 0.5, "min_stall": 500, "stall": 0.2, "restart_after": 0,
}  # fmt: skip
"""Settings with which short runs of a small problem have Metropolis phases and no restarts."""


@pytest.fixture(scope="module")
def small() -> Problem:
    return find_problem("scaling-8")


def run_to_the_end(local: LocalSearch) -> list[float]:
    efficiencies = [local.efficiency]
    while (beams := local.next_flips()) is not None:
        local.try_flips(beams)
        efficiencies.append(local.efficiency)
    return efficiencies


def test_a_long_local_search_ends_where_no_flip_improves(small: Problem) -> None:
    evaluator = SpringEvaluator(small, unloaded_beams="prune_dead_ends")
    local = start_local_search(
        evaluator,
        small.initial.copy(),
        SPRINGS._replace(max_failures=10**6),
        max_predicted_loss=1e6,
    )
    assert local is not None
    efficiencies = run_to_the_end(local)
    assert efficiencies == sorted(efficiencies)
    assert efficiencies[-1] > 1.0 > efficiencies[0]
    for beam in small.designable:
        mask = local.mask.copy()
        mask[beam] ^= True
        response = evaluator.evaluate(mask)
        strained = not local.mask[beam]  # predicted gains of strained beams are not used
        if response.status is Status.CONVERGED and not strained:
            assert response.efficiency <= local.efficiency + 2 * MIN_GAIN


def test_a_local_search_takes_few_responses(small: Problem) -> None:
    local = start_local_search(
        SpringEvaluator(small, unloaded_beams="prune_dead_ends"),
        small.initial.copy(),
        SPRINGS,
        0.01,
    )
    assert local is not None
    tries = len(run_to_the_end(local))
    # Every flip of every design on the way would be two orders of magnitude more.
    assert tries < 6 * len(small.designable)


def test_a_local_search_ends_after_the_given_number_of_failures(small: Problem) -> None:
    local = start_local_search(
        SpringEvaluator(small, unloaded_beams="prune_dead_ends"),
        small.initial.copy(),
        SPRINGS._replace(max_failures=3),
        1e6,
    )
    assert local is not None
    run_to_the_end(local)
    assert len(local.failed) == 3


def test_flips_made_together_are_distant_and_their_number_follows_their_success() -> None:
    crane = find_problem("crane")
    evaluator = SpringEvaluator(crane, unloaded_beams="prune_all")
    limits = SPRINGS._replace(largest_batch=64)
    local = start_local_search(evaluator, crane.initial.copy(), limits, 0.01)
    assert local is not None
    middle = crane.lattice.positions[crane.lattice.beams].mean(axis=1)
    sizes, outcomes, poor = [], [], 0
    while (beams := local.next_flips()) is not None:
        before, efficiency, most = local.mask, local.efficiency, local.batch
        predicted = local._gains[np.isin(local._beams, beams)].sum()
        apart = np.linalg.norm(middle[beams][:, None] - middle[beams][None], axis=2)
        assert apart[~np.eye(len(beams), dtype=bool)].min(initial=np.inf) >= SEPARATION
        assert 1 <= len(beams) <= most
        mask, response, accepted = local.try_flips(beams)
        assert np.flatnonzero(mask != before).tolist() == sorted(beams.tolist())
        if accepted:
            assert response.efficiency == local.efficiency > efficiency
            agrees = len(beams) == 1 or response.efficiency - efficiency >= LEAST_SHARE * predicted
            wanted = 2 * len(beams) if agrees else len(beams) // 2
            assert local.batch == min(wanted, limits.largest_batch)
            poor += not agrees
        else:
            assert local.mask is before
            assert local.batch == (most if len(beams) == 1 else max(1, len(beams) // 4))
        sizes.append(len(beams))
        outcomes.append(accepted)
    together = np.array(sizes) > 1
    # Several flips are made together with and without success, and single ones, too.
    assert {*np.array(outcomes)[together].tolist()} == {False, True}
    assert np.array(outcomes)[~together].any()
    assert poor


def test_flips_are_predicted_for_the_current_design() -> None:
    """On large lattices predictions may follow a failure, after several gains."""

    class Recorder(SpringEvaluator):
        after_failures = 0

        def evaluate(self, mask, *args, **kwargs):
            self.last = mask
            return super().evaluate(mask, *args, **kwargs)

        def predict_flips(self, mask, beams=None):
            assert np.array_equal(mask, self.last)
            self.after_failures += failed
            return super().predict_flips(mask, beams)

    problem = scaling(24)
    evaluator = Recorder(problem, unloaded_beams="prune_all")
    limits = HoppingSettings().limits(problem)
    local = start_local_search(evaluator, problem.initial.copy(), limits, 0.01)
    assert local is not None
    failed = False
    for _ in range(60):
        beams = local.next_flips()
        assert beams is not None
        _, _, accepted = local.try_flips(beams)
        failed = not accepted
    assert evaluator.after_failures > 0


def test_flips_that_failed_alone_are_left_out_where_flips_are_made_together() -> None:
    problem = scaling(10)
    for largest_batch in (1, 4):
        limits = SPRINGS._replace(largest_batch=largest_batch)
        evaluator = SpringEvaluator(problem, unloaded_beams="prune_all")
        local = start_local_search(evaluator, problem.initial.copy(), limits, 0.01)
        assert local is not None
        failed: list[int] = []
        repeated = 0
        while (beams := local.next_flips()) is not None:
            repeated += bool(np.isin(beams, failed).any())
            _, _, accepted = local.try_flips(beams)
            if not accepted and len(beams) == 1:
                failed.append(int(beams[0]))
        assert bool(repeated) == (largest_batch == 1)


def test_flips_that_failed_together_are_tried_again_alone(small: Problem) -> None:
    evaluator = SpringEvaluator(small, unloaded_beams="prune_all")
    limits = SPRINGS._replace(largest_batch=64)
    local = start_local_search(evaluator, small.initial.copy(), limits, 0.01)
    assert local is not None
    first = local.next_flips()
    assert first is not None
    assert len(first) > 1
    local.efficiency = 1e3  # no design gains enough
    while True:
        beams = local.next_flips()
        assert beams is not None
        assert beams[0] == first[0]
        local.try_flips(beams)
        if len(beams) == 1:
            break
    assert local.failed == [first[0]]


def test_limits_depend_on_the_model_and_on_the_number_of_beams(small: Problem) -> None:
    frame = frame_problem(small, PartSpec())
    large, large_frame = scaling(40), frame_problem(scaling(40), PartSpec())
    settings = HoppingSettings()
    assert settings.limits(small) == SPRINGS
    assert settings.limits(frame) == FRAMES
    assert settings.limits(large).max_failures == 43
    assert settings.limits(large_frame).largest_batch == 8
    assert settings.limits(large).largest_batch == 79
    given = HoppingSettings(largest_batch=3, restart_after=0).limits(large)
    assert (given.largest_batch, given.restart_after, given.max_failures) == (3, 0, 43)


def test_a_local_search_cannot_start_from_a_mechanism() -> None:
    pliers = find_problem("pliers")
    nothing = np.zeros(pliers.lattice.beam_count, dtype=bool)
    assert start_local_search(SpringEvaluator(pliers), nothing, SPRINGS, 0.01) is None


def test_a_perturbation_redraws_a_disc_and_nothing_else(small: Problem) -> None:
    rng = np.random.default_rng(1)
    settings = HoppingSettings(radius=1.5, min_density=0.5)
    middle = small.lattice.positions[small.lattice.beams].mean(axis=1)
    sizes = []
    for _ in range(200):
        changed = np.flatnonzero(perturb(small, small.initial, settings, rng) != small.initial)
        assert np.isin(changed, small.designable).all()
        spread = middle[changed][:, None] - middle[changed][None]
        assert np.hypot(*spread.T).max() <= 2 * 1.5 * 1.5 + 1e-9
        sizes.append(len(changed))
    assert 1 <= min(sizes) < 5 < max(sizes)


def blocks(problem: Problem, settings: HoppingSettings) -> list[tuple[HoppingState, Proposals]]:
    return list(chain_blocks(make_evaluator(problem, settings), settings, 0))


def test_the_best_design_is_never_lost_and_is_verified(small: Problem) -> None:
    evaluator = SpringEvaluator(small, unloaded_beams="prune_all")
    best = -np.inf
    for state, _ in blocks(small, HoppingSettings(steps=2000, **EAGER)):
        assert state.best >= best
        best = state.best
        mask = unpack_mask(state.mask, small.lattice.beam_count)
        response = evaluator.evaluate(mask, VERIFICATION_INCREMENT)
        assert response.status is Status.CONVERGED
        assert response.efficiency == pytest.approx(best, abs=1e-8)
    assert best > 1.0


def in_phase(parts: list[tuple[HoppingState, Proposals]]) -> np.ndarray:
    """Whether each step is in a Metropolis phase; the others have temperature 0."""
    return np.concatenate([rows.temperature for _, rows in parts]) > 0.0


def test_phases_begin_when_progress_stalls_and_take_their_share(small: Problem) -> None:
    settings = HoppingSettings(steps=8000, **EAGER)
    evaluator = make_evaluator(small, settings)
    first = start_chain(evaluator, settings, 0)
    unbeatable = replace(first, best=1e3, population=(Member(first.mask, 1e3),))
    steps = in_phase(list(chain_blocks(evaluator, settings, 0, unbeatable)))
    first = np.flatnonzero(steps)[0]
    assert 0 <= first - EAGER["min_stall"] < 300  # a local search is not interrupted
    assert steps[first:].mean() == pytest.approx(EAGER["phase_share"], abs=0.05)
    lengths = np.diff(np.flatnonzero(np.diff(np.r_[0, steps, 0])))[::2]
    assert (lengths[:-1] == EAGER["phase_steps"]).all()


def test_no_phases_without_steps_for_them(small: Problem) -> None:
    assert not in_phase(
        blocks(small, HoppingSettings(steps=2000, **{**EAGER, "phase_steps": 0}))
    ).any()


def test_a_phase_continues_from_the_last_one_until_there_is_progress(small: Problem) -> None:
    settings = HoppingSettings(steps=4000, **EAGER)
    evaluator = make_evaluator(small, settings)
    state = replace(start_chain(evaluator, settings, 0), step=1000, local_searches=1)
    rng = np.random.default_rng(1)
    hopping = BasinHopping(evaluator, settings, settings.limits(small), state, rng, 2000)
    reached = state.mask
    for _ in range(2):
        hopping.leave()
        assert hopping.state.phase_mask == reached
        first = len(hopping.rows)
        hopping.run_phase()
        taken = np.flatnonzero(hopping.rows.accepted[first:])
        assert flips(hopping.rows.mask[first], reached, small) == 1
        assert flips(hopping.rows.mask[first + taken[-1]], hopping.state.phase_mask, small) == 0
        assert hopping.local is not None
        assert (
            hopping.local.mask == unpack_mask(hopping.state.phase_mask, len(small.initial))
        ).all()
        reached = hopping.state.phase_mask
        hopping.local = None
        hopping.state = replace(hopping.state, phase_end=0)
    hopping.finish_local_search(replace(resume(evaluator, small.initial), efficiency=1e3))
    assert hopping.state.phase_mask == reached
    worse = (Member(hopping.state.mask, 0.0),)
    hopping.state = replace(hopping.state, best=0.0, population=worse)
    hopping.finish_local_search(resume(evaluator, unpack_mask(reached, len(small.initial))))
    assert hopping.state.best > 0.0
    assert hopping.state.phase_mask is None


def flips(row: np.ndarray, mask: str, problem: Problem) -> int:
    bits = np.unpackbits(row)[: problem.lattice.beam_count].astype(bool)
    return int((bits != unpack_mask(mask, problem.lattice.beam_count)).sum())


def resume(evaluator: Evaluator, mask: np.ndarray) -> LocalSearch:
    local = start_local_search(evaluator, mask.copy(), SPRINGS, 0.01)
    assert local is not None
    return local


def test_a_phase_from_a_mechanism_restarts_from_the_best_design(small: Problem) -> None:
    settings = HoppingSettings(steps=4000, **EAGER)
    evaluator = make_evaluator(small, settings)
    state = start_chain(evaluator, settings, 0)
    nothing = "00" * len(bytes.fromhex(state.mask))
    lost = replace(state, phase_steps_left=100, phase_mask=nothing)
    after, _ = advance_chain(evaluator, settings, 0, lost)
    assert after.step == BLOCK
    assert after.phase_mask != nothing
    assert after.best > state.best


def test_a_first_local_search_without_result_is_not_repeated(small: Problem) -> None:
    class Strict(Snapping):
        """Every design that is verified snaps."""

        def evaluate(
            self, mask: np.ndarray, largest_increment: float = 1.0, **start: Any
        ) -> Response:
            response = super().evaluate(mask, largest_increment, **start)
            snaps = largest_increment == VERIFICATION_INCREMENT
            return replace(response, status=Status.SNAPPED) if snaps else response

    settings = HoppingSettings(steps=1000)
    parts = list(chain_blocks(Strict(small, 10**9), settings, 0))
    first_row = parts[0][1].mask[0]
    masks = np.concatenate([rows.mask for _, rows in parts])
    assert (masks == first_row).all(axis=1).sum() == 1
    assert parts[-1][0].local_searches > 1
    assert (unpack_mask(parts[-1][0].mask, small.lattice.beam_count) == small.initial).all()


def test_a_first_local_search_that_cannot_be_resumed_is_not_repeated(small: Problem) -> None:
    settings = HoppingSettings(steps=2000, phase_steps=0)
    evaluator = make_evaluator(small, settings)
    first = start_chain(evaluator, settings, 0)
    # A design may be stable next to its reference, and not from rest.
    nothing = np.zeros(small.lattice.beam_count, dtype=bool)
    state = replace(first, step=250, search_mask=pack_mask(nothing), failed=(), batch=1)
    after, proposals = advance_chain(evaluator, settings, 0, state)
    assert after.local_searches >= 1
    # The next one begins with a perturbation of the best design, not with that design again.
    assert flips(proposals.mask[0], first.mask, small) > 0


def test_a_run_shorter_than_one_local_search_still_accepts_a_design(small: Problem) -> None:
    settings = HoppingSettings(steps=5)
    *_, (state, proposals) = chain_blocks(make_evaluator(small, settings), settings, 0)
    assert state.step == 5
    assert proposals.accepted.any()


RESTARTS: dict[str, Any] = {"restart_after": 2.0, "restart_patience": 0.5, "restart_steps": 0.5}
"""Settings with which short runs of a small problem restart several times."""


def test_restarts_fill_an_archive_of_verified_designs(small: Problem) -> None:
    evaluator = SpringEvaluator(small, unloaded_beams="prune_all")
    stages, best = [], -np.inf
    settings = HoppingSettings(steps=8000, restart_archive=3, **RESTARTS)
    for state, _ in blocks(small, settings):
        if state.stage not in stages[-1:]:
            stages.append(state.stage)
        assert len(state.archive) <= settings.restart_archive
        assert len({member.mask for member in state.archive}) == len(state.archive)
        assert state.best >= best
        best = state.best
    assert stages[:3] == ["first", "restart", "archive"]
    assert stages.count("restart") > 2
    assert len(state.archive) == settings.restart_archive
    for member in state.archive:
        assert member.score <= state.best
        mask = unpack_mask(member.mask, small.lattice.beam_count)
        response = evaluator.evaluate(mask, VERIFICATION_INCREMENT)
        assert response.status is Status.CONVERGED
        assert response.efficiency == pytest.approx(member.score, abs=1e-8)


def test_a_restart_runs_its_chains_from_the_initial_design(small: Problem) -> None:
    settings = HoppingSettings(steps=4000, **RESTARTS)
    evaluator = make_evaluator(small, settings)
    first = start_chain(evaluator, settings, 0)
    state = replace(first, step=3000, progress_step=0, local_searches=5)
    limits = settings.limits(small)
    hopping = BasinHopping(evaluator, settings, limits, state, np.random.default_rng(1), 4000)
    hopping.leave()
    assert hopping.state.stage == "restart"
    assert hopping.state.archive == first.population
    assert hopping.state.phase_mask == first.mask
    assert hopping.state.phase_steps_left == round(0.5 * len(small.designable))
    while hopping.state.chains_left:
        hopping.advance()
    assert len({member.mask for member in hopping.state.population}) == settings.restart_chains
    assert hopping.state.best == max(first.best, hopping.state.best_member.score)


def test_without_patience_the_first_stage_does_not_end(small: Problem) -> None:
    assert {state.stage for state, _ in blocks(small, HoppingSettings(steps=3000))} == {"first"}


def test_a_search_with_restarts_resumes_to_the_bit(small: Problem) -> None:
    settings = HoppingSettings(steps=5000, **RESTARTS)
    states, rows = zip(*blocks(small, settings), strict=True)
    stages = [state.stage for state in states]
    for stage in ("restart", "archive"):
        at = stages.index(stage)
        stored = HoppingState.from_dict(json.loads(json.dumps(states[at].to_dict())))
        assert stored == states[at]
        again = list(chain_blocks(make_evaluator(small, settings), settings, 0, stored))
        assert [state for state, _ in again] == list(states[at + 1 :])
        for (_, proposals), before in zip(again, rows[at + 1 :], strict=True):
            assert (proposals.mask == before.mask).all()
            np.testing.assert_array_equal(proposals.efficiency, before.efficiency)


def test_a_state_from_before_restarts_is_read(small: Problem) -> None:
    state, _ = blocks(small, HoppingSettings(steps=1000))[-1]
    added = ("stage", "population", "archive", "chains_left", "parent")
    former = {key: value for key, value in state.to_dict().items() if key not in added}
    assert HoppingState.from_dict(former) == state


def test_designs_of_the_archive_that_become_equal_count_once(small: Problem) -> None:
    settings = HoppingSettings(steps=4000, **RESTARTS)
    evaluator = make_evaluator(small, settings)
    first = start_chain(evaluator, settings, 0)
    low, high = first.population[0], Member("00" * len(bytes.fromhex(first.mask)), 9.0)
    state = replace(first, step=3000, stage="archive", population=(low, high, low))
    limits = settings.limits(small)
    hopping = BasinHopping(evaluator, settings, limits, state, np.random.default_rng(1), 4000)
    hopping.begin_next_stage()
    assert hopping.state.archive == (high, low)
    assert hopping.state.stage == "restart"


def test_a_recombination_copies_a_disc_of_another_design(small: Problem) -> None:
    rng = np.random.default_rng(2)
    middle = small.lattice.positions[small.lattice.beams].mean(axis=1)
    mask = np.ones(len(small.initial), dtype=bool)
    other = mask.copy()
    other[small.designable] = False
    for _ in range(100):
        copied = np.flatnonzero(~recombine(small, mask, other, rng))
        count = len(small.designable)
        assert 0.1 * count - 1 <= len(copied) <= 0.5 * count + 1
        kept = np.setdiff1d(small.designable, copied)
        # Some beam is the centre: none that is left out is closer to it than the farthest copy.
        distance = np.linalg.norm(middle[copied][:, None] - middle[None], axis=2)
        assert (distance[:, copied].max(axis=1) <= distance[:, kept].min(axis=1) + 1e-9).any()


@pytest.mark.parametrize(
    "wrong", [{"restart_after": -1.0}, {"restart_archive": 0}, {"restart_recombination": 1.5}]
)
def test_wrong_settings_of_restarts_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidSettings, match=next(iter(wrong))):
        HoppingSettings(**wrong)
