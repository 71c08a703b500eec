"""Weights that act on an output before the input and during it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.fem.frame.equations import FrameEquations, part_frame
from bellcrank.fem.path import Linearisation, PathStatus, follow_path
from bellcrank.mechanics import VERIFICATION_INCREMENT, CaseEvaluator, Channel, Status
from bellcrank.mechanics.frames.output_loads import resisting_force, with_output
from bellcrank.model.stroke_ranges import delayed
from bellcrank.task import find_task
from benchmarks.tasks import recorded_design
from tools.draw_tasks import best, recorded_runs

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.fem.frame.equations import PartFrame
    from bellcrank.model import Design

HALF = 0.5


@dataclass(frozen=True, slots=True)
class Loaded:
    """A recorded design, and the force that its payload is on an output."""

    design: Design
    output: str
    force: float


class DeadLoadEquations(FrameEquations):
    """A frame on which a weight acts in the first half of the load, and the input in the second."""

    def __init__(self, frame: PartFrame, weight: NDArray[np.float64]) -> None:
        assert not frame.load.any()
        super().__init__(replace(frame, ramps=delayed(frame.ramps, HALF)))
        self.weight = weight

    @property
    def kinks(self) -> tuple[float, ...]:
        return (HALF,)

    def linearise(self, unknowns: NDArray[np.float64], load: float) -> Linearisation:
        found = super().linearise(unknowns, load)
        weight = min(1.0, load / HALF) * self.weight.ravel()[self.free]
        return replace(found, residual=found.residual - weight)

    def load_derivative(
        self, unknowns: NDArray[np.float64], load: float, toward: float = 1.0
    ) -> NDArray[np.float64]:
        rate = super().load_derivative(unknowns, load, toward)
        grows = min(load, toward) < HALF
        return rate - grows * self.weight.ravel()[self.free] / HALF


def recorded(name: str) -> Loaded:
    """Return the recorded design of a task with its payload."""
    task = find_task(name)
    assert task is not None
    design = recorded_design(task, best([run for run in recorded_runs() if run["task"] == name]))
    assert design.problem.specification is not None
    item = next(each for each in design.problem.specification.items if each.quantity == "payload")
    assert item.at_least is not None
    return Loaded(design, item.output, item.at_least)


def motion_of(given: Loaded, channel: str, elements: int | None) -> NDArray[np.float64]:
    """Return (N, d) the displacements under the payload as a dead load or with the input."""
    problem = with_output(given.design.problem, given.output)
    forces = {Channel(channel, given.output): given.force}
    (evaluator,) = CaseEvaluator(problem, elements, forces=forces).loaded
    response = evaluator.evaluate(given.design.mask, VERIFICATION_INCREMENT)
    assert response.status is Status.CONVERGED
    return response.displacement


@pytest.mark.parametrize("name", ["straight-crane", "slider", "bracket"])
def test_the_state_under_a_dead_load_is_that_of_the_independent_path(name: str) -> None:
    given, task = recorded(name), find_task(name)
    assert task is not None
    part = task.part.of(given.design)
    frame = part_frame(part)
    dead = resisting_force(with_output(given.design.problem, given.output), given.force)
    weight = np.zeros_like(frame.drive)
    weight[dead.nodes, :2] = part.stiffness_unit * part.scale * dead.force
    equations = DeadLoadEquations(frame, weight)
    path = follow_path(equations)
    assert path.status is PathStatus.CONVERGED
    moved = equations.displacement(path.states[-1].unknowns, 1.0)
    expected = moved[: len(part.positions), :2] / part.scale
    found = motion_of(given, "carried_motion", elements=8)
    used = np.unique(part.struts)
    assert found[used] == pytest.approx(expected[used], abs=1e-5)


def test_a_load_that_a_part_carries_in_any_order_leads_to_one_state() -> None:
    given = recorded("straight-crane")
    for elements in (None, 8):
        first = motion_of(given, "carried_motion", elements)
        assert first == pytest.approx(motion_of(given, "loaded_motion", elements), abs=1e-6)


def test_a_part_may_carry_a_load_that_grows_with_the_input_and_not_a_weight() -> None:
    # The recorded slider meets its payload; the same weight at rest moves it beyond.
    given = recorded("slider")
    output = given.design.problem.outputs[given.output]

    def travel(channel: str) -> float:
        moved = motion_of(given, channel, elements=None)[output.nodes]
        return float((moved * output.direction).sum(axis=1).mean())

    assert travel("loaded_motion") > 2.0
    assert travel("carried_motion") < -2.0
