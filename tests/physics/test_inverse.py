"""Blocks of the inverse stiffness equal those of the dense inverse."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import SpringEvaluator
from bellcrank.mechanics.ordering import factor_size, near_blocks
from bellcrank.model import find_problem


def dense_stiffness(evaluator: SpringEvaluator) -> np.ndarray:
    """Return the stiffness (2 n, 2 n) that the evaluator has assembled last."""
    structure, scratch = evaluator.structure, evaluator.scratch
    count = len(scratch.diagonal)
    stiffness = np.zeros((2 * count, 2 * count))
    for column in range(count):
        here = slice(2 * column, 2 * column + 2)
        a, b, _, d = scratch.diagonal[column]
        stiffness[here, here] = [[a, b], [b, d]]
        for entry in range(*structure.column_start[column : column + 2]):
            row = structure.row[entry]
            there = slice(2 * row, 2 * row + 2)
            stiffness[there, here] = scratch.off_diagonal[entry].reshape(2, 2)
            stiffness[here, there] = stiffness[there, here].T
    return stiffness


@pytest.mark.parametrize("name", ["crane", "discs", "scaling-14"])
@pytest.mark.parametrize("share", [1.0, 0.75])
def test_blocks_of_the_inverse(name: str, share: float) -> None:
    problem = find_problem(name)
    evaluator = SpringEvaluator(problem, unloaded_beams="prune_all")
    rng = np.random.default_rng(1)
    for _ in range(20):
        mask = problem.initial.copy()
        mask[problem.designable] &= rng.random(len(problem.designable)) < share
        if evaluator.evaluate(mask).is_admissible and evaluator.predict_flips(mask) is not None:
            break
    else:
        pytest.fail("no design has a stable response")
    count = len(evaluator.scratch.diagonal)
    everything = np.arange(count)
    blocks = evaluator.inverse_blocks(everything[:, None], everything)
    inverse = blocks.transpose(0, 2, 1, 3).reshape(2 * count, 2 * count)
    product = inverse @ dense_stiffness(evaluator)
    assert np.abs(product - np.eye(2 * count)).max() < 1e-9


def test_blocks_need_a_prediction() -> None:
    crane = find_problem("crane")
    evaluator = SpringEvaluator(crane)
    node = np.array([0])
    with pytest.raises(InvalidSettings, match="call predict_flips first"):
        evaluator.inverse_blocks(node, node)
    evaluator.evaluate(crane.initial)
    evaluator.predict_flips(crane.initial)
    assert np.isfinite(evaluator.inverse_blocks(node, node)).all()
    evaluator.evaluate(crane.initial)
    with pytest.raises(InvalidSettings, match="call predict_flips first"):
        evaluator.inverse_blocks(node, node)


def test_near_blocks_are_at_most_three_beams_away() -> None:
    chain = np.array([[0, 1], [1, 2], [2, 3], [3, 4]])
    start, near = near_blocks(chain, np.array([0, 1, 2, 3, 4]))
    assert [near[a:b].tolist() for a, b in pairwise(start)] == [
        [0, 1, 2, 3], [1, 2, 3, 4], [2, 3, 4], [3, 4], [4],
    ]  # fmt: skip
    no_start, none = near_blocks(chain, np.full(5, -1))
    assert (no_start.tolist(), none.tolist()) == ([0], [])


def test_the_height_of_a_chain_is_its_length() -> None:
    chain = np.array([[0, 1], [1, 2], [2, 3]])
    assert factor_size(chain, np.array([0, 1, 2, 3]), springs=False) == (3, 4)
    assert factor_size(chain, np.array([0, -1, 1, 2]), springs=False) == (1, 2)
