"""Along the stroke, against loads: forces, energy, efficiency, loss of stability."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.machines import (
    INPUT,
    OUTPUT,
    Load,
    characterise,
    default_loads,
    mean_ports,
    trace,
    two_port_at,
)
from bellcrank.mechanics import Conditions, SpringEvaluator, Status, follow, model_evaluator
from bellcrank.model import Design

from .test_two_port import actuator, unstable_actuator


@pytest.mark.parametrize(
    "name",
    [
        "human:crane",
        "machine:crane",
        "machine:anti-parallel",
        "machine:scaling-8",
        "human:orthogonal",
    ],
)
def test_a_free_curve_is_that_of_the_responses(name: str) -> None:
    design = actuator(name)
    curve = trace(mean_ports(design), Load("free"), 5)
    assert curve.status is Status.CONVERGED
    assert curve.reached == 1.0
    for number, motion in enumerate(curve.motion[1:], start=1):
        stroke = replace(design.problem, input=replace(design.problem.input, amount=motion))
        evaluator = model_evaluator(stroke)
        response = evaluator.evaluate(design.mask)
        assert curve.efficiency[number] == pytest.approx(response.efficiency, abs=1e-8)
        assert curve.energy[number] == pytest.approx(response.energy, abs=1e-10)
        force = evaluator.strain().input_force
        assert curve.input_force[number] == pytest.approx(force, abs=1e-8)


def test_a_force_driven_curve_goes_up_to_the_whole_force() -> None:
    design = actuator("human:pliers")
    problem = design.problem
    bare = replace(problem, output=replace(problem.output, spring=None, spring_kind=None))
    curve = trace(mean_ports(design), Load("free"), 4)
    total = problem.input.amount * len(problem.input.nodes)
    assert curve.input_force == pytest.approx(total * np.linspace(0.0, 1.0, 5), abs=1e-12)
    response = SpringEvaluator(bare, "displacement").evaluate(design.mask)
    given = (response.displacement[problem.input.nodes] * problem.input.direction).sum()
    wanted = (response.displacement[problem.output.nodes] * problem.output.direction).sum()
    assert curve.motion[-1] == pytest.approx(given / len(problem.input.nodes), abs=1e-9)
    assert curve.output[-1] == pytest.approx(wanted / len(problem.output.nodes), abs=1e-9)


@pytest.mark.parametrize(
    "load", [Load("free"), Load("blocked"), Load("spring", 0.1), Load("force", -0.03)]
)
def test_the_work_at_both_ports_is_the_energy(load: Load) -> None:
    curve = trace(mean_ports(actuator("human:crane")), load, 40)
    middle = slice(2, None, 2), slice(1, None, 2), slice(0, -1, 2)

    def work(force: np.ndarray, motion: np.ndarray) -> float:
        """By Simpson's rule on pairs of increments, equal in the motion of the input."""
        last, between, first = (force[part] for part in middle)
        slope = np.gradient(motion, edge_order=2)
        last_, between_, first_ = (slope[part] for part in middle)
        return float((last * last_ + 4.0 * between * between_ + first * first_).sum()) / 3.0

    total = work(curve.input_force, curve.motion) + work(curve.output_force, curve.output)
    stored = curve.energy[-1] - curve.energy[0]
    # Differences of the output's motion are of second order in 1/40.
    assert total == pytest.approx(stored, rel=1e-3)
    if load.kind in ("free", "blocked"):
        assert total == pytest.approx(stored, rel=1e-6)


def test_a_dead_force_is_put_on_before_the_stroke() -> None:
    element = mean_ports(actuator("human:crane"))
    port = two_port_at(element, element.rest())
    curve = trace(element, Load("force", -1e-4), 2)
    assert curve.motion[0] == pytest.approx(0.0, abs=1e-15)
    assert curve.output[0] == pytest.approx(-1e-4 * port.output_compliance, rel=1e-3)
    assert curve.output_force == pytest.approx(-1e-4 * np.ones(3), abs=1e-12)
    free = trace(element, Load("free"), 2)
    # So small a force changes nothing but where the stroke begins.
    assert curve.efficiency[-1] == pytest.approx(free.efficiency[-1], rel=1e-3)
    assert np.isnan(curve.efficiency[0])


def test_a_loss_of_stability_ends_the_curve_and_is_said() -> None:
    design = unstable_actuator()
    found = characterise(design, [Load("blocked")], 10)
    curve = found.curves[0]
    assert curve.status is Status.SNAPPED
    assert 0.4 < curve.reached < 0.5
    assert len(curve.motion) == 6
    assert curve.motion[-1] == pytest.approx(curve.reached * design.problem.input.amount)
    assert found.warnings == (f"blocked: stability is lost at {curve.reached:.1%} of the stroke",)
    # The lowest stiffness is about to vanish there: it falls with a vertical tangent.
    element = mean_ports(design)
    held = Conditions([True, True], np.zeros(2), np.zeros(2))
    beyond = Conditions([True, True], [1.05 * curve.motion[-1], 0.0], np.zeros(2))
    arrival = follow(element, element.rest(), beyond)
    at_rest = element.linear(element.rest(), held).lowest()[0]
    assert arrival.status is Status.SNAPPED
    assert element.linear(arrival.state, held).lowest()[0] < 0.25 * at_rest


def test_finer_increments_lose_stability_at_the_same_place() -> None:
    element = mean_ports(unstable_actuator())
    coarse, fine = (trace(element, Load("blocked"), points) for points in (5, 60))
    assert coarse.reached == pytest.approx(fine.reached, abs=2e-3)


def test_tangents_along_the_stroke_are_differences_of_the_curve() -> None:
    design = actuator("human:crane")
    element = mean_ports(design)
    h = 1e-4
    where = 0.6 * design.problem.input.amount

    def state(motion: float, force: float):
        asked = Conditions([True, False], [motion, force], np.zeros(2))
        return follow(element, element.rest(), asked).state

    port = two_port_at(element, state(where, -0.01))
    ahead, behind = (state(where + sign * h, -0.01) for sign in (1, -1))
    more, less = (state(where, -0.01 + sign * h) for sign in (1, -1))
    by_motion = [
        (ahead.force - behind.force)[INPUT],
        (ahead.coordinates - behind.coordinates)[OUTPUT],
    ]
    by_force = [(more.force - less.force)[INPUT], (more.coordinates - less.coordinates)[OUTPUT]]
    differences = np.array([by_motion, by_force]).T / (2 * h)
    assert port.hybrid == pytest.approx(differences, abs=1e-5)


def test_default_loads_are_free_blocked_and_matched() -> None:
    element = mean_ports(actuator("human:crane"))
    port = two_port_at(element, element.rest())
    labels = [load.label for load in default_loads(port)]
    assert labels == ["free", "blocked", f"spring:{port.matched_spring:.3g}"]
    assert [Load.read(label) for label in labels] == list(default_loads(port))


def test_a_response_that_could_go_elsewhere_is_a_doubt() -> None:
    # Nothing of the kind in designs that come along: their free curves are beyond doubt.
    for name in ("human:crane", "machine:crane", "machine:discs"):
        assert characterise(actuator(name), [Load("free")], 3).warnings == ()


@pytest.mark.parametrize(
    ("changes", "warning"),
    [
        ({"status": Status.SNAPPED}, f"free: {Status.SNAPPED.message}"),
        ({"displacement": 1.001}, "free: the curve ends on another branch than the response"),
        ({"displacement": 1.0 + 1e-8}, None),
    ],
)
def test_where_the_response_goes_elsewhere_it_is_said(
    changes: dict[str, Any], warning: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    design = actuator("human:crane")
    response = SpringEvaluator(design.problem).evaluate(design.mask)
    if "displacement" in changes:
        changes = {"displacement": changes["displacement"] * response.displacement}
    found = replace(response, **changes)
    monkeypatch.setattr(SpringEvaluator, "evaluate", lambda *_arguments: found)
    warnings = characterise(design, [Load("free")], 3).warnings
    assert warnings == (() if warning is None else (warning,))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("heavy", "expected free, blocked, spring:STIFFNESS or force:FORCE"),
        ("spring", "expected free, blocked"),
        ("free:1", "expected free, blocked"),
        ("spring:stiff", "expected a number, got 'stiff'"),
        ("spring:-1", "for a spring at least 0"),
        ("force:nan", "expected a finite number"),
        ("force:", "expected a number"),
    ],
)
def test_loads_that_make_no_sense_are_refused(text: str, message: str) -> None:
    with pytest.raises(InvalidSettings, match=message):
        Load.read(text)


def test_impossible_questions_are_refused() -> None:
    element = mean_ports(actuator("human:crane"))
    with pytest.raises(InvalidSettings, match="points: expected at least one, got 0"):
        trace(element, Load("free"), 0)
    with pytest.raises(InvalidSettings, match=r"expected no value, got 1\.0"):
        Load("blocked", 1.0)
    with pytest.raises(InvalidSettings, match="expected one of free, blocked, spring, force"):
        Load("hanging")  # type: ignore[arg-type]


def test_dead_ends_count_or_not_as_asked() -> None:
    design = actuator("human:crane")
    problem = design.problem
    extra = np.flatnonzero(~design.mask)[:40]
    mask = design.mask.copy()
    mask[extra] = True
    evaluator = SpringEvaluator(problem, unloaded_beams="prune_dead_ends")
    core = evaluator.load_bearing(mask)
    assert core.sum() < mask.sum()
    found = characterise(Design(problem, mask), [Load("free")], 2, unloaded_beams="prune_dead_ends")
    same = characterise(Design(problem, core), [Load("free")], 2)
    assert found.rest.efficiency == pytest.approx(same.rest.efficiency, rel=1e-10)
    literal = characterise(Design(problem, mask), [Load("free")], 2)
    assert literal.rest.efficiency != pytest.approx(found.rest.efficiency, rel=1e-6)
