"""Derivatives of quantities and constraints by positions and widths, against differences."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.mechanics.frames.case import CHANNELS, LOADED, CaseEvaluator, Channel
from bellcrank.mechanics.frames.geometry import beam_slopes, geometry_slopes
from bellcrank.mechanics.frames.joints import joint_lengths, joint_slopes, with_joints
from bellcrank.mechanics.frames.quantities.forces import LOWEST_STIFFNESS
from bellcrank.model import Item, ObjectiveTerm, Specification
from bellcrank.refine.row_evaluator import RowEvaluator
from bellcrank.refine.shape import shape_rows
from bellcrank.refine.variables import variables_of

from .designs import random_block, random_design, stable_corner, straight_crane

if TYPE_CHECKING:
    from collections.abc import Callable

    from bellcrank.model import Design, Problem

SHARED = {"input_motion", "input_force", "strain"}
ALL = [Channel(name, "" if name in SHARED else "output") for name in CHANNELS]
STEP = 5e-5


def case_of(problem: Problem, mask: np.ndarray) -> CaseEvaluator:
    """Return the response of a design, with tightly converged equilibria."""
    weight = np.zeros(problem.lattice.dimension)
    weight[-1] = -1e-3
    forces = dict.fromkeys((Channel(name, "output") for name in LOADED), 1e-4)
    case = CaseEvaluator(problem, None, weight, forces)
    frames = [case.frame, *case.loaded, case.other("held output", "output")]
    for frame in frames:
        frame.frame = replace(frame.frame, tolerance=1e-13)
    case.respond(mask)
    case.values(ALL, [0.5, 1.0])
    return case


def measures(case: CaseEvaluator) -> dict[tuple[Channel, int], dict[int, float]]:
    """Return the measures of each channel at each state; strains by their beams."""
    found = {}
    for point in case.merged_points():
        for key, (_, each) in zip(point.channels, point.measured, strict=True):
            names = range(len(each.value)) if each.beams is None else each.beams.tolist()
            found[key] = dict(zip(names, each.value.tolist(), strict=True))
    return found


def smooth(key: tuple[Channel, int], here: dict, nearby: dict[int, dict]) -> list[int]:
    """Return the names of the measures of a channel that have a derivative.

    A beam may not be among the most strained ones in all geometries, and the more strained one of
    its ends may change.
    """
    names = [name for name in here[key] if all(name in each[key] for each in nearby.values())]
    if key[0].name != "strain":
        return names
    behind, middle, ahead = (
        np.array([each[key][name] for name in names]) for each in (nearby[-2], here, nearby[2])
    )
    kink = np.abs(ahead - 2.0 * middle + behind) > 1e-2 * np.abs(ahead - behind).max()
    return [name for name, has_kink in zip(names, kink, strict=True) if not has_kink]


def central(function: object, step: float) -> np.ndarray:
    """Return the derivative at 0 by a difference of fourth order."""
    at = [function(k * step) for k in (-2, -1, 1, 2)]  # type: ignore[operator]
    return (at[0] - 8.0 * at[1] + 8.0 * at[2] - at[3]) / (12.0 * step)


def test_joints_have_the_derivatives_of_differences() -> None:
    design = random_design(0)
    problem, mask = design.problem, design.mask
    positions, widths = problem.lattice.positions, problem.beam_widths
    rng = np.random.default_rng(0)
    move, widen = rng.normal(size=positions.shape), rng.normal(size=widths.shape)
    # Nodes on a straight line stay there: joints have no derivative at opposite beams.
    move[problem.special_nodes] = 0.0

    def at(step: float) -> np.ndarray:
        return joint_lengths(
            problem.with_geometry(positions + step * move, widths + step * widen), mask
        )

    slopes = joint_slopes(problem, mask) @ np.concatenate([move.ravel(), widen])
    assert slopes.reshape(-1, 2) == pytest.approx(central(at, 1e-5), abs=1e-8)
    assert np.abs(slopes).max() > 0.1


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("kind", ["plane", "plane, joints of the design", "space", "weight first"])
def test_channels_have_the_derivatives_of_differences(seed: int, kind: str) -> None:
    design = random_block(seed) if kind == "space" else random_design(seed)
    problem, mask = design.problem, design.mask
    if kind == "weight first":
        own = replace(problem.loads, weight=[0.0, -1e-3], weight_during=(0.0, 0.4))
        later = replace(problem.input, during=(0.4, 1.0))
        problem = replace(problem, input=later, loads=own)
    own_joints = kind == "plane, joints of the design"

    def at(step: float) -> Problem:
        moved = problem.with_geometry(positions + step * move, widths + step * widen)
        return with_joints(moved, mask) if own_joints else moved

    positions, widths = problem.lattice.positions, problem.beam_widths
    rng = np.random.default_rng(seed)
    move = rng.normal(size=positions.shape)
    move[problem.special_nodes] = 0.0
    widen = 0.2 * rng.normal(size=widths.shape)
    case = case_of(at(0.0), mask)
    nearby = {step: measures(case_of(at(step * STEP), mask)) for step in (-2, -1, 1, 2)}
    here = measures(case)
    for point in case.merged_points():
        found = geometry_slopes(
            point.equilibrium, point.measured, beam_slopes(point.evaluator, mask)
        )
        assert found is not None
        for key, slope in zip(point.channels, found, strict=True):
            names = smooth(key, here, nearby)
            chosen = [list(here[key]).index(name) for name in names]
            given = (slope.positions * move).sum(axis=(1, 2)) + slope.widths @ widen
            ahead = {step: [each[key][name] for name in names] for step, each in nearby.items()}
            expected = central(lambda step, ahead=ahead: np.array(ahead[round(step / STEP)]), STEP)
            assert len(names) >= len(here[key]) - 2
            size = np.abs(expected).max()
            assert given[chosen] == pytest.approx(expected, abs=1e-6 * size + 1e-12), key


def test_the_lowest_stiffness_has_the_derivative_of_differences() -> None:
    design = straight_crane()
    problem, mask = design.problem, design.mask
    rng = np.random.default_rng(0)
    positions = problem.lattice.positions
    move = rng.normal(size=positions.shape)
    move[problem.special_nodes] = 0.0

    def at(step: float) -> np.ndarray:
        moved = problem.with_geometry(positions + step * move, None)
        return LOWEST_STIFFNESS.measure(case_of(moved, mask).frame.end).value

    frame = case_of(problem, mask).frame
    measured = [(LOWEST_STIFFNESS, LOWEST_STIFFNESS.measure(frame.end))]
    found = geometry_slopes(frame.end, measured, beam_slopes(frame, mask))
    assert found is not None
    given = (found[0].positions * move).sum(axis=(1, 2))
    assert given == pytest.approx(central(at, 1e-5), rel=1e-5)


def compared_rows(rows: RowEvaluator, start: np.ndarray, way: np.ndarray) -> set[str]:
    """Compare the derivatives of objectives and constraints along a way with differences.

    Return the names of the constraints.
    """
    here = rows.evaluate(start, slopes=True)
    step = 1e-6
    ahead, behind = (rows.evaluate(start + sign * step * way) for sign in (1.0, -1.0))
    assert here is not None
    assert ahead is not None
    assert behind is not None
    objective = (ahead.objectives - behind.objectives) / (2.0 * step)
    assert here.objective_slopes @ way == pytest.approx(objective, rel=1e-5)
    one, other = (
        dict(zip(zip(each.names, each.keys, strict=True), each.constraints, strict=True))
        for each in (ahead, behind)
    )
    compared = set()
    for name, key, slope in zip(here.names, here.keys, here.constraint_slopes @ way, strict=True):
        if (name, key) in one and (name, key) in other:
            expected = (one[name, key] - other[name, key]) / (2.0 * step)
            assert slope == pytest.approx(expected, rel=2e-3, abs=2e-4), (name, key)
            compared.add(name)
    return compared


@pytest.mark.parametrize("widest", [1.0, 2.0])
def test_constraints_have_the_derivatives_of_differences(
    widest: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bellcrank.refine.row_evaluator.GAP_REACH", 3.0)
    design = straight_crane()
    width = design.problem.section.width
    variables = variables_of(design, 0.4, (width, widest * width))
    wanted = design.problem.specification
    assert wanted is not None
    mass = Item(quantity="mass", case=wanted.case, at_most=20.0)
    rows = RowEvaluator(variables, design.mask, (*wanted.items, mass))
    rng = np.random.default_rng(1)
    start = np.where(variables.moves, 0.03, 0.01) * rng.normal(size=variables.count)
    way = rng.normal(size=variables.count)
    compared = compared_rows(rows, start, way)
    assert {"clearance", "mass", "case.output.off_axis", "case.output.sag"} <= compared


def test_constraints_in_space_have_the_derivatives_of_differences(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("bellcrank.refine.row_evaluator.GAP_REACH", 3.0)
    design = random_block(0)
    case, output = "case", "output"
    items = (
        Item(quantity="gain", case=case, output=output, at_least=5.0),
        Item(quantity="off_axis", case=case, output=output, at_most=0.01),
        Item(quantity="rotation", case=case, output=output, at_most=0.01),
        Item(quantity="payload", case=case, output=output, at_least=1e-3),
        Item(quantity="dead_load", case=case, output=output, at_least=1e-3),
        Item(quantity="sag", case=case, output=output, at_most=1e-4),
        Item(quantity="strain", case=case, at_most=1e-3),
        Item(quantity="clearance", case=case, at_least=0.1),
        Item(quantity="mass", case=case, at_most=1.0),
    )
    wanted = Specification(
        case=case, output=output, items=items, weight=np.array([0.0, 0.0, -1e-3]),
        maximise=(ObjectiveTerm(quantity="gain", case=case, output=output),),
    )  # fmt: skip
    design = replace(design, problem=replace(design.problem, specification=wanted))
    variables = variables_of(design, 0.4, (0.2, 0.4))
    rows = RowEvaluator(variables, design.mask, items)
    rng = np.random.default_rng(1)
    start = 0.01 * rng.normal(size=variables.count)
    way = rng.normal(size=variables.count)
    compared = compared_rows(rows, start, way)
    assert {"clearance", "mass", "case.output.off_axis"} <= compared
    assert {"case.output.payload", "case.output.dead_load"} <= compared


def test_the_error_of_a_path_with_a_corner_has_the_derivative_of_differences() -> None:
    # Two inputs, one after the other.
    design = stable_corner()
    wanted = design.problem.specification
    assert wanted is not None
    items = [item for item in wanted.items if item.quantity == "path_error"]
    variables = variables_of(design, 0.4, (0.1, 0.3))
    rows = RowEvaluator(variables, design.mask, items)
    rng = np.random.default_rng(3)
    start, way = 0.01 * rng.normal(size=(2, variables.count))
    here = rows.evaluate(start, slopes=True)
    step = 1e-4
    ahead, behind = (rows.evaluate(start + sign * step * way) for sign in (1.0, -1.0))
    assert here is not None
    assert ahead is not None
    assert behind is not None
    own = [k for k, name in enumerate(here.names) if name.endswith("path_error")]
    (one, other) = (
        each.constraints[[name.endswith("path_error") for name in each.names]]
        for each in (ahead, behind)
    )
    # The root mean square, and two bounds on two components at 24 points.
    assert len(own) == len(one) == 1 + 2 * 2 * 24
    slope = here.constraint_slopes[own] @ way
    assert slope == pytest.approx((one - other) / (2.0 * step), rel=1e-4, abs=1e-4)


@pytest.mark.parametrize("made", [random_design, random_block])
def test_constraints_on_the_shape_have_the_derivatives_of_differences(
    made: Callable[[int], Design], monkeypatch: pytest.MonkeyPatch
) -> None:
    # Limits at which most struts, angles, triangles and gaps are constraints.
    limits = {"SMALLEST_HOLE": 3.0, "NEAR_ANGLE": 2.0, "SLENDERNESS": 6.0, "SMALLEST_GAP": 1.8}
    for name, value in limits.items():
        monkeypatch.setattr(f"bellcrank.refine.shape.{name}", value)
    design = made(0)
    problem, mask = design.problem, design.mask
    rng = np.random.default_rng(1)
    # Struts that are parallel have no single pair of nearest points.
    jittered = problem.lattice.positions + rng.uniform(-0.1, 0.1, problem.lattice.positions.shape)
    problem = problem.with_geometry(jittered, problem.widths)
    move = rng.normal(size=problem.lattice.positions.shape)
    widen = rng.normal(size=problem.beam_widths.shape)

    def at(step: float) -> np.ndarray:
        positions = problem.lattice.positions + step * move
        moved = problem.with_geometry(positions, problem.beam_widths + step * widen)
        found = shape_rows(moved, mask, 10.0)
        by_key = dict(zip(zip(found.names, found.keys, strict=True), found.values, strict=True))
        # Gaps that are just large enough to be left out in some of the geometries are nan.
        return np.array(
            [by_key.get(key, np.nan) for key in zip(here.names, here.keys, strict=True)]
        )

    here = shape_rows(problem, mask, 10.0)
    assert set(here.names) == {
        "length of struts", "angle between struts", "holes between struts", "gaps between struts",
        "mass",
    }  # fmt: skip
    slope = (here.positions * move).sum(axis=(1, 2)) + here.widths @ widen
    expected = central(at, 1e-5)
    left = np.isfinite(expected)
    assert left.mean() > 0.95
    assert slope[left] == pytest.approx(expected[left], rel=1e-6, abs=1e-6)


def test_positions_of_supports_inputs_and_outputs_are_no_variables() -> None:
    design = straight_crane()
    width = design.problem.section.width
    variables = variables_of(design, 0.4, (width, width))
    assert variables.moves.all()
    positions, widths = variables.geometry(np.ones(variables.count))
    special = design.problem.special_nodes
    assert np.array_equal(positions[special], design.problem.lattice.positions[special])
    assert np.array_equal(widths, design.problem.beam_widths)
