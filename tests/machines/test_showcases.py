"""The machines that come along: they can be built, and their parts foretell what they do."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from bellcrank.errors import InvalidSettings, UnknownName
from bellcrank.machines import predict
from bellcrank.machines.elementary import strut_named
from bellcrank.machines.showcases import find_plan, showcase, showcases
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status

if TYPE_CHECKING:
    from pathlib import Path

SMALL = 1e-3
"""Part of the stroke in which all is linear."""


@pytest.mark.parametrize("name", showcases())
def test_parts_foretell_small_strokes_of_every_machine(name: str) -> None:
    machine = showcase(name)
    problem = machine.design.problem
    drive = replace(problem.input, amount=SMALL * problem.input.amount)
    response = SpringEvaluator(replace(problem, input=drive)).evaluate(machine.design.mask)
    assert response.status is Status.CONVERGED
    assert predict(machine).efficiency == pytest.approx(response.efficiency, rel=0.05)


@pytest.mark.parametrize("name", showcases())
def test_every_machine_goes_its_whole_stroke(name: str) -> None:
    machine = showcase(name)
    response = SpringEvaluator(machine.design.problem).evaluate(
        machine.design.mask, VERIFICATION_INCREMENT
    )
    assert response.status is Status.CONVERGED
    assert response.efficiency > 1.0


def test_the_amplifier_amplifies() -> None:
    machine = showcase("amplifier")
    response = SpringEvaluator(machine.design.problem).evaluate(
        machine.design.mask, VERIFICATION_INCREMENT
    )
    assert len(machine.parts) == 2
    assert response.efficiency > 8.0


def test_the_sorter_sorts_by_the_key() -> None:
    motions = []
    for key in ("left", "right"):
        machine = showcase(f"sorter-{key}")
        problem = machine.design.problem
        moved = SpringEvaluator(problem).evaluate(machine.design.mask).displacement
        motions.append(moved[problem.output.nodes].mean(axis=0) / problem.input.amount)
    left, right = motions
    assert right[0] > 1.0
    assert left.tolist() == pytest.approx([-right[0], right[1]], rel=1e-6)


def test_one_machine_has_ten_actuators() -> None:
    machine = showcase("wave")
    assert len(machine.parts) == 10
    assert 3000 <= machine.design.problem.lattice.beam_count <= 4000


def test_unknown_plans_list_the_known_ones() -> None:
    with pytest.raises(UnknownName, match=r"no plan 'claw': neither a file nor .*gripper"):
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
