"""Superelements of frames against dense algebra, finite differences, closed forms and responses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bellcrank.mechanics import (
    Conditions,
    FrameEvaluator,
    PathEnd,
    State,
    Status,
    Superelement,
    follow,
    free_nodes,
    uniform_motion,
)
from bellcrank.mechanics.frames.beams import bow_coefficients
from bellcrank.model import Design, Elasticity, Output, Problem, Section, gallery_design
from bellcrank.part import PartSpec, frame_problem

from .frames import Equilibrium, equilibrium, frame_of, random_frame
from .problems import frame, patch, random_masks

PLANE = 3
"""Unknowns of a node in the plane."""
SPACE = 6
TURNED = np.array([3, 12])
"""Nodes of a frame in space whose displacements and rotations are prescribed."""


def wide_patch() -> Problem:
    """A patch of frames whose ports have three and two nodes."""
    problem = patch()
    ports = replace(
        problem,
        input=replace(problem.input, nodes=[16, 17], direction=[0.0, -1.0]),
        output=Output([9, 13], [-1.0, 0.0]),
        designable=None,
    )
    return frame_problem(ports, PartSpec())


def designs() -> list[Design]:
    problem = wide_patch()
    return [Design(problem, mask) for mask in random_masks(problem, 0.8, 4, seed=3)]


def welded(design: Design) -> Superelement:
    """All unknowns of the port nodes, rotations included."""
    problem = design.problem
    ports = (problem.input.nodes, problem.output.nodes)
    return Superelement(design, [free_nodes(nodes, PLANE) for nodes in ports])


def moved_states(element: Superelement) -> list[State]:
    """Equilibria at rest and at two places with all coordinates prescribed."""
    rng = np.random.default_rng(1)
    count = len(element.measures)
    states = [element.rest()]
    for _ in range(2):
        target = rng.uniform(-0.05, 0.05, count)
        asked = Conditions(np.ones(count, dtype=bool), target, np.zeros(count))
        arrival = follow(element, states[-1], asked)
        assert arrival.status is Status.CONVERGED
        states.append(arrival.state)
    return states


@pytest.mark.parametrize("index", range(4))
def test_condensation_is_the_schur_complement_of_the_whole_stiffness(index: int) -> None:
    design = designs()[index]
    problem = design.problem
    free = np.setdiff1d(np.arange(problem.lattice.node_count), problem.supports.nodes)
    whole = Superelement(design, [free_nodes(free, PLANE)])
    ports = np.concatenate([problem.input.nodes, problem.output.nodes])
    element = welded(design)
    state = moved_states(element)[-1]
    found = element.condense(state.displacement)
    dense = whole.condense(state.displacement)
    assert found is not None
    assert dense is not None
    live = whole.measures.any(axis=1)
    kept = np.isin(np.repeat(free, PLANE), ports)
    order = [
        int(np.flatnonzero(free == node)[0]) * PLANE + axis
        for node in ports
        for axis in range(PLANE)
    ]
    inside = live & ~kept
    across = dense.stiffness[np.ix_(order, inside)]
    inverse = np.linalg.inv(dense.stiffness[np.ix_(inside, inside)])
    schur = dense.stiffness[np.ix_(order, order)] - across @ inverse @ across.T
    reached = element.reached
    assert found.stiffness[np.ix_(reached, reached)] == pytest.approx(
        schur[np.ix_(reached, reached)], abs=1e-9 * np.abs(schur).max()
    )
    assert found.force == pytest.approx(dense.force[order] * reached, abs=1e-9)


@pytest.mark.parametrize("index", range(4))
def test_force_is_the_derivative_of_the_energy_and_stiffness_that_of_the_force(index: int) -> None:
    element = welded(designs()[index])
    count = len(element.measures)
    held, h = np.ones(count, dtype=bool), 1e-4
    for state in moved_states(element):
        for coordinate in np.flatnonzero(element.reached):
            beside = []
            for sign in (1.0, -1.0):
                value = state.coordinates + sign * h * np.eye(count)[coordinate]
                beside.append(
                    follow(element, state, Conditions(held, value, np.zeros(count))).state
                )
            energy = (beside[0].energy - beside[1].energy) / (2 * h)
            force = (beside[0].force - beside[1].force) / (2 * h)
            assert state.force[coordinate] == pytest.approx(energy, abs=1e-5)
            assert state.stiffness[coordinate] == pytest.approx(force, abs=1e-3)


@pytest.mark.parametrize("name", ["human:crane", "machine:crane"])
def test_a_free_output_moves_as_in_the_response_along_the_whole_stroke(name: str) -> None:
    kind, _, problem_name = name.partition(":")
    springs = gallery_design(kind, problem_name)
    design = replace(springs, problem=frame_problem(springs.problem, PartSpec()))
    given, wanted = design.problem.input, design.problem.output
    measures = np.zeros((2, 1 + 2 * len(wanted.nodes)))
    measures[0, 0] = 1.0
    measures[1, 1:] = wanted.direction.ravel() / len(wanted.nodes)
    element = Superelement(
        design, [uniform_motion(given.nodes, given.direction), free_nodes(wanted.nodes)], measures
    )
    state = element.rest()
    for part in (0.25, 0.5, 1.0):
        amount = part * given.amount
        asked = Conditions([True, False], [amount, 0.0], [0.0, 0.0])
        arrival = follow(element, state, asked)
        state = arrival.state
        stroke = replace(design.problem, input=replace(given, amount=amount))
        evaluator = FrameEvaluator(stroke)
        response = evaluator.evaluate(design.mask)
        assert arrival.status is response.status is Status.CONVERGED
        assert state.coordinates[1] / amount == pytest.approx(response.efficiency, abs=1e-7)
        assert state.energy == pytest.approx(response.energy, abs=1e-9)
        assert state.force[0] == pytest.approx(evaluator.strain().input_force, abs=1e-7)


def test_turning_and_shifting_everything_rigidly_costs_nothing() -> None:
    design = designs()[0]
    problem = replace(design.problem, supports=replace(design.problem.supports, fixed=[]))
    # Nodes that were supports are free: every port node turns with the piece.
    ports = np.concatenate([problem.input.nodes, problem.output.nodes])
    element = Superelement(problem.full_design(), [free_nodes(ports, PLANE)])
    rest = problem.lattice.positions
    angle = 0.6
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    shift = (rest @ turn.T + [0.3, -0.2] - rest)[ports]
    target = np.column_stack([shift, np.full(len(ports), angle)]).ravel()
    count = len(target)
    asked = Conditions(np.ones(count, dtype=bool), target, np.zeros(count))
    state = follow(element, element.rest(), asked).state
    assert state.energy == pytest.approx(0.0, abs=1e-18)
    assert state.force == pytest.approx(np.zeros(count), abs=1e-9)
    values = np.linalg.eigvalsh(element.rest().stiffness)
    assert np.sum(values < 1e-10 * values[-1]) == 3


def test_a_moment_bends_a_cantilever_into_an_arc() -> None:
    # theta = M L / (E I); the tip of the circular arc is at (sin(theta), 1 - cos(theta)) / theta.
    elements = 64
    problem = frame(
        [(float(x) / elements, 0.0) for x in range(elements + 1)],
        [(x, x + 1) for x in range(elements)],
        fixed=[0],
        drive=(elements, (0.0, 1.0), 0.1),
        watch=(elements - 1, (0.0, 1.0)),
    )
    section = Section(0.005, 0.5)
    bar = replace(problem, section=section, material=Elasticity(young=1e6, poisson=0.3))
    element = Superelement(bar.full_design(), [free_nodes(np.array([elements]), PLANE)])
    theta = 1.0
    moment = theta * 1e6 * section.inertia
    asked = Conditions(np.zeros(3, dtype=bool), [0.0, 0.0, moment], np.zeros(3))
    x, y, turn = follow(element, element.rest(), asked).state.coordinates
    assert turn == pytest.approx(theta, rel=1e-9)
    # Each of the chords is shorter than its arc by (theta / n)^2 / 24.
    assert x == pytest.approx(np.sin(theta) - 1.0, rel=1e-4)
    assert y == pytest.approx(1.0 - np.cos(theta), rel=1e-4)


def turned(seed: int) -> tuple[Superelement, PathEnd, np.ndarray]:
    """A frame in space with prescribed displacements and rotations of two nodes, (2, 6)."""
    problem = random_frame(seed)
    element = Superelement(problem.full_design(), [free_nodes(TURNED, SPACE)])
    rng = np.random.default_rng(seed)
    motion = np.hstack([rng.uniform(-0.2, 0.2, (2, 3)), rng.uniform(-0.6, 0.6, (2, 3))])
    asked = Conditions(np.ones(2 * SPACE, dtype=bool), motion.ravel(), np.zeros(2 * SPACE))
    return element, follow(element, element.rest(), asked), motion


def driven(problem: Problem, motion: np.ndarray) -> Equilibrium:
    """The response of the whole frame to the same motion as its drive."""
    count = problem.lattice.node_count
    held = np.zeros((count, SPACE), dtype=bool)
    held[problem.supports.fixed] = held[TURNED] = True
    whole = frame_of(problem, held=held)
    prescribed, grounded = np.zeros(count, np.uint8), whole.grounded.copy()
    prescribed[TURNED], grounded[TURNED] = 1, 0
    drive = np.zeros((count, SPACE))
    drive[TURNED] = motion
    return equilibrium(
        replace(
            whole,
            prescribed=prescribed,
            grounded=grounded,
            drive=drive,
            load=np.zeros_like(whole.load),
            bow=bow_coefficients(whole.rest_length, np.zeros((len(whole.rest_length), 2))),
        )
    )


@pytest.mark.parametrize("seed", [0, 2, 3])
def test_prescribed_rotations_in_space_move_a_frame_as_its_drive_does(seed: int) -> None:
    element, arrival, motion = turned(seed)
    whole, state = driven(element.design.problem, motion), arrival.state
    assert arrival.status.label == whole.status == "converged"
    assert np.abs(motion[:, 3:]).max() > 0.3
    assert state.displacement[:, :3] == pytest.approx(whole.u, abs=1e-9)
    same = np.abs((state.displacement[:, 3:] * whole.q).sum(axis=1))
    assert same == pytest.approx(np.ones(len(same)), abs=1e-12)
    size = np.abs(whole.force[TURNED]).max()
    assert state.force == pytest.approx(whole.force[TURNED].ravel(), abs=1e-8 * size)
    assert state.energy == pytest.approx(whole.energy, rel=1e-9)


def test_prescribed_rotations_in_space_lose_stability_where_the_whole_frame_does() -> None:
    element, arrival, motion = turned(1)
    whole = driven(element.design.problem, motion)
    assert arrival.status.label == whole.status == "snapped"
    assert 0.0 < arrival.fraction == pytest.approx(whole.reached, abs=0.01)


def test_moments_in_space_are_the_derivative_of_the_energy() -> None:
    element, arrival, _ = turned(3)
    state = arrival.state
    found = element.condense(state.displacement)
    assert found is not None
    h = 1e-5
    for coordinate, step in enumerate(h * np.eye(2 * SPACE)):
        plus, minus = (
            element.energy(element.moved(state.displacement, found.response(sign * step)))
            for sign in (1.0, -1.0)
        )
        derivative = (plus - minus) / (2.0 * h)
        assert state.force[coordinate] == pytest.approx(derivative, abs=1e-8)


def test_condensation_in_space_is_the_schur_complement_of_the_whole_stiffness() -> None:
    element, arrival, _ = turned(3)
    state, problem = arrival.state, element.design.problem
    free = np.setdiff1d(np.arange(problem.lattice.node_count), problem.supports.nodes)
    whole = Superelement(element.design, [free_nodes(free, SPACE)])
    found, dense = element.condense(state.displacement), whole.condense(state.displacement)
    assert found is not None
    assert dense is not None
    kept = np.isin(np.repeat(free, SPACE), TURNED)
    inside = whole.measures.any(axis=1) & ~kept
    across = dense.stiffness[np.ix_(kept, inside)]
    inverse = np.linalg.inv(dense.stiffness[np.ix_(inside, inside)])
    schur = dense.stiffness[np.ix_(kept, kept)] - across @ inverse @ across.T
    assert found.stiffness == pytest.approx(schur, abs=1e-10 * np.abs(schur).max())
    assert found.force == pytest.approx(dense.force[kept], abs=1e-10)
