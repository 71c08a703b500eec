"""Bundled machines: assembly, simulation, contact."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from bellcrank.errors import InvalidSettings, UnknownName
from bellcrank.machines.bundled import bundled_machine, bundled_machines, find_plan
from bellcrank.machines.bundled.contact import bundled_contact
from bellcrank.machines.elementary import strut_named
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status
from bellcrank.workflows.validation import check_contact

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize("name", bundled_machines())
def test_every_machine_goes_its_whole_stroke(name: str) -> None:
    machine = bundled_machine(name)
    response = SpringEvaluator(machine.design.problem).evaluate(
        machine.design.mask, VERIFICATION_INCREMENT
    )
    assert response.status is Status.CONVERGED
    assert response.efficiency > 1.0


def test_the_amplifier_amplifies() -> None:
    machine = bundled_machine("amplifier")
    response = SpringEvaluator(machine.design.problem).evaluate(
        machine.design.mask, VERIFICATION_INCREMENT
    )
    assert len(machine.parts) == 2
    assert response.efficiency > 8.0


def test_the_sorter_sorts_by_the_key() -> None:
    motions = []
    for key in ("left", "right"):
        machine = bundled_machine(f"sorter-{key}")
        problem = machine.design.problem
        moved = SpringEvaluator(problem).evaluate(machine.design.mask).displacement
        motions.append(moved[problem.output.nodes].mean(axis=0) / problem.input.amount)
    left, right = motions
    assert right[0] > 1.0
    assert left.tolist() == pytest.approx([-right[0], right[1]], rel=1e-6)


def test_one_machine_has_ten_actuators() -> None:
    machine = bundled_machine("wave")
    assert len(machine.parts) == 10
    assert 3000 <= machine.design.problem.lattice.beam_count <= 4000


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


def test_contact_is_recorded_for_machines_whose_struts_touch() -> None:
    touching = {name for name in bundled_machines() if bundled_contact(name).onset is not None}
    assert {"gripper", "reverser"} <= touching
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
