"""Bundled machines: assembly, simulation, contact."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings, UnknownName
from bellcrank.machines import assembled_ports, two_port_at
from bellcrank.machines.bundled import bundled_machine, bundled_machines, find_plan
from bellcrank.machines.bundled.contact import bundled_contact
from bellcrank.machines.elementary import strut_named
from bellcrank.machines.library import find_entry
from bellcrank.mechanics import VERIFICATION_INCREMENT, FrameEvaluator, Status, model_evaluator
from bellcrank.model import Output
from bellcrank.workflows.validation import check_contact

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.machines.assembly import Machine


def moved(name: str) -> tuple[Machine, NDArray[np.float64], float]:
    """Return a machine, the motion of its output over that of its input, and its efficiency."""
    machine = bundled_machine(name)
    problem = machine.design.problem
    response = model_evaluator(problem).evaluate(machine.design.mask, VERIFICATION_INCREMENT)
    assert response.status is Status.CONVERGED
    motion = response.displacement[problem.output.nodes, :2]
    return machine, motion.mean(axis=0) / problem.input.amount, response.efficiency


@pytest.mark.parametrize("name", bundled_machines())
def test_every_machine_goes_its_whole_stroke(name: str) -> None:
    machine, _, efficiency = moved(name)
    assert machine.design.problem.section is not None
    # The ring of the twister moves down half as far as its input, and turns.
    assert efficiency > (0.4 if name == "twister" else 3.0)


def test_the_jaws_in_space_close_evenly() -> None:
    machine, motion, _ = moved("three-jaws")
    assert motion[:2] == pytest.approx(0.0, abs=1e-6)
    assert len(machine.plan.outputs) == 3


def test_the_ring_of_the_twister_turns_and_its_upper_plate_does_not() -> None:
    machine = bundled_machine("twister")
    turns = {}
    for name in ("lower.output", "upper.output"):
        port = next(each for each in machine.ports if str(each) == name)
        output = Output(machine.port_nodes(port), np.array([0.0, 0.0, -1.0]))
        evaluator = FrameEvaluator(replace(machine.design.problem, output=output))
        evaluator.evaluate(machine.design.mask, VERIFICATION_INCREMENT)
        turns[name] = float(np.linalg.norm(evaluator.output_motion().rotation))
    assert turns["lower.output"] > 25.0
    assert turns["upper.output"] < 0.5


@pytest.mark.parametrize("name", ["amplifier", "reverser", "sorter-left", "sorter-right"])
def test_machines_with_one_output_move_it_straight(name: str) -> None:
    machine, motion, _ = moved(name)
    (along,) = np.unique(machine.design.problem.output.direction, axis=0)
    assert abs(motion @ [-along[1], along[0]]) < 0.05 * (motion @ along)


def test_the_amplifier_amplifies_more_than_each_of_its_parts() -> None:
    machine, motion, _ = moved("amplifier")
    gains = [find_entry(part.entry).efficiency for part in machine.plan.table.parts.values()]
    assert len(gains) == 2
    assert -motion[0] > 1.3 * max(gains)


def test_two_ports_of_one_coordinate_do_not_describe_the_amplifier() -> None:
    machine, *_ = moved("amplifier")
    first, second = (
        find_entry(part.entry).characterisation.rest for part in machine.plan.table.parts.values()
    )
    estimate = first.efficiency_against(second.input_stiffness) * second.efficiency
    parts = assembled_ports(machine)
    exact = two_port_at(parts, parts.rest()).efficiency
    # The figures of docs/machines.md.
    assert (f"{estimate:.1f}", f"{exact:.1f}") == ("7.2", "6.3")


def test_the_inputs_of_the_sorter_move_its_output_to_opposite_sides() -> None:
    (_, left, _), (_, right, _) = moved("sorter-left"), moved("sorter-right")
    assert left[0] > 3.0
    assert left.tolist() == pytest.approx([-right[0], right[1]], rel=1e-6)


def test_one_machine_has_ten_actuators() -> None:
    machine = bundled_machine("wave")
    assert len(machine.parts) == 10
    assert machine.design.problem.lattice.beam_count > 1000


QUICK = "sorter-left"
"""Machine whose frame analysis takes little time."""


@pytest.mark.parametrize(
    "name",
    [
        name if name == QUICK else pytest.param(name, marks=pytest.mark.slow)
        for name in bundled_machines()
    ],
)
def test_the_recorded_contact_is_that_of_the_frame_analysis(name: str) -> None:
    found = check_contact(bundled_machine(name).design)
    recorded = bundled_contact(name)
    assert found.pairs == recorded.pairs
    assert found.onset == (None if recorded.onset is None else pytest.approx(recorded.onset))


def test_no_machine_touches_itself() -> None:
    assert {bundled_contact(name).onset for name in bundled_machines()} == {None}
    with pytest.raises(UnknownName, match="'claw'"):
        bundled_contact("claw")


def test_unknown_plans_list_the_known_ones() -> None:
    with pytest.raises(UnknownName, match=r"unknown plan 'claw': .*gripper"):
        find_plan("claw")


def test_a_folder_of_that_name_hides_no_plan(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "gripper").mkdir()
    monkeypatch.chdir(tmp_path)
    assert find_plan("gripper").table.name == "gripper"


def test_struts_have_names() -> None:
    bar = strut_named("strut-6")
    assert bar is not None
    assert bar.problem.name == "strut-6"
    assert strut_named("strut-") is None
    assert strut_named("lever") is None
    with pytest.raises(InvalidSettings, match="at least 3"):
        strut_named("strut-2")
