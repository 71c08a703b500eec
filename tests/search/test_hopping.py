"""Basin hopping climbs to where no flip improves, disturbs a disc, and never loses its best."""

from __future__ import annotations

import numpy as np
import pytest

from bellcrank.mechanics import CAREFUL, Evaluator, Status
from bellcrank.model import Problem, find_problem, unpack_mask
from bellcrank.search import HoppingSettings, chain_blocks, make_responder
from bellcrank.search.climbing import LEAST_GAIN, Climb, resume_climb
from bellcrank.search.hopping import kick


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
    evaluator = Evaluator(small, dangling="ignored")
    climb = resume_climb(evaluator, small.initial.copy(), depth=10**6, largest_loss=1e6)
    assert climb is not None
    efficiencies = climb_to_the_end(climb)
    assert efficiencies == sorted(efficiencies)
    assert efficiencies[-1] > 1.0 > efficiencies[0]
    for beam in small.designable:
        mask = climb.mask.copy()
        mask[beam] ^= True
        response = evaluator.respond(mask)
        strained = not climb.mask[beam]  # gains of strained gaps are not believed
        if response.status is Status.CONVERGED and not strained:
            assert response.efficiency <= climb.efficiency + 2 * LEAST_GAIN


def test_a_climb_takes_few_responses(small: Problem) -> None:
    climb = resume_climb(Evaluator(small, dangling="ignored"), small.initial.copy(), 12, 0.01)
    assert climb is not None
    tries = len(climb_to_the_end(climb))
    # Every flip of every design on the way would be two orders of magnitude more.
    assert tries < 6 * len(small.designable)


def test_a_climb_ends_after_so_many_vain_tries(small: Problem) -> None:
    climb = resume_climb(Evaluator(small, dangling="ignored"), small.initial.copy(), 3, 1e6)
    assert climb is not None
    climb_to_the_end(climb)
    assert len(climb.tried) == 3


def test_a_climb_cannot_begin_where_nothing_holds() -> None:
    pliers = find_problem("pliers")
    nothing = np.zeros(pliers.lattice.beam_count, dtype=bool)
    assert resume_climb(Evaluator(pliers), nothing, 12, 0.01) is None


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


def test_lines_only_rise_and_the_worst_are_given_up(small: Problem) -> None:
    settings = HoppingSettings(steps=4000, seed=1, lines=4)
    responder = make_responder(small, settings)
    best, counts = -np.inf, []
    for state, _ in chain_blocks(responder, settings, 0):
        assert state.best >= best
        best = state.best
        counts.append(len(state.lines))
    assert counts[0] == 4
    assert counts[-1] == 1
    assert counts == sorted(counts, reverse=True)
    assert state.lines[0].efficiency == pytest.approx(state.best)


def test_the_best_line_stands_up_to_a_closer_look(small: Problem) -> None:
    settings = HoppingSettings(steps=2000)
    *_, (state, _) = chain_blocks(make_responder(small, settings), settings, 0)
    line = max(state.lines, key=lambda line: line.rank)
    mask = unpack_mask(line.mask, small.lattice.beam_count)
    response = Evaluator(small, dangling="stripped").respond(mask, CAREFUL)
    assert response.status is Status.CONVERGED
    assert response.efficiency == pytest.approx(line.efficiency, abs=1e-8)


def test_a_run_shorter_than_one_climb_still_offers_a_design(small: Problem) -> None:
    settings = HoppingSettings(steps=5)
    *_, (state, proposals) = chain_blocks(make_responder(small, settings), settings, 0)
    assert state.step == 5
    assert proposals.accepted.any()
