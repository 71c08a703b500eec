"""A chain is a pure function of its state: compiled or not, in one go or in pieces."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings, UnknownName
from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import Problem, find_problem, unpack_mask
from bellcrank.search import (
    BLOCK,
    ChainState,
    MetropolisSettings,
    advance_chain,
    chain_blocks,
    costs,
    schedules,
    start_chain,
)
from bellcrank.search.blocks import random_numbers
from bellcrank.search.markov.metropolis import advance_in_python
from bellcrank.storage import Proposals
from tests.search.snapping import Snapping


@pytest.fixture(scope="module")
def small() -> Problem:
    return find_problem("scaling-8")


def same(first: Proposals, second: Proposals) -> bool:
    return all(
        np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
        for a, b in zip(first, second, strict=True)
    )


def whole(
    problem: Problem, settings: MetropolisSettings, chain: int = 0
) -> tuple[ChainState, Proposals]:
    evaluator = SpringEvaluator(problem, settings.objective, settings.unloaded_beams)
    blocks = list(chain_blocks(evaluator, settings, chain))
    joined = (np.concatenate(column) for column in zip(*(b for _, b in blocks), strict=True))
    return blocks[-1][0], Proposals(*joined)


VARIANTS = [
    {},
    {"cost": "negative", "schedule": "constant"},
    {"unloaded_beams": "prune_dead_ends"},
    {"objective": "directional:4"},
]


@pytest.mark.parametrize("variant", VARIANTS, ids=str)
def test_the_compiled_block_equals_the_python_loop(small: Problem, variant: dict) -> None:
    settings = MetropolisSettings(steps=2 * BLOCK, **variant)
    evaluator = SpringEvaluator(small, settings.objective, settings.unloaded_beams)
    state = start_chain(evaluator, settings)
    for block in range(2):
        rng = random_numbers(settings.seed, 0, block)
        compiled, rows = advance_chain(evaluator, settings, 0, state)
        plain, plain_rows = advance_in_python(evaluator, settings, state, rng, BLOCK)
        assert compiled == plain
        assert same(rows, plain_rows)
        state = compiled


def test_a_chain_resumed_from_plain_data_is_the_same_to_the_last_bit(small: Problem) -> None:
    settings = MetropolisSettings(steps=1000)
    end, proposals = whole(small, settings)
    first = next(chain_blocks(SpringEvaluator(small), settings, 0))
    resumed = ChainState(**first[0].to_dict())
    rest = list(chain_blocks(SpringEvaluator(small), settings, 0, resumed))
    joined = Proposals(
        *(np.concatenate(c) for c in zip(first[1], *(p for _, p in rest), strict=True))
    )
    assert rest[-1][0] == end
    assert same(joined, proposals)


def test_recorded_masks_differ_from_the_current_design_by_one_beam(small: Problem) -> None:
    _, proposals = whole(small, MetropolisSettings(steps=500))
    current = small.initial
    bits = np.unpackbits(proposals.mask, axis=1)[:, : len(current)].astype(bool)
    for row, accepted in zip(bits, proposals.accepted, strict=True):
        flipped = np.flatnonzero(row != current)
        assert len(flipped) == 1
        assert flipped[0] in small.designable
        if accepted:
            current = row


def test_the_recorded_efficiency_is_that_of_the_proposal(small: Problem) -> None:
    _, proposals = whole(small, MetropolisSettings(steps=500))
    evaluator = SpringEvaluator(small)
    for step in range(0, 500, 50):
        mask = unpack_mask(proposals.mask[step].tobytes().hex(), small.lattice.beam_count)
        assert proposals.efficiency[step] == pytest.approx(
            evaluator.evaluate(mask).efficiency, abs=1e-8
        )


def test_temperature_falls_with_accepted_steps(small: Problem) -> None:
    settings = MetropolisSettings(steps=1000, annealing=40)
    _, proposals = whole(small, settings)
    accepted_before = np.concatenate([[0], np.cumsum(proposals.accepted)[:-1]])
    expected = settings.temperatures[np.minimum(accepted_before, 40)]
    assert np.array_equal(proposals.temperature, expected)
    assert proposals.temperature[-1] == settings.cold


def test_designs_that_snap_are_recorded_and_refused(small: Problem) -> None:
    settings = MetropolisSettings(steps=BLOCK, schedule="constant", cold=1e6)
    evaluator = Snapping(small, 2)
    _, proposals = advance_chain(evaluator, settings, 0, start_chain(evaluator, settings))
    snapped = proposals.status == Status.SNAPPED
    assert snapped.sum() == BLOCK / 2
    assert not proposals.accepted[snapped].any()
    assert proposals.accepted[~snapped].all()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"steps": 0}, "steps: .*at least 1, got 0"),
        ({"chains": 0}, "chains"),
        ({"seed": -1}, "seed"),
        ({"hot": float("nan")}, "hot"),
        ({"cold": 0.0}, "cold"),
    ],
)
def test_settings_that_make_no_sense_are_refused(wrong: dict, message: str) -> None:
    with pytest.raises(InvalidSettings, match=message):
        MetropolisSettings(**wrong)


@pytest.mark.parametrize("wrong", [{"cost": "x"}, {"schedule": "x"}])
def test_unknown_names_list_the_known_ones(wrong: dict) -> None:
    with pytest.raises(UnknownName, match="known: "):
        MetropolisSettings(**wrong)


def test_settings_survive_plain_data() -> None:
    settings = MetropolisSettings(steps=7, cost="negative", annealing=3)
    assert MetropolisSettings.from_dict(settings.to_dict()) == settings
    with pytest.raises(InvalidSettings, match="no setting 'color'"):
        MetropolisSettings.from_dict({"color": 1})


@pytest.mark.parametrize("name", list(costs))
def test_every_cost_falls_with_efficiency_and_its_code_agrees(name: str, small: Problem) -> None:
    cost = costs[name]
    assert cost.of(1.0) < cost.of(0.5) < cost.of(-1.0)
    _, proposals = whole(small, MetropolisSettings(steps=250, cost=name))
    assert proposals.cost == pytest.approx([cost.of(eta) for eta in proposals.efficiency])


@pytest.mark.parametrize("name", list(schedules))
def test_every_schedule_is_positive_and_never_rises(name: str) -> None:
    table = schedules[name](0.06, 1e-3, 100)
    assert (table > 0).all()
    assert (np.diff(table) <= 0).all()
    assert table[-1] == pytest.approx(1e-3)


def test_the_change_of_the_exponential_cost_does_not_overflow() -> None:
    change = costs["exponential"].change(0.5, np.array([-1e6, 1e6]))
    assert change[0] > 1e200
    assert change[1] == pytest.approx(-math.exp(-0.5))
