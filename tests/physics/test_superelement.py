"""Superelements against dense algebra, finite differences and responses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import (
    Conditions,
    Coupling,
    LinearEquations,
    SpringEvaluator,
    State,
    Status,
    Superelement,
    follow,
    free_nodes,
    strain_of,
    uniform_motion,
)
from bellcrank.model import Design, Output, Problem, find_problem, gallery_design

from .problems import arm_on, frame, patch, random_masks
from .test_snapping import buckling_shortening, column
from .twin import Twin, free_coordinates, stiffness


def free_ports(problem: Problem) -> list[Coupling]:
    return [free_nodes(problem.input.nodes), free_nodes(problem.output.nodes)]


def pushed(design: Design) -> Superelement:
    """The input moves uniformly; the second coordinate is the mean motion of the output."""
    given, wanted = design.problem.input, design.problem.output
    measures = np.zeros((2, 1 + 2 * len(wanted.nodes)))
    measures[0, 0] = 1.0
    measures[1, 1:] = wanted.direction.ravel() / len(wanted.nodes)
    return Superelement(
        design, [uniform_motion(given.nodes, given.direction), free_nodes(wanted.nodes)], measures
    )


def given(first: float, *, blocked: bool = False, second: float = 0.0) -> Conditions:
    return Conditions([True, blocked], [first, second], [0.0, 0.0])


def wide_patch() -> Problem:
    """A patch whose ports have three and two nodes."""
    problem = patch()
    return replace(
        problem,
        input=replace(problem.input, nodes=[16, 17], direction=[0.0, -1.0]),
        output=Output([9, 13], [-1.0, 0.0]),
        designable=None,
    )


def designs() -> list[Design]:
    problem = wide_patch()
    return [Design(problem, mask) for mask in random_masks(problem, 0.7, 6, seed=3)]


def moved_states(element: Superelement, seed: int = 0) -> list[State]:
    """Equilibria at rest and at some places with all coordinates prescribed."""
    rng = np.random.default_rng(seed)
    count = len(element.measures)
    states = [element.rest()]
    for _ in range(2):
        target = rng.uniform(-0.1, 0.1, count)
        asked = Conditions(np.ones(count, dtype=bool), target, np.zeros(count))
        arrival = follow(element, states[-1], asked)
        assert arrival.status is Status.CONVERGED
        states.append(arrival.state)
    return states


def connected(design: Design) -> bool:
    return bool(Superelement(design, free_ports(design.problem)).reached.all())


@pytest.mark.parametrize("index", range(6))
def test_condensation_is_the_schur_complement_of_the_twins_dense_stiffness(index: int) -> None:
    design = designs()[index]
    ports = np.concatenate([design.problem.input.nodes, design.problem.output.nodes])
    element = Superelement(design, [free_nodes(ports)])
    active = element.active
    u = 0.02 * np.random.default_rng(index).standard_normal((len(active), 2))
    u *= (element.model.system.block >= 0)[:, None] * active[:, None]
    found = element.condense(u)
    undriven = replace(design.problem, input=replace(design.problem.input, drive="force"))
    twin = Twin(undriven, design.mask)
    free = free_coordinates(undriven, active)
    dense = stiffness(twin, u, free)
    kept = np.isin(free // 2, ports)
    inside = np.linalg.inv(dense[np.ix_(~kept, ~kept)])
    across = dense[np.ix_(kept, ~kept)]
    schur = dense[np.ix_(kept, kept)] - across @ inside @ across.T
    gradient = twin.gradient(u).ravel()[free]
    force = gradient[kept] - across @ inside @ gradient[~kept]
    order = np.argsort((2 * ports[:, None] + [0, 1]).ravel())
    live = element.reached[order]
    assert found is not None
    assert found.stiffness[np.ix_(order, order)][np.ix_(live, live)] == pytest.approx(
        schur, abs=2e-7 * np.abs(schur).max()
    )
    assert found.force[order][live] == pytest.approx(force, abs=2e-7)


@pytest.mark.parametrize("index", range(6))
def test_stiffness_is_symmetric_and_positive_semidefinite_at_rest(index: int) -> None:
    design = designs()[index]
    state = Superelement(design, free_ports(design.problem)).rest()
    assert state.asymmetry < 1e-13
    values = np.linalg.eigvalsh(state.stiffness)
    assert values[0] > -1e-12 * values[-1]


@pytest.mark.parametrize("index", range(6))
def test_force_is_the_derivative_of_the_energy_and_stiffness_that_of_the_force(index: int) -> None:
    design = designs()[index]
    if not connected(design):
        pytest.skip("this random design has a loose port")
    element = Superelement(design, free_ports(design.problem))
    count = len(element.measures)
    held = np.ones(count, dtype=bool)
    h = 1e-4
    for state in moved_states(element):
        energies, forces = [], []
        for coordinate in range(count):
            beside = []
            for sign in (1.0, -1.0):
                value = state.coordinates + sign * h * np.eye(count)[coordinate]
                beside.append(
                    follow(element, state, Conditions(held, value, np.zeros(count))).state
                )
            energies.append((beside[0].energy - beside[1].energy) / (2 * h))
            forces.append((beside[0].force - beside[1].force) / (2 * h))
        assert state.force == pytest.approx(np.array(energies), abs=1e-6)
        assert state.stiffness == pytest.approx(np.array(forces), abs=1e-5)


@pytest.mark.parametrize(
    "name", ["human:crane", "human:anti-parallel", "full:discs", "full:scaling-8"]
)
def test_a_free_output_moves_as_in_the_response_along_the_whole_stroke(name: str) -> None:
    kind, _, problem_name = name.partition(":")
    full = find_problem(problem_name).full_design()
    design = full if kind == "full" else gallery_design(kind, problem_name)
    element = pushed(design)
    state = element.rest()
    for part in (0.01, 0.25, 0.5, 0.75, 1.0):
        amount = part * design.problem.input.amount
        arrival = follow(element, state, given(amount))
        state = arrival.state
        stroke = replace(design.problem, input=replace(design.problem.input, amount=amount))
        evaluator = SpringEvaluator(stroke)
        response = evaluator.evaluate(design.mask)
        assert arrival.status is response.status is Status.CONVERGED
        assert state.coordinates[1] / amount == pytest.approx(response.efficiency, abs=1e-8)
        assert state.energy == pytest.approx(response.energy, abs=1e-10)
        assert state.force[0] == pytest.approx(strain_of(evaluator).input_force, abs=1e-8)


def test_an_output_that_is_held_is_a_support() -> None:
    design = gallery_design("human", "crane")
    problem = design.problem
    element = Superelement(
        design,
        [uniform_motion(problem.input.nodes, problem.input.direction), free_ports(problem)[1]],
    )
    count = len(element.measures)
    amount = problem.input.amount
    asked = Conditions(np.ones(count, dtype=bool), amount * np.eye(count)[0], np.zeros(count))
    state = follow(element, element.rest(), asked).state
    taken = np.concatenate([problem.input.nodes, problem.output.nodes, problem.supports.nodes])
    watched = np.setdiff1d(problem.lattice.beams[design.mask].ravel(), taken)[:1]
    held = replace(
        problem,
        supports=replace(
            problem.supports, fixed=np.union1d(problem.supports.fixed, problem.output.nodes)
        ),
        output=Output(watched, [-1.0, 0.0]),
    )
    evaluator = SpringEvaluator(held)
    response = evaluator.evaluate(design.mask)
    assert response.status is Status.CONVERGED
    assert state.energy == pytest.approx(response.energy, abs=1e-10)
    assert state.force[0] == pytest.approx(strain_of(evaluator).input_force, abs=1e-8)
    assert np.abs(state.force[1:]).max() > 0.01


def test_turning_and_shifting_everything_rigidly_costs_nothing() -> None:
    # Two beams without supports: both ends move as one rigid body.
    problem = frame(
        [(0, 0), (1, 0), (2, 0), (0, 1)],
        [(0, 1), (1, 2), (0, 3), (1, 3)],
        fixed=[],
        drive=(0, (0.0, 1.0), 0.1),
        watch=(2, (0.0, 1.0)),
    )
    problem = replace(
        problem,
        input=replace(problem.input, nodes=[0, 3], direction=[0.0, 1.0]),
        designable=[0],
    )
    rest = problem.lattice.positions
    element = Superelement(problem.full_design(), [free_nodes(np.array([0, 3, 2]))])
    angle = 0.6
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    target = (rest @ turn.T + [0.3, -0.2] - rest)[[0, 3, 2]].ravel()
    asked = Conditions(np.ones(6, dtype=bool), target, np.zeros(6))
    state = follow(element, element.rest(), asked).state
    assert state.energy == pytest.approx(0.0, abs=1e-20)
    assert state.force == pytest.approx(np.zeros(6), abs=1e-10)
    # Only the rigid motions are free of stress: three zero stiffnesses.
    assert np.sum(np.linalg.eigvalsh(element.rest().stiffness) < 1e-12) == 3


def test_work_at_the_ports_is_the_stored_energy() -> None:
    design = gallery_design("human", "crane")
    element = Superelement(design, free_ports(design.problem))
    state = element.rest()
    count = len(element.measures)
    target = np.random.default_rng(4).uniform(-0.1, 0.1, count)
    work = 0.0
    for part in np.linspace(0.0, 1.0, 41)[1:]:
        # Path work by Simpson's rule, whose error falls with the fourth power of the increment.
        middle, end = (
            follow(
                element,
                state,
                Conditions(np.ones(count, dtype=bool), fraction * target, np.zeros(count)),
            ).state
            for fraction in (part - 1 / 80, part)
        )
        step = end.coordinates - state.coordinates
        work += float(step @ (state.force + 4.0 * middle.force + end.force)) / 6.0
        state = end
    assert work == pytest.approx(state.energy, rel=1e-8)


def test_forces_and_motions_are_reciprocal() -> None:
    # Maxwell and Betti: what a force at one coordinate does at another, that one does here,
    # also in a deformed state.
    design = gallery_design("human", "crane")
    element = Superelement(design, free_ports(design.problem))
    count = len(element.measures)
    load = np.random.default_rng(5).uniform(-0.03, 0.03, count)
    loaded = Conditions(np.zeros(count, dtype=bool), load, np.zeros(count))
    state = follow(element, element.rest(), loaded).state
    h = 1e-5
    compliance = np.array(
        [
            (
                follow(element, state, replace(loaded, value=loaded.value + h * unit)).state
                .coordinates
                - follow(element, state, replace(loaded, value=loaded.value - h * unit)).state
                .coordinates
            )
            / (2.0 * h)
            for unit in np.eye(count)
        ]
    )  # fmt: skip
    assert compliance == pytest.approx(compliance.T, rel=1e-5, abs=1e-5 * compliance.max())
    assert compliance == pytest.approx(element.linear(state, loaded).transfer(), rel=1e-4, abs=1e-4)


def test_a_column_loses_its_stability_where_it_buckles() -> None:
    critical = buckling_shortening(0.1)
    problem = column(1.3 * critical)
    free = Superelement(
        problem.full_design(), [uniform_motion(problem.input.nodes, problem.input.direction)]
    )
    steps = [
        follow(free, free.rest(), Conditions([True], [part * critical], [0.0]))
        for part in (0.98, 1.3)
    ]
    assert [arrival.status for arrival in steps] == [Status.CONVERGED, Status.SNAPPED]
    # It stays straight by symmetry, and stops right where the straight state becomes unstable.
    reached = steps[1].state.coordinates[0]
    assert reached == pytest.approx(critical, rel=3e-3)
    assert steps[1].fraction * 1.3 * critical == pytest.approx(reached)


def test_holding_the_middle_keeps_a_column_from_buckling() -> None:
    critical = buckling_shortening(0.1)
    problem = column(1.3 * critical)
    element = pushed(problem.full_design())
    assert follow(element, element.rest(), given(1.3 * critical)).status is Status.SNAPPED
    held = follow(element, element.rest(), given(1.3 * critical, blocked=True))
    assert held.status is Status.CONVERGED
    # And letting go of what is unstable is refused.
    with pytest.raises(InvalidSettings, match="nothing resists"):
        follow(element, held.state, given(1.3 * critical))


def test_a_spring_is_between_free_and_blocked_and_pulls_back() -> None:
    design = gallery_design("human", "crane")
    element = pushed(design)
    amount = design.problem.input.amount
    moved = []
    for spring in (0.0, 0.05, 0.5, 50.0):
        asked = Conditions([True, False], [amount, 0.0], [0.0, spring])
        state = follow(element, element.rest(), asked).state
        assert state.force[1] == pytest.approx(-spring * state.coordinates[1], abs=1e-9)
        moved.append(state.coordinates[1])
    assert moved == sorted(moved, reverse=True)
    assert moved[-1] < 0.01 * moved[0]
    dead = Conditions([True, False], [amount, state.force[1]], [0.0, 0.0])
    weight = follow(element, element.rest(), dead).state
    assert weight.coordinates[1] == pytest.approx(moved[-1], abs=1e-9)


def test_an_output_that_nothing_connects_stays_at_rest() -> None:
    problem = wide_patch()
    mask = ~problem.lattice.beams_touching(problem.output.nodes)
    element = pushed(Design(problem, mask))
    assert element.reached.tolist() == [True, False]
    arrival = follow(element, element.rest(), given(0.2))
    assert arrival.state.coordinates.tolist() == pytest.approx([0.2, 0.0])
    with pytest.raises(InvalidSettings, match="coordinate 1 cannot be moved"):
        follow(element, element.rest(), given(0.2, blocked=True))


def test_what_hangs_loose_between_its_ports_is_refused() -> None:
    roller = arm_on(fixed_x=[0])
    with pytest.raises(InvalidSettings, match="rigid-body motion, even while its ports are held"):
        Superelement(roller.full_design(), [free_nodes(np.array([3]))])
    problem = arm_on()
    hanging = Superelement(problem.full_design(), [free_nodes(np.array([3]))])
    assert not hanging.reached.any()
    both = Superelement(
        problem.full_design(), [free_nodes(np.array([3])), free_nodes(np.array([2]))]
    )
    assert np.linalg.eigvalsh(both.rest().stiffness)[0] == pytest.approx(0.0, abs=1e-12)
    alone = Conditions([True, True, False, False], np.zeros(4), np.zeros(4))
    with pytest.raises(InvalidSettings, match="nothing resists"):
        follow(both, both.rest(), alone)


@pytest.mark.parametrize(
    ("nodes", "message"),
    [
        ([0], "which is held by a support"),
        ([-1], "which does not exist"),
        ([99], "which does not exist"),
        ([5, 5], "expected each node once"),
    ],
)
def test_only_free_nodes_can_be_boundary_nodes(nodes: list[int], message: str) -> None:
    with pytest.raises(InvalidSettings, match=message):
        Superelement(patch().full_design(), [free_nodes(np.array(nodes))])


def test_conditions_that_make_no_sense_are_refused() -> None:
    with pytest.raises(InvalidSettings, match="three arrays of one shape"):
        Conditions([True], [0.0, 1.0], [0.0])
    with pytest.raises(InvalidSettings, match="finite"):
        Conditions([True], [np.nan], [0.0])
    with pytest.raises(InvalidSettings, match="springs"):
        Conditions([False], [0.0], [-1.0])
    with pytest.raises(InvalidSettings, match="springs"):
        Conditions([True], [0.0], [1.0])
    design = patch().full_design()
    with pytest.raises(InvalidSettings, match=r"measures: expected shape \(k, 2\)"):
        Superelement(design, [free_nodes(np.array([5]))], np.ones((1, 3)))
    with pytest.raises(InvalidSettings, match="unloaded_beams"):
        Superelement(design, [free_nodes(np.array([5]))], None, "some")  # type: ignore[arg-type]
    element = Superelement(design, [free_nodes(np.array([5]))])
    with pytest.raises(InvalidSettings, match="one for each of 2 coordinates, got 1"):
        follow(element, element.rest(), Conditions([True], [0.0], [0.0]))


def test_a_transfer_matrix_says_what_each_condition_does() -> None:
    stiffness_ = np.array([[3.0, -1.0], [-1.0, 2.0]])
    every = [Conditions(which, [0.0, 0.0], [0.0, 0.0]) for which in ([1, 1], [0, 0], [1, 0])]
    whole, compliance, hybrid = (
        LinearEquations(stiffness_, np.eye(2), one).transfer() for one in every
    )
    assert whole == pytest.approx(stiffness_)
    assert compliance == pytest.approx(np.linalg.inv(stiffness_))
    # F1 = (3 - 1/2) u1 - F2/2,  u2 = u1/2 + F2/2.
    assert hybrid == pytest.approx(np.array([[2.5, -0.5], [0.5, 0.5]]))
