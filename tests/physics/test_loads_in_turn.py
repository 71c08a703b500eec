"""Loads that grow in a part of the stroke, such as weights that act before the input."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bellcrank.errors import InvalidProblem
from bellcrank.fem.frame.equations import FrameEquations, part_frame
from bellcrank.fem.path import PathStatus, follow_path
from bellcrank.mechanics import (
    VERIFICATION_INCREMENT,
    CaseEvaluator,
    Channel,
    FrameEvaluator,
    Status,
)
from bellcrank.model import (
    Input,
    Loads,
    NodeForce,
    Problem,
    Section,
    problem_from_dict,
    problem_to_dict,
)
from bellcrank.task import Task, task_from_dict
from bellcrank.workflows.condition_texts import condition_texts
from bellcrank.workflows.loading import loading_path

from .frames import chain

INPUT = {"at": {"point": [56, 53]}, "direction": "left", "displacement": "3 mm"}
LOAD = {"at": {"point": [11, 53]}, "direction": "down", "force": "40 g"}
TASK = {
    "name": "hanging",
    "domain": {"size": ["62 mm", "54 mm"]},
    "supports": [{"at": {"edge": "bottom"}}],
    "cases": [
        {
            "inputs": [{**INPUT, "during": ["20%", "100%"]}],
            "loads": [{**LOAD, "during": ["0%", "20%"]}],
            "outputs": [{"at": {"point": [11, 53]}, "direction": "left", "travel": "1 mm"}],
        }
    ],
}


def hanging(**changes: object) -> Task:
    """Return the task with other inputs or loads."""
    return task_from_dict({**TASK, "cases": [{**TASK["cases"][0], **changes}]})


def response(task: Task, elements: int | None = None) -> FrameEvaluator:
    """Return an evaluator after the response of the full lattice."""
    evaluator = FrameEvaluator(task.problem, "displacement", elements)
    found = evaluator.evaluate(task.problem.initial, VERIFICATION_INCREMENT)
    assert found.status is Status.CONVERGED
    return evaluator


def without_push(problem: Problem) -> Problem:
    """Return a problem whose loads grow along the whole stroke of an input that hardly moves."""
    loads = problem.loads
    forces = tuple(replace(each, during=None) for each in loads.forces)
    return replace(
        problem,
        input=replace(problem.input, amount=1e-9, during=None),
        loads=replace(loads, forces=forces, weight_during=None),
    )


def moved(evaluator: FrameEvaluator, fraction: float) -> np.ndarray:
    """Return (N, 2) the displacements at a fraction of the stroke."""
    found = evaluator.end if fraction == 1.0 else evaluator.equilibrium(fraction)
    assert found is not None
    return found.state.u[: evaluator.problem.lattice.node_count, :2].copy()


@pytest.mark.parametrize("dimension", [2, 3])
def test_bars_stretch_by_the_forces_that_act_so_far(dimension: int) -> None:
    positions = np.zeros((3, dimension))
    positions[:, 0] = range(3)
    along = np.eye(dimension)[0]
    section = Section.round(0.1) if dimension == 3 else Section(0.1, 1.0)
    force = 1e-6
    problem = chain(
        positions,
        input=Input([2], along, "force", force, during=(0.5, 1.0)),
        section=section,
        loads=Loads(forces=(NodeForce([1], 3.0 * force * along, during=(0.0, 0.5)),)),
    )
    assert problem.kinks == (0.5,)
    evaluator = FrameEvaluator(problem, "displacement")
    assert evaluator.evaluate(problem.initial).status is Status.CONVERGED
    stretch = force / (problem.material.young * section.area)
    for fraction, first, last in [(0.25, 1.5, 0.0), (0.5, 3.0, 0.0), (0.75, 3.0, 0.5), (1.0, 3, 1)]:
        found = moved(evaluator, fraction)[:, 0] / stretch
        assert found == pytest.approx([0.0, first + last, first + 2.0 * last], abs=1e-4)


@pytest.mark.parametrize("elements", [None, 2])
def test_a_weight_acts_before_the_input_and_is_held(elements: int | None) -> None:
    evaluator = response(hanging(), elements)
    alone = {**LOAD, "during": ["0%", "20%"]}
    # The input node rests while the weight grows: that is a support.
    still = {**INPUT, "displacement": "0.02 mm", "during": ["20%", "100%"]}
    weighed = moved(response(hanging(inputs=[still], loads=[alone]), elements), 0.2)
    assert np.abs(weighed).max() > 0.005
    assert moved(evaluator, 0.2) == pytest.approx(weighed, abs=1e-7)
    half = 0.5 * weighed[evaluator.problem.output.nodes]
    assert moved(evaluator, 0.1)[evaluator.problem.output.nodes] == pytest.approx(half, rel=0.2)
    together = response(hanging(inputs=[INPUT], loads=[LOAD]), elements)
    assert moved(evaluator, 1.0) == pytest.approx(moved(together, 1.0), abs=1e-7)
    assert np.abs(moved(evaluator, 0.6) - moved(together, 0.6)).max() > 0.1 * np.abs(weighed).max()


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_own_weight_acts_in_its_part_of_the_stroke(dimension: int) -> None:
    section = Section.round(0.1) if dimension == 3 else Section(0.1, 1.0)
    positions = np.zeros((5, dimension))
    positions[:, 0] = range(5)
    weight, down = np.zeros(dimension), np.eye(dimension)[1]
    weight[1] = -2e-7
    given = {"section": section, "input": Input([4], down, "force", 1e-9, during=(0.5, 1.0))}
    own = chain(positions, loads=Loads(weight=weight, weight_during=(0.0, 0.5)), **given)
    # Half of the weight of a beam acts at each of its ends.
    share = section.area * weight * np.array([0.5, 1.0, 1.0, 1.0, 0.5])[:, None]
    forces = (NodeForce(range(1, 5), share[1:], during=(0.0, 0.5)),)
    pulled = chain(positions, loads=Loads(forces=forces), **given)
    assert own.kinks == (0.5,)
    evaluators = [FrameEvaluator(each, "displacement") for each in (own, pulled)]
    for evaluator in evaluators:
        assert evaluator.evaluate(own.initial).status is Status.CONVERGED
    for fraction in (0.25, 0.5, 0.75, 1.0):
        found, expected = (moved(each, fraction) for each in evaluators)
        assert np.abs(expected).max() > 1e-3
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_own_weight_before_the_input_of_a_task() -> None:
    task = hanging(loads=[], gravity="down", gravity_during=["0%", "20%"])
    loads = task.problem.loads
    assert loads.weight_during == (0.0, 0.2)
    assert problem_from_dict(problem_to_dict(task.problem)).hash == task.problem.hash
    texts = str(condition_texts(task.problem, task.part))
    assert "own weight down, grows from 0% to 20% of the stroke" in texts
    before, output = response(task), task.problem.output.nodes
    together = response(
        hanging(inputs=[INPUT], loads=[], gravity="down", gravity_during=["0%", "100%"])
    )
    assert together.problem.loads.weight_during is None
    assert moved(before, 1.0) == pytest.approx(moved(together, 1.0), abs=1e-7)
    # Before the input moves, all of the weight acts.
    alone = FrameEvaluator(without_push(task.problem), "displacement")
    assert alone.evaluate(task.problem.initial, VERIFICATION_INCREMENT).status is Status.CONVERGED
    sag = moved(alone, 1.0)[output]
    assert sag[:, 1].max() < -1e-5
    assert moved(before, 0.2)[output] == pytest.approx(sag, rel=1e-4, abs=1e-7)
    with pytest.raises(InvalidProblem, match=r"gravity_during: expected cases\[0\].gravity"):
        hanging(gravity_during=["0%", "20%"])
    with pytest.raises(InvalidProblem, match="weight_during: expected a weight"):
        Loads(weight_during=(0.0, 0.2))


def test_finite_elements_follow_the_same_path() -> None:
    task = hanging()
    part = task.part.of(task.problem.full_design())
    equations = FrameEquations(part_frame(part, 8))
    assert equations.kinks == (0.2,)
    path = follow_path(equations)
    assert path.status is PathStatus.CONVERGED
    evaluator = response(task, 8)
    count = task.problem.lattice.node_count
    assert 0.2 in [state.load for state in path.states]
    for state in path.states[1:]:
        found = equations.complete(state).displacement[:count, :2] / part.scale
        assert found == pytest.approx(moved(evaluator, state.load), abs=1e-6)


@pytest.mark.parametrize("toward", [0.0, 1.0])
def test_the_load_derivative_has_the_sides_of_a_kink(toward: float) -> None:
    task = hanging()
    equations = FrameEquations(part_frame(task.part.of(task.problem.full_design()), 1))
    here, step = np.zeros(equations.count), 1e-6 * (1.0 if toward else -1.0)
    residuals = [equations.linearise(here, load).residual for load in (0.2, 0.2 + step)]
    expected = (residuals[1] - residuals[0]) / step
    found = equations.load_derivative(here, 0.2, toward)
    assert found == pytest.approx(expected, abs=1e-4 * np.abs(expected).max())


@pytest.mark.slow
def test_the_sheet_sags_alike() -> None:
    pytest.importorskip("ngsolve")
    from bellcrank.fem.continuum.response import solve_plane

    task = hanging(loads=[], gravity="down", gravity_during=["0%", "20%"])
    problem, part = task.problem, task.part.of(task.problem.full_design())
    states = {state.load: state for state in solve_plane(part, size=1.0).states}
    still = without_push(problem).full_design()
    alone = solve_plane(task.part.of(still), size=1.0).states[-1]
    sag = alone.motion[problem.output.nodes]
    assert sag[:, 1].max() < -1e-5
    assert states[0.2].motion[problem.output.nodes] == pytest.approx(sag, rel=1e-5, abs=1e-8)


@pytest.mark.slow
def test_the_sheet_hangs_alike() -> None:
    pytest.importorskip("ngsolve")
    from bellcrank.fem.continuum.response import solve_plane

    task = hanging()
    problem, output = task.problem, task.problem.output.nodes
    part = task.part.of(problem.full_design())
    states = {state.load: state for state in solve_plane(part, size=1.0).states}
    weight = states[0.2].force[output].sum(axis=0)
    assert weight == pytest.approx([0.0, -0.04 * 9.80665])
    still = without_push(problem).full_design()
    alone = solve_plane(task.part.of(still), size=1.0).states[-1]
    assert states[0.2].motion[output] == pytest.approx(alone.motion[output], rel=1e-5, abs=1e-7)
    difference = states[1.0].motion[output] / part.scale - moved(response(task, 8), 1.0)[output]
    assert np.linalg.norm(difference) < 0.05 * problem.input.amount


def flip_errors(problem: Problem, fractions: list[float]) -> np.ndarray:
    """Return the errors of predicted flips over the changes of the motion that flips cause."""
    case = CaseEvaluator(problem)
    channel = Channel("motion", "output")
    mask = problem.initial.copy()
    assert case.respond(mask).status is Status.CONVERGED
    values = case.values([channel], fractions)
    beams = problem.designable[::7]
    predicted = case.predict_flips(values, beams)
    assert predicted is not None
    differences = []
    for beam, guess in zip(beams, predicted[0][channel], strict=True):
        flipped = mask.copy()
        flipped[beam] ^= True
        if case.respond(flipped).status is Status.CONVERGED:
            exact = case.values([channel], fractions)[channel]
            change = np.abs(exact - values[channel]).max()
            differences.append(np.abs(guess - exact).max() / max(change, 1e-9))
    assert len(differences) > 10
    return np.array(differences)


def test_flips_are_predicted_under_a_weight() -> None:
    assert np.median(flip_errors(hanging().problem, [0.2, 0.6, 1.0])) < 0.1


def test_flips_are_predicted_under_own_weight_that_acts_first() -> None:
    """Without a push the motion is linear, and the prediction exact."""
    problem = hanging().problem
    still = replace(
        problem,
        input=replace(problem.input, amount=1e-9),
        loads=Loads(weight=[0.0, -2e-5], weight_during=(0.0, 0.2)),
    )
    assert flip_errors(still, [0.1, 0.2, 0.6, 1.0]).max() < 1e-3


def test_a_movie_begins_with_the_weight() -> None:
    task = hanging()
    path = loading_path(task.problem.full_design(), np.array([0.0, 0.1, 0.2, 0.6, 1.0]))
    given = task.problem.input
    pushed = (path.displacement[:, given.nodes] * given.direction).sum(axis=(1, 2)) / given.amount
    assert pushed == pytest.approx([0.0, 0.0, 0.0, 0.5, 1.0], abs=1e-6)
    fallen = path.displacement[:, task.problem.output.nodes, 1].mean(axis=1)
    assert fallen[2] < fallen[1] < fallen[0] == 0.0


def test_ranges_of_loads_are_written_read_and_shown() -> None:
    task = hanging()
    problem = task.problem
    data = problem_to_dict(problem)
    assert data["loads"]["forces"][0]["during"] == [0.0, 0.2]
    again = problem_from_dict(data)
    assert again.hash == problem.hash
    assert again.kinks == (0.2,)
    whole = hanging(inputs=[INPUT], loads=[{**LOAD, "during": ["0%", "100%"]}]).problem
    assert not whole.has_ranges
    assert whole.hash == hanging(inputs=[INPUT], loads=[LOAD]).problem.hash
    assert condition_texts(problem, task.part) == [
        "input 3 mm left at (51, 53) mm, from 20% to 100% of the stroke",
        "load of 0.392 N in all down at (11, 53) mm, grows from 0% to 20% of the stroke",
    ]
