"""The load-bearing core: what remains without loose pieces and dead ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.mechanics import SpringEvaluator, Status, load_bearing_core
from bellcrank.model import Design, Problem, find_problem
from bellcrank.search import clean

from .problems import frame, random_masks

if TYPE_CHECKING:
    from numpy.typing import NDArray


def obvious_core(problem: Problem, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Strip beam after beam until nothing changes, then drop what hangs on no input."""
    beams, core = problem.lattice.beams, mask.copy()
    bound = {*problem.supports.nodes, *problem.input.nodes, *problem.output.nodes}
    while True:
        degree = np.bincount(beams[core].ravel(), minlength=problem.lattice.node_count)
        loose = [
            beam
            for beam in np.flatnonzero(core)
            if any(degree[node] == 1 and int(node) not in bound for node in beams[beam])
        ]
        if not loose:
            break
        core[loose] = False
    reached = set(problem.input.nodes.tolist())
    for _ in range(len(beams)):
        for a, b in beams[core].tolist():
            if a in reached or b in reached:
                reached |= {a, b}
    return core & np.isin(beams[:, 0], list(reached))


def core_of(problem: Problem, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    return load_bearing_core(Design(problem, mask))


@pytest.fixture(scope="module", params=["crane", "scaling-8", "discs"])
def problem(request: pytest.FixtureRequest) -> Problem:
    return find_problem(request.param)


@pytest.mark.parametrize("share", [0.45, 0.6, 0.8])
def test_the_core_is_what_stripping_beam_after_beam_leaves(problem: Problem, share: float) -> None:
    for mask in random_masks(problem, share, 2):
        assert (core_of(problem, mask) == obvious_core(problem, mask)).all()


def test_a_core_is_its_own_core(problem: Problem) -> None:
    for mask in random_masks(problem, 0.5, 4):
        core = core_of(problem, mask)
        assert (core_of(problem, core) == core).all()


def test_ignoring_dead_ends_is_counting_those_of_the_core(problem: Problem) -> None:
    ignored, counted = (
        SpringEvaluator(problem, unloaded_beams="prune_dead_ends"),
        SpringEvaluator(problem),
    )
    for mask in random_masks(problem, 0.55, 6):
        first, second = ignored.evaluate(mask), counted.evaluate(core_of(problem, mask))
        assert first.status is second.status
        assert first.efficiency == pytest.approx(second.efficiency, abs=1e-9, nan_ok=True)
        assert first.energy == pytest.approx(second.energy, abs=1e-12, nan_ok=True)


def with_other_dead_ends(
    problem: Problem, core: NDArray[np.bool_], rng: np.random.Generator
) -> NDArray[np.bool_]:
    """The core with as many beams added as leave it the core, tried in random order."""
    mask = core.copy()
    for beam in rng.permutation(problem.designable)[:60]:
        tried = mask.copy()
        tried[beam] = True
        if (core_of(problem, tried) == core).all():
            mask = tried
    return mask


def test_all_designs_with_one_core_respond_the_same(problem: Problem) -> None:
    evaluator = SpringEvaluator(problem, unloaded_beams="prune_dead_ends")
    rng = np.random.default_rng(7)
    for mask in random_masks(problem, 0.55, 3):
        core = core_of(problem, mask)
        other = with_other_dead_ends(problem, core, rng)
        assert (other != core).any()
        first, second = evaluator.evaluate(core), evaluator.evaluate(other)
        assert first.status is second.status
        np.testing.assert_array_equal(first.efficiency, second.efficiency)
        np.testing.assert_array_equal(first.displacement, second.displacement)


def test_counted_dead_ends_do_matter() -> None:
    problem = find_problem("crane")
    mask = random_masks(problem, 0.6, 1)[0]
    counted, ignored = (
        SpringEvaluator(problem),
        SpringEvaluator(problem, unloaded_beams="prune_dead_ends"),
    )
    assert counted.evaluate(mask).status is Status.CONVERGED
    assert abs(counted.evaluate(mask).efficiency - ignored.evaluate(mask).efficiency) > 1e-6


@pytest.mark.parametrize("name", ["crane", "pliers", "discs", "scaling-8"])
def test_a_stripped_design_responds_as_the_cleaned_one(name: str) -> None:
    problem = find_problem(name)
    counted, stripped = (
        SpringEvaluator(problem),
        SpringEvaluator(problem, unloaded_beams="prune_all"),
    )
    moved = 0
    for share in (0.5, 0.65, 0.8, 0.95):
        for mask in random_masks(problem, share, 15):
            expected = counted.evaluate(clean(Design(problem, mask), counted).mask)
            found = stripped.evaluate(mask)
            assert found.status is expected.status
            assert found.efficiency == pytest.approx(expected.efficiency, abs=1e-9, nan_ok=True)
            moved += found.efficiency != 0.0
    assert moved > 20


def test_a_triangle_that_hangs_by_a_node_softens_nothing_when_stripped() -> None:
    # The arm of a lever with a triangle hung on its middle node.
    problem = frame(
        [(0, 0), (1, 0), (2, 0), (0.5, 0.9), (1.5, 0.9)],
        [(0, 1), (1, 2), (1, 3), (1, 4), (3, 4)],
        fixed=[0],
        drive=(2, (0.0, 1.0), 1e-3),
        watch=(1, (0.0, 1.0)),
        force=True,
        spring=1.0,
        spring_kind="isotropic",
    )
    bare = np.array([True, True, False, False, False])
    counted, ignored, stripped = (
        SpringEvaluator(problem, "displacement", kind)
        for kind in ("keep", "prune_dead_ends", "prune_all")
    )
    expected = counted.evaluate(bare).efficiency
    assert stripped.evaluate(problem.initial).efficiency == pytest.approx(expected, abs=1e-9)
    for evaluator in (counted, ignored):
        assert abs(evaluator.evaluate(problem.initial).efficiency - expected) > 1e-3
