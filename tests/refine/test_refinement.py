"""Refinement of designs."""

from __future__ import annotations

import gc
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import VERIFICATION_INCREMENT, FrameEvaluator
from bellcrank.mechanics.frames.joints import with_joints
from bellcrank.model import (
    Design,
    Input,
    Lattice,
    Output,
    Problem,
    Section,
    Specification,
    Supports,
    find_problem,
    gallery_design,
)
from bellcrank.part import PartSpec, frame_problem
from bellcrank.refine import RefinementSettings, refine_design, refinement
from bellcrank.refine.gaps import gaps_of, nearest_points, nearest_to_ends
from bellcrank.refine.rows import Rows
from bellcrank.refine.shape import SLENDERNESS, SMALLEST_ANGLE, shape_rows, volume_of
from bellcrank.refine.steps import linear_step, merit_of
from bellcrank.refine.variables import variables_of
from bellcrank.search import specified
from bellcrank.search.symmetry import beam_images, node_images, operation
from bellcrank.task import find_task
from tests.search.test_symmetry import OCTETS, column

from .designs import straight_crane, unloaded_crane

if TYPE_CHECKING:
    from bellcrank.refine.refinement import Progress
    from bellcrank.refine.steps import Step

ARC = "fffffd2342ac601f80148012006400873f80000e84001a000801a4d2b007a858203a0010590700"
"""Beams that a search found for the task `arc`."""


@pytest.fixture(scope="module")
def refined() -> Design:
    result = refine_design(unloaded_crane(), RefinementSettings(steps=20))
    assert not result.before.met
    assert result.after.met
    assert result.after.objective > 2.5
    return result.design


def test_the_derivatives_of_earlier_steps_are_not_kept() -> None:
    """Over tolerances they took 9 GB."""
    alive = []

    def report(progress: Progress) -> None:
        alive.append(sum(type(each) is Rows for each in gc.get_objects()))

    refine_design(unloaded_crane(), RefinementSettings(steps=7), report)
    assert len(alive) >= 8
    assert max(alive[3:]) <= max(alive[:3])


def test_the_free_crane_becomes_straight(refined: Design) -> None:
    """Its off-axis motion was 96 %, and it turned by 77 degrees."""
    start = straight_crane()
    assert np.array_equal(refined.mask, start.mask)
    special = start.problem.special_nodes
    moved = refined.problem.lattice.positions - start.problem.lattice.positions
    assert not moved[special].any()
    assert 0.05 < np.abs(moved).max() <= 0.9 + 1e-9


def test_a_refined_geometry_can_be_printed(refined: Design) -> None:
    rows = shape_rows(refined.problem, refined.mask, np.inf)
    assert (rows.values <= 1e-2).all()
    lengths = refined.problem.lattice.rest_length[refined.mask]
    widths = refined.problem.beam_widths[refined.mask]
    assert (lengths / widths).min() >= 0.99 * SLENDERNESS
    PartSpec().of(refined).outline()
    assert np.degrees(SMALLEST_ANGLE) == pytest.approx(20.0)


def test_the_mass_may_be_kept() -> None:
    start = straight_crane()
    settings = RefinementSettings(steps=8, evaluations=30, same_mass=True)
    found = refine_design(start, settings)
    before = volume_of(start.problem, start.mask)[0]
    after = volume_of(found.design.problem, found.design.mask)[0]
    assert found.improved
    assert after <= before * (1.0 + 1e-3)


def test_symmetry_remains() -> None:
    task = find_task("gripper")
    assert task is not None
    problem = task.problem
    assert problem.specification is not None
    assert problem.specification.symmetry
    design = Design(problem, problem.initial)
    width = problem.section.width
    variables = variables_of(design, 0.3, (width, 2.0 * width))
    rng = np.random.default_rng(0)
    positions, widths = variables.geometry(0.05 * rng.normal(size=variables.count))
    column = {"x": 0, "y": 1}[problem.specification.symmetry[0]]
    first = problem.lattice.positions
    ends = first[problem.lattice.beams[problem.designable]].reshape(-1, 2)
    centre = 0.5 * (ends[:, column].min() + ends[:, column].max())

    def mirrored(points: np.ndarray) -> np.ndarray:
        image = points.copy()
        image[:, column] = 2.0 * centre - image[:, column]
        return image

    partner = np.abs(first[:, None] - mirrored(first)[None]).sum(axis=2).argmin(axis=1)
    assert positions == pytest.approx(mirrored(positions)[partner], abs=1e-12)
    assert len(np.unique(widths.round(12))) > 10


@pytest.mark.parametrize("symmetry", [("3-fold",), ("3-fold", "x"), ("x",)])
def test_symmetry_in_space_remains(symmetry: tuple[str, ...]) -> None:
    """Moved nodes of a column of octets, and widths of its struts, have the symmetry."""
    problem = column("octet", **OCTETS)
    problem = replace(problem, specification=Specification(symmetry=symmetry))
    section = problem.section
    assert section is not None
    design = Design(problem, problem.initial)
    variables = variables_of(design, 0.3, (section.width, 2.0 * section.width))
    rng = np.random.default_rng(0)
    positions, widths = variables.geometry(0.05 * rng.normal(size=variables.count))
    assert np.abs(positions - problem.lattice.positions).max() > 0.05
    for name in symmetry:
        matrix, centre = operation(problem, name)
        nodes, beams = node_images(problem, name), beam_images(problem, name)
        free = ~np.isin(np.arange(len(nodes)), problem.special_nodes)
        free &= free[nodes]
        moved = (positions - centre) @ matrix.T + centre
        assert positions[nodes][free] == pytest.approx(moved[free], abs=1e-9)
        assert widths[beams] == pytest.approx(widths)
    gradient = variables.gradient(np.ones((1, *positions.shape)), np.zeros((1, len(widths))))
    assert gradient.shape == (1, variables.count)


def test_a_problem_without_a_specification_gets_that_of_its_gain() -> None:
    crane = frame_problem(find_problem("crane"), PartSpec())
    given = specified(crane, 0.65).specification
    assert given is not None
    assert [item.quantity for item in given.items] == ["clearance", "strain"]
    assert [each.quantity for each in given.maximise] == ["gain"]
    task = straight_crane().problem
    assert specified(task) is task


def test_what_cannot_be_refined_is_refused() -> None:
    springs = find_problem("crane").full_design()
    with pytest.raises(InvalidSettings, match="expected a frame; designs of springs"):
        refine_design(springs)


def test_a_design_driven_by_forces_gets_a_larger_ratio_of_forces() -> None:
    """The objective is that of the search: the force in the output springs over the input force."""
    pliers = gallery_design("machine", "pliers")
    assert pliers is not None
    found = refine_design(pliers, RefinementSettings(steps=3))
    for design, state in ((pliers, found.before), (found.design, found.after)):
        evaluator = FrameEvaluator(with_joints(design.problem, design.mask), "force:2", elements=8)
        response = evaluator.evaluate(design.mask, VERIFICATION_INCREMENT)
        assert state.objective == pytest.approx(response.efficiency, rel=1e-3)
    assert found.after.objective > 1.1 * found.before.objective


def test_an_optimiser_that_fails_leaves_the_last_good_design(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls = []

    def fails(*given: Any) -> Step | None:
        calls.append(given)
        return linear_step(*given) if len(calls) <= 4 else None

    monkeypatch.setattr(refinement, "linear_step", fails)
    found = refine_design(unloaded_crane(), RefinementSettings(steps=20))
    assert len(calls) > 5
    assert found.reason == "no step improves the design"
    worst = sum(item.violation for item in found.before.items)
    assert sum(item.violation for item in found.after.items) < worst
    assert found.improved


@pytest.mark.slow
def test_a_payload_that_only_one_element_carries_is_not_taken() -> None:
    """The first geometry carries it by one element in each strut; by eight its path is lost."""
    task = find_task("arc")
    assert task is not None
    beams = task.problem.lattice.beam_count
    bits = np.unpackbits(np.frombuffer(bytes.fromhex(ARC), np.uint8))
    design = Design(task.problem, bits[:beams].astype(bool))
    found = refine_design(design, RefinementSettings(evaluations=600))
    assert found.after.met
    payload = next(each for each in found.after.items if each.item.quantity == "payload")
    assert payload.value >= payload.item.at_least


def test_a_design_that_cannot_be_improved_is_returned_as_it_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(refinement, "linear_step", lambda *_given: None)
    design = unloaded_crane()
    found = refine_design(design)
    assert not found.improved
    assert found.design is design
    assert found.after is found.before
    assert found.reason == "no step improves the design"


def test_nodes_move_no_farther_than_they_may() -> None:
    design = straight_crane()
    tiny = RefinementSettings(largest_move=1e-9, evaluations=8)
    found = refine_design(design, tiny)
    moved = found.design.problem.lattice.positions - design.problem.lattice.positions
    assert np.abs(moved).max() <= 1.1e-9


def test_the_linear_step_solves_a_small_program() -> None:
    from bellcrank.refine.rows import Rows

    # Maximise x + y with x + 2 y <= 1 and both within 0.8: x = 0.8, y = 0.1.
    rows = Rows(
        np.array([0.0]), np.array([-1.0]), ("bound",), ((0,),), np.array([[1.0, 1.0]]),
        np.array([[1.0, 2.0]]),
    )  # fmt: skip
    step = linear_step(rows, np.full(2, -0.8), np.full(2, 0.8), 1.0)
    assert step is not None
    assert step.change == pytest.approx([0.8, 0.1])
    assert step.merit == pytest.approx(0.9)
    assert merit_of(replace(rows, constraints=np.array([0.5])), 1.0) == pytest.approx(-10.0)


def test_the_nearest_points_of_segments_are_found() -> None:
    rng = np.random.default_rng(0)
    share = np.linspace(0.0, 1.0, 101)[:, None]
    for dimension, nearest in ((2, nearest_to_ends), (3, nearest_points)):
        for a, b, c, d in rng.normal(size=(30, 4, dimension)):
            s, t = (each[0, :, None] for each in nearest(*(each[None] for each in (a, b, c, d))))
            found = np.linalg.norm(a + s * (b - a) - c - t * (d - c), axis=1).min()
            first, second = a + share * (b - a), c + share * (d - c)
            distance = np.linalg.norm(first[:, None] - second[None], axis=2).min()
            crossing = dimension == 2 and distance < 0.02
            assert crossing or distance - 0.02 <= found <= distance + 1e-9


def test_gaps_have_no_kink_where_struts_are_parallel() -> None:
    lattice = Lattice([[0, 0], [2, 0], [0.2, 0.3], [1.7, 0.3]], [[0, 1], [2, 3], [0, 2], [1, 3]])
    problem = Problem(
        name="parallel", lattice=lattice, section=Section(0.1, 0.2), supports=Supports(fixed=[0]),
        input=Input([3], [0, -1], "displacement", 0.1), output=Output([2], [1, 0]),
        designable=[3],
    )  # fmt: skip
    beams = np.array([0, 1])
    by_key = []
    for move in (-1e-3, 0.0, 1e-3):
        u = np.zeros((4, 3))
        u[3, 1] = move
        found = gaps_of(problem, beams, u, 1.0)
        by_key.append(dict(zip(map(tuple, found.keys.tolist()), found.value, strict=True)))
        slope = dict(zip(map(tuple, found.keys.tolist()), found.fields[:, 3, 1], strict=True))
    before, here, after = by_key
    assert set(before) == set(here) == set(after)
    for key, value in here.items():
        assert after[key] - value == pytest.approx(value - before[key], abs=2e-6)
        assert after[key] - value == pytest.approx(1e-3 * slope[key], abs=2e-6)
    smallest = [min(each.values()) for each in by_key]
    assert smallest[1] - smallest[0] > 0.5e-3
    assert smallest[2] - smallest[1] < 0.5e-3
