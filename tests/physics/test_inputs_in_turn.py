"""Inputs that move in parts of the stroke, one after the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bellcrank.errors import InvalidProblem, InvalidSettings
from bellcrank.fem.frame.equations import FrameEquations, part_frame
from bellcrank.fem.path import PathStatus, follow_path
from bellcrank.machines import mean_ports
from bellcrank.mechanics import (
    VERIFICATION_INCREMENT,
    CaseEvaluator,
    Channel,
    FrameEvaluator,
    Status,
    at_fraction,
)
from bellcrank.mechanics.frames.kernels.arrays import NEXT_PATH
from bellcrank.mechanics.items import path_error
from bellcrank.mechanics.splines import stroke_spline
from bellcrank.model import Input, Problem, Section, problem_from_dict, problem_to_dict
from bellcrank.task import Task, task_from_dict
from bellcrank.workflows.loading import loading_path

from .frames import chain

TURNS = [[0.0, 0.5], [0.5, 1.0]]
TASK_TURNS = (["0%", "50%"], ["50%", "100%"])
TASK = {
    "name": "two-steps",
    "domain": {"size": ["62 mm", "54 mm"]},
    "supports": [{"at": {"edge": "bottom"}}],
    "cases": [
        {
            "inputs": [
                {"at": {"point": [56, 36]}, "direction": "left", "displacement": "3 mm",
                 "during": ["0%", "50%"]},
                {"at": {"point": [51, 53]}, "direction": "down", "displacement": "3 mm",
                 "during": ["50%", "100%"]},
            ],
            "outputs": [
                {"at": {"point": [11, 53]}, "direction": "left", "payload": "1 g",
                 "path": {"points": [[0, 0], [-2, 0], [-2, -2]], "error": "5%"}},
            ],
        }
    ],
}  # fmt: skip


def task_of(*during: list[str]) -> Task:
    """Return the task with other ranges."""
    case = TASK["cases"][0]
    inputs = [{**each, "during": own} for each, own in zip(case["inputs"], during, strict=True)]
    return task_from_dict({**TASK, "cases": [{**case, "inputs": inputs}]})


def diluted(problem: Problem, seed: int, absent: int = 18) -> np.ndarray:
    """Return a stable design without some beams."""
    rng = np.random.default_rng(seed)
    evaluator = FrameEvaluator(problem, "displacement")
    while True:
        mask = problem.initial.copy()
        mask[rng.choice(problem.designable, absent, replace=False)] = False
        if evaluator.evaluate(mask).status is Status.CONVERGED:
            return mask


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_node_between_two_inputs_follows_both_in_turn(dimension: int) -> None:
    # Equal bars in a line, in tension: the node in the middle moves by the mean of its neighbours.
    positions = np.zeros((4, dimension))
    positions[:, 0] = range(4)
    given = Input([3, 1], np.eye(dimension)[0], "displacement", 0.01, during=TURNS)
    section = Section.round(0.1) if dimension == 3 else Section(0.1, 1.0)
    problem = chain(positions, input=given, section=section)
    evaluator = FrameEvaluator(problem, "displacement")
    assert evaluator.evaluate(problem.initial).status is Status.CONVERGED
    for fraction, first, last in [(0.25, 0.0, 0.005), (0.5, 0.0, 0.01), (0.75, 0.005, 0.01)]:
        found = evaluator.equilibrium(fraction)
        assert found is not None
        expected = [0.0, first, 0.5 * (first + last), last]
        assert found.state.u[:, 0] == pytest.approx(expected, abs=1e-12)
    assert evaluator.end.state.u[:, 0] == pytest.approx([0.0, 0.01, 0.01, 0.01], abs=1e-12)


@pytest.mark.parametrize(
    "during",
    [
        (["0%", "50%"], ["50%", "100%"]),
        (["0%", "30%"], ["20%", "100%"]),
        (["40%", "100%"], ["0%", "40.1%"]),
        (["0%", "100%"], ["24.9%", "75.1%"]),
    ],
)
def test_the_end_is_that_of_inputs_that_move_together(during: tuple[list[str], ...]) -> None:
    problem = task_of(*during).problem
    together = replace(problem, input=replace(problem.input, during=None))
    for seed in range(3):
        mask = diluted(problem, seed)
        one, other = FrameEvaluator(problem, "displacement"), FrameEvaluator(together)
        whole = other.evaluate(mask, VERIFICATION_INCREMENT)
        assert whole.status is Status.CONVERGED
        for increment in (VERIFICATION_INCREMENT, 1.0):
            found = one.evaluate(mask, increment)
            assert found.status is Status.CONVERGED
            assert found.displacement == pytest.approx(whole.displacement, abs=1e-7)
        loads = one.memory.load[: int(one.memory.count[0])]
        assert set(problem.kinks) <= set(loads.tolist())


def test_an_input_rests_until_its_turn_and_is_held_after_it() -> None:
    problem = task_of(*TASK_TURNS).problem
    evaluator = FrameEvaluator(problem, "displacement")
    mask = diluted(problem, 1)
    evaluator.evaluate(mask)
    amount, nodes = problem.input.amount, problem.input.nodes
    for fraction in np.arange(1, 17) / 16.0:
        found = evaluator.equilibrium(float(fraction))
        assert found is not None
        moved = (found.state.u[nodes, :2] * problem.input.direction).sum(axis=1)
        expected = amount * np.clip([2.0 * fraction, 2.0 * fraction - 1.0], 0.0, 1.0)
        assert moved == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("during", [TASK_TURNS, (["0%", "30%"], ["20%", "100%"])])
def test_designs_next_to_a_reference_respond_as_from_rest(during: tuple[list[str], ...]) -> None:
    problem = task_of(*during).problem
    rng = np.random.default_rng(2)
    warm, rest = (FrameEvaluator(problem, "displacement") for _ in range(2))
    mask = diluted(problem, 2)
    warm.evaluate(mask)
    warm.set_reference()
    near = 0
    for _ in range(150):
        flipped = mask.copy()
        flipped[rng.choice(problem.designable)] ^= True
        one, other = warm.evaluate(flipped, warm_start=True), rest.evaluate(flipped)
        assert one.status is other.status
        if one.status is not Status.CONVERGED:
            continue
        assert one.displacement == pytest.approx(other.displacement, abs=1e-7)
        near += int(warm.memory.path[0]) == NEXT_PATH
        for fraction in (0.25, 0.5, 0.75):
            states = [each.equilibrium(fraction) for each in (warm, rest)]
            assert states[0] is not None
            assert states[1] is not None
            assert states[0].state.u == pytest.approx(states[1].state.u, abs=1e-7)
        if rng.random() < 0.5:
            warm.set_reference()
            mask = flipped
    assert near > 75


def test_a_second_input_that_nothing_is_joined_to_does_not_end_the_path() -> None:
    problem = task_of(*TASK_TURNS).problem
    mask = problem.initial.copy()
    mask[problem.lattice.beams_touching(problem.input.nodes[1:])] = False
    evaluator = FrameEvaluator(problem, "displacement")
    for increment in (1.0, VERIFICATION_INCREMENT):
        assert evaluator.evaluate(mask, increment).status is Status.CONVERGED
    half = evaluator.equilibrium(0.5)
    assert half is not None
    output = problem.output.nodes
    assert half.state.u[output] == pytest.approx(evaluator.end.state.u[output], abs=1e-3)


def test_finite_elements_follow_the_same_path() -> None:
    task = task_of(["0%", "45%"], ["30%", "100%"])
    problem = task.problem
    mask = diluted(problem, 3)
    part = task.part.of(problem.full_design().with_mask(mask))
    equations = FrameEquations(part_frame(part, 8))
    path = follow_path(equations)
    assert path.status is PathStatus.CONVERGED
    evaluator = FrameEvaluator(problem, "displacement", elements=8)
    evaluator.evaluate(mask, VERIFICATION_INCREMENT)
    loads = [state.load for state in path.states]
    assert set(problem.kinks) <= set(loads)
    count = problem.lattice.node_count
    for state in path.states[1:]:
        found = evaluator.end if state.load == 1.0 else evaluator.equilibrium(state.load)
        assert found is not None
        moved = equations.complete(state).displacement[:count, :2] / part.scale
        expected = found.state.u[:count, :2]
        present = np.unique(problem.lattice.beams[mask])
        assert moved[present] == pytest.approx(expected[present], abs=1e-6)


@pytest.mark.parametrize("toward", [0.0, 1.0])
def test_the_load_derivative_has_the_sides_of_a_kink(toward: float) -> None:
    task = task_of(*TASK_TURNS)
    part = task.part.of(task.problem.full_design())
    equations = FrameEquations(part_frame(part, 1))
    here, step = np.zeros(equations.count), 1e-6 * (1.0 if toward else -1.0)
    residuals = [equations.linearise(here, load).residual for load in (0.5, 0.5 + step)]
    expected = (residuals[1] - residuals[0]) / step
    found = equations.load_derivative(here, 0.5, toward)
    assert found == pytest.approx(expected, abs=1e-4 * np.abs(expected).max())
    other = equations.load_derivative(here, 0.5, 1.0 - toward)
    assert np.abs(found - other).max() > 0.1 * np.abs(found).max()


@pytest.mark.slow
def test_the_sheet_turns_at_the_same_corner() -> None:
    pytest.importorskip("ngsolve")
    from bellcrank.fem.continuum.response import solve_plane

    task = task_of(*TASK_TURNS)
    problem = task.problem
    mask = diluted(problem, 4, absent=30)
    part = task.part.of(problem.full_design().with_mask(mask))
    evaluator = FrameEvaluator(problem, "displacement", elements=8)
    evaluator.evaluate(mask, VERIFICATION_INCREMENT)
    states = {state.load: state for state in solve_plane(part, size=1.0).states}
    nodes, amount = problem.output.nodes, problem.input.amount
    for load in (0.5, 1.0):
        found = evaluator.end if load == 1.0 else evaluator.equilibrium(load)
        assert found is not None
        expected = found.state.u[nodes, :2]
        moved = states[load].motion[nodes] / part.scale
        # Frames and the sheet differ by a few per cent of the input without a kink, too.
        assert np.linalg.norm(moved - expected) < 0.05 * amount
        driven = states[load].motion[problem.input.nodes] / part.scale
        held = found.state.u[problem.input.nodes, :2]
        assert driven == pytest.approx(held, abs=1e-4)


def test_channels_along_the_stroke_have_the_mean_motion_of_the_inputs() -> None:
    problem = task_of(*TASK_TURNS).problem
    case = CaseEvaluator(problem)
    case.respond(diluted(problem, 1))
    moved = case.values([Channel("input_motion")], [0.25, 0.5, 0.75, 1.0])[Channel("input_motion")]
    assert moved / problem.input.amount == pytest.approx([0.25, 0.5, 0.75, 1.0])


def test_a_movie_shows_the_states_of_the_path() -> None:
    problem = task_of(*TASK_TURNS).problem
    design = problem.full_design().with_mask(diluted(problem, 1))
    path = loading_path(design, np.array([0.0, 0.5, 0.75, 1.0]))
    moved = (path.displacement[:, problem.input.nodes] * problem.input.direction).sum(axis=2)
    expected = problem.input.amount * np.array([[0, 0], [1, 0], [1, 0.5], [1, 1]])
    assert moved == pytest.approx(expected)
    assert not path.snapped.any()
    assert (np.diff(path.energy.sum(axis=1))[:1] > 0.0).all()
    evaluator = FrameEvaluator(problem)
    evaluator.evaluate(design.mask)
    assert path.energy[-1] == pytest.approx(evaluator.strain().energy, rel=1e-6, abs=1e-12)
    assert path.efficiency[-1] == pytest.approx(evaluator.evaluate(design.mask).efficiency)


def test_a_right_angle_with_a_corner_at_a_kink_has_no_error() -> None:
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    fractions = np.array([0.15, 0.3, 0.6, 0.8, 1.0])
    pace = np.interp(fractions, [0.0, 0.3, 1.0], [0.0, 1.0, 2.0])
    motion = np.stack([np.minimum(pace, 1.0), np.maximum(pace - 1.0, 0.0)], axis=-1)
    assert float(path_error(fractions, motion, corners, (0.3,))) < 1e-12
    assert float(path_error(fractions, motion, corners)) > 0.01
    assert path_error(fractions, np.stack([motion, motion]), corners, (0.3,)).max() < 1e-12


def test_a_spline_is_smooth_between_kinks_alone() -> None:
    at = np.linspace(0.0, 1.0, 9)
    values = np.where(at < 0.5, at**2, 1.0 - at)
    values[4] = 0.5
    fine = np.linspace(0.5, 1.0, 20)
    assert stroke_spline(at, values, [0.5], fine) == pytest.approx(1.0 - fine)


def test_ranges_are_written_and_read() -> None:
    problem = task_of(["0%", "50%"], ["33.3%", "100%"]).problem
    data = problem_to_dict(problem)
    assert data["input"]["during"] == [[0.0, 0.5], [0.333, 1.0]]
    again = problem_from_dict(data)
    assert again.hash == problem.hash
    assert again.kinks == (0.333, 0.5)
    together = replace(problem, input=replace(problem.input, during=None))
    assert together.hash != problem.hash
    assert "during" not in problem_to_dict(together)["input"]
    whole = replace(problem, input=replace(problem.input, during=[0.0, 1.0]))
    assert whole.hash == together.hash


@pytest.mark.parametrize(
    ("during", "message"),
    [
        ([0.5, 0.5], "input.during: expected an end that is at least 0.005 of the stroke after"),
        ([-0.1, 1.0], "input.during: expected fractions of the stroke from 0 to 1"),
        ([0.0, 0.5], "input.during: no input moves and no force grows from 50% to 100% of the"),
        ([[0.0, 0.4], [0.5, 1.0]], "no input moves and no force grows from 40% to 50% of the"),
        ([0.0, 0.5, 1.0], "input.during: expected two fractions of the stroke, or two for each"),
    ],
)
def test_wrong_ranges_are_one_clear_error(during: object, message: str) -> None:
    problem = task_of(*TASK_TURNS).problem
    with pytest.raises(InvalidProblem, match=message):
        replace(problem, input=replace(problem.input, during=during))


def test_what_needs_one_motion_of_the_input_refuses_ranges() -> None:
    problem = task_of(*TASK_TURNS).problem
    with pytest.raises(InvalidSettings, match="expected inputs and loads that grow along the wh"):
        at_fraction(problem, 0.5)
    with pytest.raises(InvalidSettings, match="expected inputs and loads that grow together"):
        mean_ports(problem.full_design())
    with pytest.raises(InvalidProblem, match=r"input.during: expected a problem with a section"):
        replace(problem, section=None, material=None, specification=None)
