"""Two-ports: the linear answers of an actuator, and what must hold of them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.machines import (
    Load,
    TwoPort,
    characterise,
    default_loads,
    mean_ports,
    ports_of,
    trace,
    two_port_at,
)
from bellcrank.mechanics import Conditions, SpringEvaluator, follow, model_evaluator
from bellcrank.model import (
    Design,
    Input,
    Lattice,
    Output,
    Problem,
    Stiffness,
    Supports,
    find_problem,
    gallery_design,
    unpack_mask,
)

NAMES = ("human:crane", "machine:crane", "human:anti-parallel", "human:pliers", "machine:discs")


def actuator(name: str) -> Design:
    kind, _, problem = name.partition(":")
    design = gallery_design(kind, problem)
    assert design is not None
    return design


def unstable_actuator() -> Design:
    """An actuator of the spring model that loses stability where its output is blocked."""
    problem = replace(
        find_problem("anti-parallel"), stiffness=Stiffness(bond=5.0, angle=0.11 / 6.0)
    )
    mask = (
        "ffffffffffffffffdfffffff2e92dfe80004e4e017d6498039fedc021909b7db2017fff688fffffff9fffff7"
    )
    return Design(problem, unpack_mask(mask, problem.lattice.beam_count))


def column(length: int, *, supports: list[int], watched: int) -> Design:
    """Beams in a row, pushed at one end along the row, watched further on."""
    problem = Problem(
        name="column",
        lattice=Lattice(
            [[float(x), 0.0] for x in range(length)], [[x, x + 1] for x in range(length - 1)]
        ),
        supports=Supports(fixed=supports),
        input=Input([0], [1.0, 0.0], "displacement", 0.01),
        output=Output([watched], [1.0, 0.0]),
        designable=[0],
    )
    return problem.full_design()


@pytest.mark.parametrize("name", NAMES)
def test_a_two_port_is_symmetric_positive_and_agrees_with_its_own_forms(name: str) -> None:
    element = mean_ports(actuator(name))
    state = element.rest()
    port = two_port_at(element, state)
    assert state.asymmetry < 1e-12
    # The stiffness form, computed with both ports held and not from the hybrid figures.
    both = element.linear(state, Conditions([True, True], np.zeros(2), np.zeros(2))).transfer()
    assert port.stiffness == pytest.approx(both, rel=1e-8, abs=1e-8 * np.abs(both).max())
    assert both == pytest.approx(both.T, rel=1e-8)
    assert np.linalg.eigvalsh(both)[0] > 0.0
    hybrid = element.linear(state, Conditions([True, False], np.zeros(2), np.zeros(2))).transfer()
    assert port.hybrid == pytest.approx(hybrid, rel=1e-8)
    # The compliance with nothing held.
    none = element.linear(state, Conditions([False, False], np.zeros(2), np.zeros(2))).transfer()
    assert none == pytest.approx(np.linalg.inv(port.stiffness), rel=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_free_efficiency_is_that_of_the_response_in_the_limit_of_small_strokes(name: str) -> None:
    design = actuator(name)
    problem = design.problem
    element = mean_ports(design)
    port = two_port_at(element, element.rest())
    small = replace(
        problem,
        input=replace(problem.input, amount=1e-6 * problem.input.amount),
        output=replace(problem.output, spring=None, spring_kind=None),
        aggregate="mean",
    )
    response = model_evaluator(small, "displacement").evaluate(design.mask)
    # The efficiency is linear in so small a stroke up to the stroke itself.
    assert port.efficiency == pytest.approx(response.efficiency, rel=1e-4)


def test_blocked_force_is_that_of_an_output_whose_nodes_are_held() -> None:
    # With one output node, holding its mean motion along a direction is a roller.
    design = actuator("human:crane")
    problem = design.problem
    node = int(problem.output.nodes[0])
    single = replace(problem, output=Output([node], [-1.0, 0.0]))
    element = mean_ports(Design(single, design.mask))
    curve = trace(element, Load("blocked"), 3)
    watched = np.setdiff1d(problem.output.nodes, [node])[:1]
    held = replace(
        problem,
        supports=replace(problem.supports, fixed_x=[node]),
        output=Output(watched, [-1.0, 0.0]),
    )
    evaluator = SpringEvaluator(held)
    response = evaluator.evaluate(design.mask)
    assert curve.energy[-1] == pytest.approx(response.energy, abs=1e-10)
    # The force on it, from the energy of the held design by moving the roller: Castigliano.
    h = 1e-4
    state = element.rest()
    energies = [
        follow(
            element,
            state,
            Conditions([True, True], [problem.input.amount, motion], np.zeros(2)),
        ).state.energy
        for motion in (h, -h)
    ]
    slope = (energies[0] - energies[1]) / (2 * h)
    assert curve.output_force[-1] == pytest.approx(slope, abs=1e-6)
    assert curve.output_force[-1] < -0.01


def test_figures_of_a_lever_with_springs_by_hand() -> None:
    # A rigid lever of ratio 2 on a joint of stiffness 3 (by input), output behind a spring of 5.
    lever = TwoPort(input_stiffness=3.0, efficiency=2.0, output_compliance=1 / 5)
    assert lever.blocked_input_stiffness == pytest.approx(3.0 + 4.0 * 5.0)
    assert lever.transmitted_stiffness == pytest.approx(10.0)
    assert lever.force_efficiency == pytest.approx(10.0 / 23.0)
    assert lever.coupling == pytest.approx(20.0 / 23.0)
    # Against a spring of 5 the output goes half as far.
    assert lever.efficiency_against(5.0) == pytest.approx(1.0)
    assert lever.input_stiffness_against(5.0) == pytest.approx(3.0 + 5.0 * 2.0)


def test_the_matched_spring_takes_the_largest_share_of_the_work() -> None:
    port = TwoPort(input_stiffness=3.0, efficiency=2.0, output_compliance=0.2)

    def share(spring: float) -> float:
        moved = port.efficiency_against(spring)
        return spring * moved**2 / port.input_stiffness_against(spring)

    best = port.matched_spring
    assert share(best) == pytest.approx(port.best_work_share)
    assert share(best) > max(share(0.99 * best), share(1.01 * best))


@pytest.mark.parametrize("left", [1e-14, 0.0, -1e-14])
def test_an_input_without_resistance_gives_all_its_work_to_the_softest_spring(left: float) -> None:
    # As a bar that hangs between its ports; rounding errors leave it some resistance, or less.
    port = TwoPort(input_stiffness=left, efficiency=1.0, output_compliance=4.0)
    assert (port.matched_spring, port.best_work_share) == (0.0, 1.0)
    assert [load.label for load in default_loads(port)] == ["free", "blocked"]


@pytest.mark.parametrize("spring", [0.0, 0.02, 0.5, 100.0])
def test_a_small_stroke_against_a_spring_is_the_load_line(spring: float) -> None:
    design = actuator("human:crane")
    small = replace(design.problem, input=replace(design.problem.input, amount=1e-6))
    element = mean_ports(Design(small, design.mask))
    port = two_port_at(element, element.rest())
    curve = trace(element, Load("spring", spring), 1)
    assert curve.efficiency[-1] == pytest.approx(port.efficiency_against(spring), rel=1e-4)
    stiffness = curve.input_force[-1] / curve.motion[-1]
    assert stiffness == pytest.approx(port.input_stiffness_against(spring), rel=1e-4)


def test_a_row_of_springs_is_the_two_port_of_the_textbook() -> None:
    # Two beams between input and output, none to a support: no force, all motion passed on.
    passing = mean_ports(column(3, supports=[], watched=2))
    with pytest.raises(InvalidSettings, match="nothing resists the output"):
        two_port_at(passing, passing.rest())
    # Four beams in a row, the last held, the output in the middle: springs of 2 k = 10 in series.
    element = mean_ports(column(5, supports=[4], watched=2))
    port = two_port_at(element, element.rest())
    assert port.efficiency == pytest.approx(0.5)
    assert port.input_stiffness == pytest.approx(10.0 / 4)
    assert port.output_stiffness == pytest.approx(10.0 / 2 + 10.0 / 2)


def test_an_output_that_nothing_connects_has_no_hybrid_form() -> None:
    design = actuator("human:crane")
    loose = Design(design.problem, design.mask & ~design.problem.lattice.beams_touching(
        design.problem.output.nodes
    ))  # fmt: skip
    found = characterise(loose, points=2)
    assert not found.rest.connected
    assert found.rest.efficiency == 0.0
    assert found.rest.stiffness[1].tolist() == [0.0, 0.0]
    assert [curve.load.label for curve in found.curves] == ["free"]
    assert "output is not connected" in found.warnings[0]
    with pytest.raises(InvalidSettings, match="no hybrid form"):
        _ = found.rest.hybrid
    assert found.rest.efficiency_against(0.0) == 0.0
    assert math.isinf(found.rest.output_compliance)
    with pytest.raises(InvalidSettings, match="load blocked: expected free"):
        characterise(loose, [Load("blocked")], 2)


def test_an_input_that_turns_about_itself_is_refused() -> None:
    design = column(3, supports=[2], watched=1)
    alone = Design(design.problem, np.array([False, True]))
    with pytest.raises(InvalidSettings, match="nothing resists the input"):
        mean_ports(alone)


def test_ports_say_where_they_are() -> None:
    given, wanted = ports_of(actuator("human:crane"))
    assert given.direction.tolist() == [0.0, -1.0]
    assert wanted.direction.tolist() == [-1.0, 0.0]
    assert wanted.centre[0] < given.centre[0]
    assert len(given.nodes) == 10
