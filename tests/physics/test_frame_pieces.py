"""Loose pieces, dead ends, mechanisms, own weight and springs of frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bellcrank.mechanics import FrameEvaluator
from bellcrank.model import Elasticity, Input, Lattice, Output, Problem, Section, Supports
from tests.physics.frames import MATERIAL, Array, chain

YOUNG = MATERIAL.young
SECTION = {2: Section(0.1, 0.3), 3: Section.round(0.1)}
BOTH = pytest.mark.parametrize("dimension", [2, 3])


def bar(dimension: int, count: int = 4, **given: object) -> Problem:
    """Return a cantilever of `count` beams along x, pushed across at its end."""
    places = np.zeros((count + 1, dimension))
    places[:, 0] = np.arange(count + 1)
    section = given.pop("section", SECTION[dimension])
    return chain(places, section=section, material=MATERIAL, **given)


def with_more(problem: Problem, places: Array, beams: list[list[int]]) -> Problem:
    """Return a problem with more nodes and beams."""
    lattice = problem.lattice
    positions = np.concatenate([lattice.positions, places])
    return replace(
        problem,
        lattice=Lattice(positions, np.concatenate([lattice.beams, beams])),
        initial=None,
    )


def all_of(problem: Problem) -> Array:
    return np.ones(problem.lattice.beam_count, dtype=bool)


def pushed(problem: Problem, drive: str, amount: float) -> Problem:
    return replace(problem, input=replace(problem.input, drive=drive, amount=amount))


@BOTH
@pytest.mark.parametrize("elements", [1, 3])
def test_loose_pieces_stay_at_rest_and_dead_ends_follow_rigidly(
    dimension: int, elements: int
) -> None:
    plain = pushed(bar(dimension), "displacement", 1.5)
    more = np.zeros((4, dimension))
    more[:, 0], more[:, 1] = [2.0, 3.0, 2.0, 3.0], [1.0, 1.0, 2.0, 2.5]
    if dimension == 3:
        more[:, 2] = [0.5, 0.2, 0.0, 0.3]
    # A dead end of two beams at node 2, and a loose beam.
    problem = with_more(plain, more, [[2, 5], [5, 6], [7, 8]])
    evaluator = FrameEvaluator(problem, elements=elements)
    response = evaluator.evaluate(all_of(problem))
    alone = FrameEvaluator(plain, elements=elements).evaluate(all_of(plain))
    assert response.status.label == "converged"
    assert response.efficiency == pytest.approx(alone.efficiency, rel=1e-12)
    assert response.energy == pytest.approx(alone.energy, rel=1e-12)
    assert (response.displacement[7:] == 0.0).all()
    if dimension == 2:
        angle = evaluator.state.u[2, 2]
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    else:
        turn = Rotation.from_quat(np.roll(evaluator.state.q[2], -1)).as_matrix()
    assert np.abs(turn - np.eye(dimension)).max() > 0.1
    moved = problem.lattice.positions + response.displacement
    for node in (5, 6):
        arm = problem.lattice.positions[node] - problem.lattice.positions[2]
        assert moved[node] == pytest.approx(moved[2] + turn @ arm, abs=1e-12)


@BOTH
@pytest.mark.parametrize("elements", [1, 2])
def test_a_piece_that_is_not_held_is_a_mechanism(dimension: int, elements: int) -> None:
    problem = pushed(bar(dimension), "force", 1e-3)
    cut = np.array([False, True, True, True])
    assert FrameEvaluator(problem, elements=elements).evaluate(cut).status.label == "mechanism"
    # Rollers leave a rigid motion.
    along = ["fixed_x", "fixed_y", "fixed_z"][:dimension]
    rolling = replace(problem, supports=Supports(**{name: [0] for name in along[:-1]}))
    evaluator = FrameEvaluator(rolling, elements=elements)
    assert evaluator.evaluate(all_of(rolling)).status.label == "mechanism"


@BOTH
def test_a_piece_that_hangs_from_the_drive_alone_follows_it(dimension: int) -> None:
    problem = pushed(bar(dimension), "displacement", 0.5)
    response = FrameEvaluator(problem).evaluate(np.array([False, True, True, True]))
    assert response.status.label == "converged"
    expected = np.zeros((5, dimension))
    expected[1:] = 0.5 * problem.input.direction[0]
    assert response.displacement == pytest.approx(expected, abs=1e-14)
    assert response.energy == 0.0


@BOTH
def test_an_arch_snaps_under_a_force_and_has_no_efficiency(dimension: int) -> None:
    force = {2: 2e-5, 3: 2e-6}[dimension]
    places = np.zeros((9, dimension))
    places[:, 0] = np.arange(9.0)
    places[:, 1] = 0.8 - 0.2 * np.abs(np.arange(9.0) - 4.0)
    down = -np.eye(dimension)[1]
    problem = chain(
        places,
        supports=Supports(fixed=[0, 8]),
        input=Input(nodes=[4], direction=down, drive="force", amount=force),
        output=Output(nodes=[3], direction=down),
        section=SECTION[dimension],
        material=Elasticity(1.0, 0.3),
    )
    response = FrameEvaluator(problem).evaluate(all_of(problem))
    assert response.status.label == "snapped"
    assert np.isnan(response.efficiency)
    assert 0.01 < response.reached < 0.99
    below = pushed(problem, "force", 0.95 * response.reached * force)
    assert FrameEvaluator(below).evaluate(all_of(below)).status.label == "converged"
    above = pushed(problem, "force", 1.05 * response.reached * force)
    assert FrameEvaluator(above).evaluate(all_of(above)).status.label == "snapped"


@BOTH
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("elements", [1, 4])
def test_own_weight_bends_and_stretches_a_cantilever(
    dimension: int, axis: int, elements: int
) -> None:
    if axis >= dimension:
        return
    section, count = SECTION[dimension], 4
    # The beams beyond the input are a dead end, which has weight all the same.
    problem = bar(
        dimension,
        input=Input(nodes=[1], direction=np.eye(dimension)[0], amount=1e-13, drive="force"),
    )
    weight = np.zeros(dimension)
    weight[axis] = 1e-6
    line = section.area * 1e-6
    response = FrameEvaluator(problem, elements=elements, weight=weight).evaluate(all_of(problem))
    assert response.status.label == "converged"
    if axis == 0:
        expected = line * count**2 / (2.0 * YOUNG * section.area)
    else:
        # The weight of each element acts at its ends.
        x = np.arange(count * elements + 1.0) / elements
        share = np.full(len(x), 1.0 / elements)
        share[[0, -1]] *= 0.5
        expected = line * (share * x**2 * (3.0 * count - x)).sum() / (6.0 * YOUNG * section.inertia)
        limit = line * count**4 / (8.0 * YOUNG * section.inertia)
        assert expected == pytest.approx(limit, rel=0.2 / elements**2)
    assert response.displacement[-1, axis] == pytest.approx(expected, rel=1e-6)


@BOTH
def test_own_weight_hangs_a_chain_from_the_input_too(dimension: int) -> None:
    """All of the weight is carried by the support and the input."""
    problem = pushed(bar(dimension), "displacement", 0.2)
    weight = np.zeros(dimension)
    weight[1] = -1e-3
    evaluator = FrameEvaluator(problem, elements=2, weight=weight)
    assert evaluator.evaluate(all_of(problem)).status.label == "converged"
    evaluator.strain()  # leaves the reactions in memory
    reactions = evaluator.memory.gradient[:, :dimension].sum(axis=0)
    total = 4.0 * SECTION[dimension].area * weight
    assert reactions == pytest.approx(-total, rel=1e-9, abs=1e-12)


@BOTH
@pytest.mark.parametrize("kind", ["directional", "isotropic"])
def test_an_output_spring_shares_the_load_with_the_bar(dimension: int, kind: str) -> None:
    section, spring = SECTION[dimension], 2e-5
    axis = np.eye(dimension)
    problem = bar(
        dimension,
        input=Input(nodes=[4], direction=axis[1], drive="force", amount=1e-8),
        output=Output(nodes=[3], direction=axis[0], spring=spring, spring_kind=kind),
    )
    response = FrameEvaluator(problem).evaluate(all_of(problem))
    # Deflection at 3 by unit forces at 4 and at 3.
    rigidity = 6.0 * YOUNG * section.inertia
    far, near = 3.0**2 * (3.0 * 4.0 - 3.0) / rigidity, 2.0 * 3.0**3 / rigidity
    share = spring if kind == "isotropic" else 0.0
    expected = 1e-8 * far / (1.0 + share * near)
    assert response.displacement[3, 1] == pytest.approx(expected, rel=1e-7)
    along = replace(problem, input=replace(problem.input, direction=axis[:1]))
    response = FrameEvaluator(along).evaluate(all_of(along))
    stretched = YOUNG * section.area / 3.0
    assert response.displacement[3, 0] == pytest.approx(1e-8 / (stretched + spring), rel=1e-7)


@BOTH
@pytest.mark.parametrize("elements", [1, 4])
def test_the_force_of_a_displacement_drive_gives_that_displacement(
    dimension: int, elements: int
) -> None:
    problem = pushed(bar(dimension), "displacement", 1.0)
    bent = np.array([-0.15, 1.0, 0.1][:dimension])
    given = replace(problem.input, direction=[bent / np.linalg.norm(bent)])
    problem = replace(problem, input=given)
    evaluator = FrameEvaluator(problem, elements=elements)
    moved = evaluator.evaluate(all_of(problem))
    (force,) = evaluator.strain().input_forces
    size = float(np.linalg.norm(force))
    given = replace(problem.input, drive="force", amount=size, direction=[force / size])
    loaded = FrameEvaluator(replace(problem, input=given), elements=elements)
    response = loaded.evaluate(all_of(problem))
    assert (moved.status.label, response.status.label) == ("converged", "converged")
    assert response.displacement == pytest.approx(moved.displacement, abs=1e-7)
    assert response.energy == pytest.approx(moved.energy, rel=1e-8)


@BOTH
def test_a_dead_end_carries_nothing_but_its_own_weight(dimension: int) -> None:
    plain = pushed(bar(dimension), "displacement", 0.5)
    more = np.zeros((1, dimension))
    more[0, :2] = 2.0, 1.0
    weight = np.zeros(dimension)
    weight[1] = -1e-4
    problem = with_more(plain, more, [[2, 5]])
    problem = replace(problem, loads=replace(problem.loads, weight=weight))
    evaluator = FrameEvaluator(problem)
    assert evaluator.load_bearing(all_of(problem)).tolist() == [True] * 4 + [False]
    # The weight of the dead end bends the bar nevertheless.
    with_end = evaluator.evaluate(all_of(problem)).displacement[2]
    without = evaluator.evaluate(np.arange(5) < 4).displacement[2]
    assert with_end[1] < without[1]
