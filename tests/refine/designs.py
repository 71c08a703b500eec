"""Designs that the tests refine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bellcrank.mechanics import FrameEvaluator, Status
from bellcrank.model import Design, Elasticity, Section, gallery_design
from bellcrank.task import find_task
from tests.physics.test_frame_flips import block


def straight_crane() -> Design:
    """Return the free crane for the task of a straight one, which it misses by far."""
    task, found = find_task("straight-crane"), gallery_design("machine", "crane")
    assert task is not None
    assert found is not None
    return Design(task.problem, found.mask)


def unloaded_crane() -> Design:
    """Return the same without a payload."""
    design = straight_crane()
    wanted = design.problem.specification
    assert wanted is not None
    items = tuple(item for item in wanted.items if item.quantity != "payload")
    own = replace(wanted, items=items)
    return replace(design, problem=replace(design.problem, specification=own))


def random_design(seed: int) -> Design:
    """Return a stable design of the crane with random beams, positions and widths."""
    base = straight_crane()
    rng = np.random.default_rng(seed)
    problem = base.problem
    special = problem.special_nodes
    while True:
        positions = problem.lattice.positions + 0.05 * rng.normal(
            size=problem.lattice.positions.shape
        )
        positions[special] = problem.lattice.positions[special]
        widths = problem.beam_widths * rng.uniform(0.8, 1.2, problem.lattice.beam_count)
        mask = problem.initial.copy()
        chosen = rng.choice(problem.designable, len(problem.designable) // 3, replace=False)
        mask[chosen] = False
        made = Design(problem.with_geometry(positions, widths), mask)
        given = made.problem.input
        small = replace(made.problem, input=replace(given, amount=0.3 * given.amount))
        evaluator = FrameEvaluator(small, "displacement")
        if evaluator.evaluate(mask).status is Status.CONVERGED:
            return replace(made, problem=small)


def random_block(seed: int) -> Design:
    """Return a stable design in space: a cube with all diagonals, pushed at one corner.

    With random beams, positions and widths.
    """
    problem = replace(
        block(), section=Section.round(0.2, joint=0.06), material=Elasticity(12.0, 0.4)
    )
    cube = problem.lattice.positions
    rng = np.random.default_rng(seed)
    while True:
        moved = cube + 0.05 * rng.normal(size=cube.shape)
        moved[problem.special_nodes] = cube[problem.special_nodes]
        widths = rng.uniform(0.2, 0.3, problem.lattice.beam_count)
        mask = problem.initial.copy()
        mask[rng.choice(problem.designable, len(problem.designable) // 3, replace=False)] = False
        made = Design(problem.with_geometry(moved, widths), mask)
        evaluator = FrameEvaluator(made.problem, "displacement")
        if evaluator.evaluate(mask).status is Status.CONVERGED:
            return made


def stable_corner() -> Design:
    """Return a stable design of the bundled task with two inputs one after the other."""
    task = find_task("corner")
    assert task is not None
    problem = task.problem
    rng = np.random.default_rng(0)
    evaluator = FrameEvaluator(problem, "displacement")
    while True:
        mask = problem.initial.copy()
        mask[rng.choice(problem.designable, len(problem.designable) // 3, replace=False)] = False
        if evaluator.evaluate(mask).status is Status.CONVERGED:
            return Design(problem, mask)
