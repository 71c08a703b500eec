"""A design's response does not depend on the chain that found it.

Every proposal of real chains is evaluated again from rest, ten thousand and more in all:
the whole property, not a sample of it.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import Problem, find_problem, unpack_mask
from bellcrank.search import MetropolisSettings

from .chains import has_loose_piece, run_chain
from .problems import frame, random_masks

SAME = 1e-8

PAPER = MetropolisSettings()
HOT = MetropolisSettings(schedule="constant", cold=10.0)
"""Accepts nearly everything: the design wanders instead of settling."""

CHAINS = {
    "crane": (1.0, 6000, PAPER, "keep", 1),
    "scaling-8": (1.0, 2000, PAPER, "keep", 1),
    "discs": (1.0, 1500, PAPER, "keep", 1),
    "crane without dead ends": (0.6, 1000, PAPER, "prune_dead_ends", 1),
    "crane without unloaded beams": (0.8, 1000, PAPER, "prune_all", 1),
    "crane from half its beams": (0.5, 1000, PAPER, "keep", 1),
    "scaling-8 wandering": (0.6, 1500, HOT, "keep", 1),
    "pliers on rollers": (1.0, 600, PAPER, "keep", 1),
    "anti-parallel among snapping designs": (1.0, 1200, PAPER, "keep", 201),
}
"""Share of beams at the start, steps, settings, what counts, seed."""


def diluted(problem: Problem, share: float) -> Problem:
    """The problem with an initial design of a share of its beams that has a response."""
    for mask in random_masks(problem, share, 20, seed=11):
        if SpringEvaluator(problem).evaluate(mask).status is Status.CONVERGED:
            return replace(problem, initial=mask)
    raise AssertionError("no diluted design is held")


@pytest.mark.parametrize("name", CHAINS)
def test_every_proposal_of_a_chain_responds_as_from_rest(name: str) -> None:
    share, steps, settings, unloaded_beams, seed = CHAINS[name]
    problem = find_problem(name.split(maxsplit=1)[0])
    if share < 1.0:
        problem = diluted(problem, share)
    masks, proposals = run_chain(
        SpringEvaluator(problem, unloaded_beams=unloaded_beams), steps, seed, settings
    )
    assert len(masks) == steps
    evaluator = SpringEvaluator(problem, unloaded_beams=unloaded_beams)
    different = []
    for step, mask in enumerate(masks):
        rest = evaluator.evaluate(mask)
        same = np.isclose(
            proposals.efficiency[step], rest.efficiency, rtol=0, atol=SAME, equal_nan=True
        )
        if proposals.status[step] != rest.status or not same:
            recorded = Status(proposals.status[step]).label, proposals.efficiency[step]
            different.append((step, recorded, (rest.status.label, rest.efficiency)))
    assert different == []
    # The property means nothing unless pieces really came loose and were joined again.
    loose = np.array([has_loose_piece(evaluator, mask) for mask in masks])
    accepted = loose[proposals.accepted]
    assert loose.mean() > 0.05
    assert np.abs(np.diff(accepted.astype(int))).sum() > 2


def test_the_chains_make_ten_thousand_proposals_and_more() -> None:
    assert sum(steps for _, steps, *_ in CHAINS.values()) >= 10_000


def test_a_design_near_an_unrelated_one_responds_as_from_rest() -> None:
    for name in ("crane", "scaling-8", "discs"):
        evaluator = SpringEvaluator(find_problem(name))
        masks = random_masks(evaluator.problem, 0.6, 12, seed=5)
        for before, mask in itertools.pairwise(masks):
            evaluator.evaluate(before)
            evaluator.set_reference()
            warm, rest = evaluator.evaluate(mask, warm_start=True), evaluator.evaluate(mask)
            assert warm.status is rest.status
            assert warm.efficiency == pytest.approx(rest.efficiency, abs=SAME, nan_ok=True)


def test_nothing_is_remembered_unless_asked() -> None:
    evaluator = SpringEvaluator(find_problem("scaling-8"))
    first, second, third = random_masks(evaluator.problem, 0.7, 3)
    evaluator.evaluate(first)
    evaluator.set_reference()
    expected = evaluator.evaluate(second, warm_start=True)
    evaluator.evaluate(third)
    again = evaluator.evaluate(second, warm_start=True)
    assert again.efficiency == expected.efficiency
    assert (again.displacement == expected.displacement).all()


def test_a_roller_that_is_joined_again_stays_on_its_line() -> None:
    # Node 4 rolls along x. Its beam is flipped while the rest of the frame is displaced.
    problem = frame(
        [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0)],
        [(0, 1), (0, 2), (1, 2), (1, 3), (2, 3), (3, 4)],
        fixed=[0, 1],
        fixed_y=[4],
        drive=(2, (0.0, -1.0), 0.2),
        watch=(3, (-1.0, 0.0)),
    )
    evaluator = SpringEvaluator(problem)
    joined = problem.initial
    apart = joined.copy()
    apart[-1] = False
    evaluator.evaluate(apart)
    evaluator.set_reference()
    warm, rest = evaluator.evaluate(joined, warm_start=True), evaluator.evaluate(joined)
    assert warm.displacement[4, 1] == 0.0
    assert warm.efficiency == pytest.approx(rest.efficiency, abs=SAME)


TWO_WAYS = {
    "both ways stable from rest": (
        "ffffffffffffffffffffffff7c3f86081c19ac8987a756b6a00598c8d9d95fe61237fffa03fffffec6dfffdf",
        "ffffffffffffffffffffffff7c3f86081c19ac8987a756b6a00598c8d9d95fe61337fffa03fffffec6dfffdf",
    ),
    "both ways stable and alike": (
        "ffffffffffffffffffffffffaa3f1820853a6b4282a1ffc919cae7db02812fbb5c7ffffc5bfffff9a5ffffd7",
        "ffffffffffffffffffffffffaa3f1820853a6b4282a17fc919cae7db02812fbb5c7ffffc5bfffff9a5ffffd7",
    ),
    "the way from rest snaps": (
        "ffffffffffffffffffffffff1134dc111a01abda2006420ca28718790e5a27ee9f3fffba2afffff7ab9fff77",
        "ffffffffffffffffffffffff1134dc111a01abda2006420ca28618790e5a27ee9f3fffba2afffff7ab9fff77",
    ),
    "the way from rest snaps, the other hardly moves": (
        "ffffffffffffffffffffffff27dc51009539381006f1c33f5deac622a2812fda3c77ffab51fffffb36bfff0f",
        "ffffffffffffffffffffffff27dc51009539381006f1c33f5ceac622a2812fda3c77ffab51fffffb36bfff0f",
    ),
}
"""Neighbouring designs for `anti-parallel`, met in chains, of which the second has two
equilibria at full load: one that is reached from rest, one next to that of the first."""


@pytest.mark.parametrize("name", TWO_WAYS)
def test_a_design_with_two_equilibria_takes_the_one_reached_from_rest(name: str) -> None:
    evaluator = SpringEvaluator(find_problem("anti-parallel"))
    before, mask = (unpack_mask(text, 352) for text in TWO_WAYS[name])
    assert evaluator.evaluate(before).status is Status.CONVERGED
    evaluator.set_reference()
    warm, rest = evaluator.evaluate(mask, warm_start=True), evaluator.evaluate(mask)
    assert warm.status is rest.status
    assert warm.efficiency == pytest.approx(rest.efficiency, abs=SAME)


def test_with_a_bound_no_design_is_loaded_from_rest() -> None:
    """Each design that snaps when it is loaded from rest is refused by a local search."""
    evaluator = SpringEvaluator(find_problem("pliers"))
    masks, proposals = run_chain(evaluator, 1500, seed=201)
    current, refused = evaluator.problem.initial, []
    for mask, status, accepted in zip(masks, proposals.status, proposals.accepted, strict=True):
        if status == Status.SNAPPED:
            evaluator.evaluate(current)
            evaluator.set_reference()
            bounded = evaluator.evaluate(mask, warm_start=True, lower_bound=-100.0)
            refused.append(bounded.status)
            assert not bounded.is_admissible
            assert bounded.status in {Status.UNVERIFIED, Status.UNCONVERGED}
            assert np.isnan(bounded.efficiency) == (bounded.status is Status.UNCONVERGED)
        current = mask if accepted else current
    assert len(refused) > 10
    assert Status.UNVERIFIED in refused
