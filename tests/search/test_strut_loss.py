"""What the loss of a single strut costs, and designs for which it is limited."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bellcrank.mechanics import FrameEvaluator, Status
from bellcrank.model import Design, Item, human_design
from bellcrank.part import PartSpec, frame_problem
from bellcrank.search import SpecificationEvaluator, specified
from bellcrank.search.strut_loss import PATH_LOST, StrutLosses


@pytest.fixture(scope="module")
def crane() -> Design:
    design = human_design("crane")
    assert design is not None
    return replace(design, problem=specified(frame_problem(design.problem, PartSpec())))


def test_losses_are_those_from_rest(crane: Design) -> None:
    losses = StrutLosses(crane.problem).by_strut(crane.mask)
    alone = FrameEvaluator(crane.problem, "displacement")
    nominal = alone.evaluate(crane.mask).efficiency
    held = np.isin(crane.problem.lattice.beams, crane.problem.supports.fixed).all(axis=1)
    assert sorted(losses) == np.flatnonzero(crane.mask & ~held).tolist()
    for beam in list(losses)[::11]:
        mask = crane.mask.copy()
        mask[beam] = False
        response = alone.evaluate(mask)
        expected = PATH_LOST
        if response.status is Status.CONVERGED:
            expected = min(max(1.0 - response.efficiency / nominal, 0.0), PATH_LOST)
        assert losses[beam] == pytest.approx(expected, abs=1e-6)


def test_a_bound_ends_the_computation_with_the_struts_that_cost_most(crane: Design) -> None:
    losses = StrutLosses(crane.problem)
    every = losses.by_strut(crane.mask)
    few = losses.by_strut(crane.mask, bound=0.1)
    assert len(few) < len(every)
    assert max(few.values()) == pytest.approx(max(every.values()))
    assert losses.largest(crane.mask, bound=10.0) == pytest.approx(max(every.values()))


def test_a_design_without_a_path_loses_all(crane: Design) -> None:
    losses = StrutLosses(crane.problem)
    assert losses.largest(np.zeros_like(crane.mask)) == 0.0  # it has no struts
    single = np.zeros_like(crane.mask)
    single[crane.problem.designable[0]] = True
    assert losses.largest(single) == PATH_LOST


@pytest.mark.parametrize("is_full", [False, True])
def test_an_item_limits_the_loss(crane: Design, *, is_full: bool) -> None:
    """The human design needs some of its struts, the full lattice none."""
    mask = crane.problem.initial if is_full else crane.mask
    wanted = crane.problem.specification
    assert wanted is not None
    worst = StrutLosses(crane.problem).largest(mask)
    assert (worst < 1.0) == is_full
    for limit in (0.5 * worst, min(1.01 * worst, PATH_LOST)):
        item = Item(quantity="strut_loss", at_most=limit)
        limited = replace(wanted, items=(*wanted.items, item))
        evaluator = SpecificationEvaluator(replace(crane.problem, specification=limited))
        for increment in (1.0, 1.0 / 32.0):
            evaluator.evaluate(mask, increment)
            result = evaluator.results()[-1]
            assert result.item.quantity == "strut_loss"
            assert result.met == (limit >= worst)
        assert result.value == pytest.approx(worst)
