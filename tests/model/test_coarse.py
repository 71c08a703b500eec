"""Problems on coarser lattices of straight chains of beams."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.mechanics import FrameEvaluator, Status
from bellcrank.model import (
    Input,
    Loads,
    NodeForce,
    NodeSpring,
    Output,
    Section,
    Supports,
    find_problem,
)
from bellcrank.model.builtin.scaling import scaling
from bellcrank.model.coarse import CoarseProblem, coarse_problems
from bellcrank.task import Task, task_from_dict

if TYPE_CHECKING:
    from bellcrank.model.problem import Problem


def first(problem: Problem, stride: int) -> CoarseProblem:
    """Return the first coarse problem."""
    return next(coarse_problems(problem, stride))


def large(**changes: object) -> Task:
    """Return a task with a large lattice whose input and output are points."""
    case = {
        "inputs": [{"at": {"point": [181, 170], "count": 2}, "direction": "down",
                    "displacement": "4 mm"}],
        "outputs": [{"at": {"point": [12, 170], "count": 2}, "direction": "left",
                     "gain": "maximise", "off_axis": "10%"}],
    }  # fmt: skip
    return task_from_dict(
        {
            "name": "large",
            "domain": {"size": ["202 mm", "178 mm"]},
            "supports": [{"at": {"edge": "bottom"}}],
            "cases": [{**case, **changes}],
        }
    )


def reachable(design: np.ndarray, problem: Problem, nodes: np.ndarray) -> np.ndarray:
    """Return which nodes the beams of a design join to some nodes."""
    lattice = problem.lattice
    kept = replace(lattice, beams=lattice.beams[design])
    return kept.reachable(nodes)


@pytest.mark.parametrize("name", ["scaling-14", "space-8"])
@pytest.mark.parametrize("stride", [2, 3])
def test_each_coarse_beam_is_a_straight_chain(name: str, stride: int) -> None:
    problem = find_problem(name)
    coarse = first(problem, stride)
    lattice, fine = coarse.problem.lattice, problem.lattice
    vectors = np.diff(lattice.positions[lattice.beams], axis=1)[:, 0]
    assert coarse.chains.shape == (lattice.beam_count, stride)
    for chain, vector in zip(coarse.chains, vectors, strict=True):
        steps = np.diff(fine.positions[fine.beams[chain]], axis=1)[:, 0]
        steps *= np.sign(steps @ vector)[:, None]
        assert steps.sum(axis=0) == pytest.approx(vector)
        assert steps == pytest.approx(np.tile(vector / stride, (stride, 1)))
    assert len(np.unique(coarse.chains)) == coarse.chains.size
    if problem.section is None:
        assert coarse.problem.stiffness.bond == problem.stiffness.bond / stride


def test_a_frame_of_chains_moves_as_that_of_its_coarse_beams() -> None:
    fine = scaling(12)
    position = fine.lattice.positions
    # The nodes of the coarse lattice are those of the class of the first node.
    some = first(fine, 2).problem.lattice.positions

    def node(x: float, y: float) -> int:
        near = some[np.hypot(*(some - [x, y]).T).argmin()]
        return int(np.hypot(*(position - near).T).argmin())

    width, height = position.max(axis=0)
    problem = replace(
        fine,
        supports=Supports(fixed=[node(2, 1), node(width - 2, 1)]),
        input=Input([node(width - 2, height - 2)], [0.0, -1.0], "displacement", 0.2),
        output=Output([node(2, height - 2)], [-1.0, 0.0], spring=1e-4),
        section=Section(0.1, 1.0),
        loads=Loads(forces=(NodeForce([node(2, height - 2)], [0.0, -1e-6]),)),
        designable=None,
        initial=None,
    )
    coarse = first(problem, 2)
    rng = np.random.default_rng(3)
    compared = 0
    for _ in range(30):
        mask = rng.random(coarse.problem.lattice.beam_count) < 0.85
        one = FrameEvaluator(coarse.problem, "displacement", elements=8)
        other = FrameEvaluator(problem, "displacement", elements=4)
        found, expected = one.evaluate(mask), other.evaluate(coarse.original(mask))
        if found.status is expected.status is Status.CONVERGED:
            assert found.efficiency == pytest.approx(expected.efficiency, rel=1e-6)
            compared += 1
    assert compared > 10


@pytest.mark.parametrize("stride", [2, 3])
def test_regions_have_coarse_nodes_or_paths_to_them(stride: int) -> None:
    problem = large().problem
    count = 0
    for coarse in coarse_problems(problem, stride):
        design = coarse.original(coarse.problem.initial)
        joined = reachable(design, problem, problem.supports.nodes)
        inside = np.isin(problem.input.nodes, np.unique(problem.lattice.beams[design]))
        assert joined[problem.input.nodes][inside].any()
        assert joined[problem.output.nodes].any()
        assert coarse.problem.specification is not None
        assert coarse.problem.specification.items == problem.specification.items
        count += 1
    assert count >= 2


def test_loads_keep_their_sum() -> None:
    at = {"at": {"box": [60, 60, 110, 110]}}
    loads = [
        {**at, "direction": "down", "force": "1 N", "during": ["0%", "50%"]},
        {**at, "direction": "left", "spring": "2 N/mm"},
    ]
    problem = large(loads=loads).problem
    coarse = first(problem, 3).problem
    (one,), (other,) = problem.loads.forces, coarse.loads.forces
    assert len(other.nodes) < len(one.nodes)
    assert other.force.sum(axis=0) == pytest.approx(one.force.sum(axis=0))
    assert other.during == one.during
    springs: list[NodeSpring] = [problem.loads.springs[0], coarse.loads.springs[0]]
    total = [each.stiffness * len(each.nodes) for each in springs]
    assert total[0] == pytest.approx(total[1])


def test_beams_that_may_not_be_changed_are_in_each_design() -> None:
    task = large()
    problem = task.problem
    frozen = np.setdiff1d(np.arange(problem.lattice.beam_count), problem.designable)
    coarse = first(problem, 2)
    design = coarse.original(np.zeros(coarse.problem.lattice.beam_count, dtype=bool))
    assert design[frozen].all()
    assert design.sum() < 1.2 * len(frozen)


def test_lattices_without_straight_chains_have_no_coarse_problem() -> None:
    assert not list(coarse_problems(find_problem("discs"), 2))
    assert not list(coarse_problems(scaling(8), 40))
    wide = replace(large().problem, widths=None)
    assert list(coarse_problems(wide, 2))
    given = np.full(wide.lattice.beam_count, 0.1)
    assert not list(coarse_problems(replace(wide, widths=given), 2))
