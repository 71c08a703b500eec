"""Searches of large lattices that start from the result of one on a coarser lattice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bellcrank.model import find_problem, unpack_mask
from bellcrank.model.builtin.scaling import scaling
from bellcrank.search import HoppingSettings, advance_chain, make_evaluator, start_chain
from bellcrank.search.hopping.coarse_start import coarse_start
from bellcrank.search.hopping.state import HoppingState
from bellcrank.task import find_task

SETTINGS = HoppingSettings(steps=1000, coarse_beams=100, coarse_steps=750)


def test_a_search_starts_from_the_result_on_a_coarser_lattice() -> None:
    problem = scaling(14)
    evaluator = make_evaluator(problem, SETTINGS)
    usual = start_chain(evaluator, replace(SETTINGS, coarse_beams=10_000))
    state = start_chain(evaluator, SETTINGS)
    assert isinstance(state, HoppingState)
    assert usual.best < 0.0
    assert state.best > 1.0
    assert state.step == 0
    mask = unpack_mask(state.mask, problem.lattice.beam_count)
    assert evaluator.evaluate(mask).score == pytest.approx(state.best)
    # The same chain has the same start; another one has another.
    assert start_chain(make_evaluator(problem, SETTINGS), SETTINGS) == state
    assert start_chain(evaluator, SETTINGS, chain=1) != state
    after, rows = advance_chain(evaluator, SETTINGS, 0, state)
    assert after.best >= state.best
    assert rows.mask[0].tobytes().hex() == state.mask


def test_small_lattices_and_those_without_chains_start_from_the_initial_design() -> None:
    for problem, settings in (
        (scaling(8), HoppingSettings(steps=250)),
        (find_problem("discs"), SETTINGS),
    ):
        assert coarse_start(make_evaluator(problem, settings), settings, 0) is None


def test_symmetric_designs_stay_symmetric() -> None:
    task = find_task("gripper")
    assert task is not None
    settings = replace(SETTINGS, coarse_beams=50, coarse_steps=250)
    evaluator = make_evaluator(task.problem, settings)
    found = coarse_start(evaluator, settings, 0)
    assert found is not None
    assert np.array_equal(found, evaluator.groups.expand(found))  # type: ignore[attr-defined]
