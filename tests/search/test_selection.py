"""From what chains accepted to a design that can be built."""

from __future__ import annotations

import numpy as np
import pytest

from bellcrank.errors import NoDesignFound
from bellcrank.mechanics import SpringEvaluator, Status, loaded_beams
from bellcrank.model import Problem, find_problem
from bellcrank.search import (
    Candidate,
    candidates_of,
    clean,
    confirmed,
    pieces,
    plateaus,
    select,
)


@pytest.fixture(scope="module")
def small() -> Problem:
    return find_problem("scaling-8")


def candidate(mask: np.ndarray, efficiency: float, step: int = 0) -> Candidate:
    return Candidate(efficiency, 0, step, np.packbits(mask).tobytes())


def test_a_plateau_needs_several_unmoved_changes() -> None:
    efficiency = np.array([1.0, 2.0, 2.0, 2.0, 2.0, 2.001, 3.0, 3.0, 3.0])
    assert plateaus(efficiency, tolerance=0.005, length=4) == [(1, 6)]
    assert plateaus(efficiency, tolerance=0.005, length=2) == [(1, 6), (6, 9)]
    assert plateaus(np.array([])) == []


def test_a_plateau_does_not_drift() -> None:
    efficiency = 1.0 + 0.003 * np.arange(50)
    assert all(
        efficiency[last - 1] - efficiency[first] <= 0.005 * efficiency[first]
        for first, last in plateaus(efficiency, length=1)
    )


def test_candidates_are_the_ends_of_the_best_plateaus_best_first() -> None:
    efficiency = np.repeat([1.0, 3.0, 2.0], 6)
    mask = np.arange(18, dtype=np.uint8)[:, None]
    chosen = candidates_of(4, np.arange(18) * 10, mask, efficiency, count=2)
    assert [(c.score, c.chain, c.step, c.mask) for c in chosen] == [
        (3.0, 4, 110, b"\x0b"),
        (2.0, 4, 170, b"\x11"),
    ]


def test_verified_designs_are_candidates_and_better_unverified_ones_are_not() -> None:
    efficiency = np.array([0.1, 0.5, 0.5, 0.4, 9.0, 0.3, 8.0, 0.2, 0.45])
    masks = np.arange(9, dtype=np.uint8)[:, None]
    assert confirmed(efficiency, masks) == [2, 4, 6, 8]
    masks[2] = masks[1]
    assert confirmed(efficiency, masks) == [2, 8]
    assert confirmed(np.empty(0), np.empty((0, 1), np.uint8)) == []


def test_the_candidates_of_a_chain_without_plateaus_are_its_best() -> None:
    efficiency = np.array([0.1, 0.4, 0.2])
    chosen = candidates_of(0, np.arange(3), np.zeros((3, 1), np.uint8), efficiency, count=1)
    assert [c.step for c in chosen] == [1]


def test_the_selected_design_is_cleaned_and_reported_before_and_after(small: Problem) -> None:
    rng = np.random.default_rng(3)
    evaluator = SpringEvaluator(small)
    while True:
        mask = small.initial.copy()
        mask[rng.choice(small.designable, 80, replace=False)] = False
        core = clean(small.full_design().with_mask(mask)).mask
        response = evaluator.evaluate(core)
        if (core != mask).any() and response.status is Status.CONVERGED and response.efficiency:
            break
    selection = select(small, [candidate(mask, 1.0)])
    assert np.array_equal(selection.design.mask, core)
    assert selection.efficiency_before == pytest.approx(evaluator.evaluate(mask).efficiency)
    assert selection.efficiency_after == pytest.approx(response.efficiency, abs=1e-8)
    assert pieces(small, selection.design.mask) == 1


def test_the_best_after_cleaning_is_selected_whatever_was_recorded(small: Problem) -> None:
    evaluator = SpringEvaluator(small)
    masks = []
    for beam in small.designable[:6]:
        mask = small.initial.copy()
        mask[beam] = False
        masks.append(mask)
    efficiencies = [evaluator.evaluate(mask).efficiency for mask in masks]
    claims = [candidate(mask, -value) for mask, value in zip(masks, efficiencies, strict=True)]
    assert select(small, claims).efficiency_after == pytest.approx(max(efficiencies), abs=1e-8)


def test_no_acceptable_candidate_is_an_error(small: Problem) -> None:
    with pytest.raises(NoDesignFound, match="accepted no design"):
        select(small, [])


def test_pieces_are_counted(small: Problem) -> None:
    assert pieces(small, small.initial) == 1
    mask = np.zeros(small.lattice.beam_count, bool)
    first = small.lattice.beams[0]
    apart = next(
        beam for beam, ends in enumerate(small.lattice.beams) if not set(ends) & set(first)
    )
    mask[[0, apart]] = True
    assert pieces(small, mask) == 2


def kept_by_definition(problem: Problem, mask: np.ndarray) -> np.ndarray:
    """The same as `loaded_beams`, by taking out each node, and the ground, in turn.

    A beam carries load if, whatever single node is taken out, both its ends still hang
    together with something driven, watched or held.
    """
    ground = -1
    fixed = set(problem.supports.fixed.tolist())
    grounded = [
        tuple(ground if node in fixed else node for node in ends)
        for ends in problem.lattice.beams.tolist()
    ]
    terminals = {*problem.supports.nodes, *problem.input.nodes, *problem.output.nodes}
    anchors = {ground if int(node) in fixed else int(node) for node in terminals}
    kept = mask.copy()
    for cut in range(ground, problem.lattice.node_count):
        reached = anchors - {cut}
        beams = [grounded[beam] for beam in np.flatnonzero(mask) if cut not in grounded[beam]]
        growing = True
        while growing:
            more = {b for a, b in beams if a in reached} | {a for a, b in beams if b in reached}
            growing = not more <= reached
            reached |= more
        for beam in np.flatnonzero(mask):
            if not {node for node in grounded[beam] if node != cut} <= reached:
                kept[beam] = False
    return kept


@pytest.mark.parametrize("seed", range(6))
def test_what_hangs_by_one_node_carries_no_load(small: Problem, seed: int) -> None:
    rng = np.random.default_rng(seed)
    mask = small.initial.copy()
    mask[rng.choice(small.designable, 110, replace=False)] = False
    kept = loaded_beams(small, mask)
    assert np.array_equal(kept, kept_by_definition(small, mask))
    assert kept.sum() < mask.sum()


def test_what_stands_on_supports_alone_carries_no_load(small: Problem) -> None:
    fixed = np.isin(small.lattice.beams, small.supports.fixed).sum(axis=1)
    mask = fixed >= 1  # the bottom row and the teeth that stand on it
    kept = loaded_beams(small, mask)
    assert np.array_equal(kept, fixed == 2)
