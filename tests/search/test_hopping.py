"""Basin hopping climbs to where no flip improves, disturbs a disc, and never loses its best."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank.mechanics import VERIFICATION_INCREMENT, Response, SpringEvaluator, Status
from bellcrank.model import Problem, find_problem, unpack_mask
from bellcrank.search import (
    BLOCK,
    HoppingSettings,
    HoppingState,
    advance_chain,
    chain_blocks,
    make_evaluator,
    start_chain,
)
from bellcrank.search.climbing import LEAST_GAIN, Climb, resume_climb
from bellcrank.search.hopping import Hopper, kick
from tests.search.snapping import Snapping

if TYPE_CHECKING:
    from bellcrank.search.evaluator import Evaluator
    from bellcrank.storage import Proposals

EAGER: dict[str, Any] = {"walk": 300, "share": 0.5, "least_wait": 500, "wait": 0.2}
"""Settings with which short runs of a small problem have walks."""


@pytest.fixture(scope="module")
def small() -> Problem:
    return find_problem("scaling-8")


def climb_to_the_end(climb: Climb) -> list[float]:
    efficiencies = [climb.efficiency]
    while (beam := climb.next_beam()) is not None:
        climb.try_flip(beam)
        efficiencies.append(climb.efficiency)
    return efficiencies


def test_a_patient_climb_ends_where_no_flip_improves(small: Problem) -> None:
    evaluator = SpringEvaluator(small, unloaded_beams="prune_dead_ends")
    climb = resume_climb(evaluator, small.initial.copy(), depth=10**6, largest_loss=1e6)
    assert climb is not None
    efficiencies = climb_to_the_end(climb)
    assert efficiencies == sorted(efficiencies)
    assert efficiencies[-1] > 1.0 > efficiencies[0]
    for beam in small.designable:
        mask = climb.mask.copy()
        mask[beam] ^= True
        response = evaluator.evaluate(mask)
        strained = not climb.mask[beam]  # gains of strained gaps are not believed
        if response.status is Status.CONVERGED and not strained:
            assert response.efficiency <= climb.efficiency + 2 * LEAST_GAIN


def test_a_climb_takes_few_responses(small: Problem) -> None:
    climb = resume_climb(
        SpringEvaluator(small, unloaded_beams="prune_dead_ends"), small.initial.copy(), 12, 0.01
    )
    assert climb is not None
    tries = len(climb_to_the_end(climb))
    # Every flip of every design on the way would be two orders of magnitude more.
    assert tries < 6 * len(small.designable)


def test_a_climb_ends_after_so_many_vain_tries(small: Problem) -> None:
    climb = resume_climb(
        SpringEvaluator(small, unloaded_beams="prune_dead_ends"), small.initial.copy(), 3, 1e6
    )
    assert climb is not None
    climb_to_the_end(climb)
    assert len(climb.tried) == 3


def test_a_climb_cannot_begin_where_nothing_holds() -> None:
    pliers = find_problem("pliers")
    nothing = np.zeros(pliers.lattice.beam_count, dtype=bool)
    assert resume_climb(SpringEvaluator(pliers), nothing, 12, 0.01) is None


def test_a_kick_redraws_a_disc_and_nothing_else(small: Problem) -> None:
    rng = np.random.default_rng(1)
    settings = HoppingSettings(radius=1.5, thinnest=0.5)
    middle = small.lattice.positions[small.lattice.beams].mean(axis=1)
    sizes = []
    for _ in range(200):
        changed = np.flatnonzero(kick(small, small.initial, settings, rng) != small.initial)
        assert np.isin(changed, small.designable).all()
        spread = middle[changed][:, None] - middle[changed][None]
        assert np.hypot(*spread.T).max() <= 2 * 1.5 * 1.5 + 1e-9
        sizes.append(len(changed))
    assert 1 <= min(sizes) < 5 < max(sizes)


def blocks(problem: Problem, settings: HoppingSettings) -> list[tuple[HoppingState, Proposals]]:
    return list(chain_blocks(make_evaluator(problem, settings), settings, 0))


def test_the_best_design_is_never_lost_and_stands_up_to_a_closer_look(small: Problem) -> None:
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


def walking(parts: list[tuple[HoppingState, Proposals]]) -> np.ndarray:
    """Steps of walks; those at which a climb flips or a kick is made have no temperature."""
    return np.concatenate([rows.temperature for _, rows in parts]) > 0.0


def test_walks_begin_where_nothing_is_gained_and_take_their_share(small: Problem) -> None:
    settings = HoppingSettings(steps=8000, **EAGER)
    evaluator = make_evaluator(small, settings)
    unbeatable = replace(start_chain(evaluator, settings, 0), best=1e3)
    steps = walking(list(chain_blocks(evaluator, settings, 0, unbeatable)))
    first = np.flatnonzero(steps)[0]
    assert 0 <= first - EAGER["least_wait"] < 300  # a climb is not broken off
    assert steps[first:].mean() == pytest.approx(EAGER["share"], abs=0.05)
    lengths = np.diff(np.flatnonzero(np.diff(np.r_[0, steps, 0])))[::2]
    assert (lengths[:-1] == EAGER["walk"]).all()


def test_no_walks_without_steps_for_them(small: Problem) -> None:
    assert not walking(blocks(small, HoppingSettings(steps=2000, **{**EAGER, "walk": 0}))).any()


def test_a_walk_goes_on_where_the_last_ended_until_something_is_gained(small: Problem) -> None:
    settings = HoppingSettings(steps=4000, **EAGER)
    evaluator = make_evaluator(small, settings)
    state = replace(start_chain(evaluator, settings, 0), step=1000, hops=1)
    rng = np.random.default_rng(1)
    hopper = Hopper(evaluator, settings, state, rng, 2000, None)
    walker = state.mask
    for _ in range(2):
        hopper.leave()
        assert hopper.state.walker == walker
        first = len(hopper.rows)
        hopper.walk_on()
        taken = np.flatnonzero(hopper.rows.accepted[first:])
        assert flips(hopper.rows.mask[first], walker, small) == 1
        assert flips(hopper.rows.mask[first + taken[-1]], hopper.state.walker, small) == 0
        assert hopper.climb is not None
        assert (hopper.climb.mask == unpack_mask(hopper.state.walker, len(small.initial))).all()
        walker = hopper.state.walker
        hopper.climb = None
        hopper.state = replace(hopper.state, walked=0)
    hopper.end_climb(replace(resume(evaluator, small.initial), efficiency=1e3))
    assert hopper.state.walker == walker
    hopper.state = replace(hopper.state, best=0.0)
    hopper.end_climb(resume(evaluator, unpack_mask(walker, len(small.initial))))
    assert hopper.state.best > 0.0
    assert hopper.state.walker is None


def flips(row: np.ndarray, mask: str, problem: Problem) -> int:
    bits = np.unpackbits(row)[: problem.lattice.beam_count].astype(bool)
    return int((bits != unpack_mask(mask, problem.lattice.beam_count)).sum())


def resume(evaluator: Evaluator, mask: np.ndarray) -> Climb:
    climb = resume_climb(evaluator, mask.copy(), 12, 0.01)
    assert climb is not None
    return climb


def test_a_walk_that_got_lost_begins_again_at_the_best_design(small: Problem) -> None:
    settings = HoppingSettings(steps=4000, **EAGER)
    evaluator = make_evaluator(small, settings)
    state = start_chain(evaluator, settings, 0)
    nothing = "00" * len(bytes.fromhex(state.mask))
    lost = replace(state, walk=100, walker=nothing)
    after, _ = advance_chain(evaluator, settings, 0, lost)
    assert after.step == BLOCK
    assert after.walker != nothing
    assert after.best > state.best


def test_a_first_climb_in_vain_is_not_repeated(small: Problem) -> None:
    class Strict(Snapping):
        """Where every design that is looked at closely snaps."""

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
    assert parts[-1][0].hops > 1
    assert (unpack_mask(parts[-1][0].mask, small.lattice.beam_count) == small.initial).all()


def test_a_run_shorter_than_one_climb_still_offers_a_design(small: Problem) -> None:
    settings = HoppingSettings(steps=5)
    *_, (state, proposals) = chain_blocks(make_evaluator(small, settings), settings, 0)
    assert state.step == 5
    assert proposals.accepted.any()
