"""The machines that come along: they can be built, and their parts foretell what they do."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from bellcrank.cli.machine import design_of_strut
from bellcrank.errors import InvalidSettings, UnknownName
from bellcrank.machines import assemble, predict
from bellcrank.machines.library import library
from bellcrank.machines.showcases import find_plan, showcases
from bellcrank.mechanics import CAREFUL, Evaluator, Status

if TYPE_CHECKING:
    from bellcrank.machines.assembly import Machine
    from bellcrank.model import Design

SMALL = 1e-3
"""Part of the stroke in which all is linear."""


def find(entry: str) -> Design:
    return design_of_strut(entry) or library().find(entry).design


def built(name: str) -> Machine:
    return assemble(find_plan(name), find)


@pytest.mark.parametrize("name", showcases())
def test_parts_foretell_small_strokes_of_every_machine(name: str) -> None:
    machine = built(name)
    problem = machine.design.problem
    drive = replace(problem.input, amount=SMALL * problem.input.amount)
    response = Evaluator(replace(problem, input=drive)).respond(machine.design.mask)
    assert response.status is Status.CONVERGED
    assert predict(machine).efficiency == pytest.approx(response.efficiency, rel=0.05)


@pytest.mark.parametrize("name", showcases())
def test_every_machine_goes_its_whole_stroke(name: str) -> None:
    machine = built(name)
    response = Evaluator(machine.design.problem).respond(machine.design.mask, CAREFUL)
    assert response.status is Status.CONVERGED
    assert response.efficiency > 1.0


def test_the_amplifier_amplifies() -> None:
    machine = built("amplifier")
    response = Evaluator(machine.design.problem).respond(machine.design.mask, CAREFUL)
    assert len(machine.parts) == 2
    assert response.efficiency > 8.0


def test_the_sorter_sorts_by_the_key() -> None:
    motions = []
    for key in ("left", "right"):
        machine = built(f"sorter-{key}")
        problem = machine.design.problem
        moved = Evaluator(problem).respond(machine.design.mask).displacement
        motions.append(moved[problem.output.nodes].mean(axis=0) / problem.input.amount)
    left, right = motions
    assert right[0] > 1.0
    assert left.tolist() == pytest.approx([-right[0], right[1]], rel=1e-6)


def test_one_machine_has_ten_actuators() -> None:
    machine = built("wave")
    assert len(machine.parts) == 10
    assert 3000 <= machine.design.problem.lattice.beam_count <= 4000


def test_unknown_plans_list_the_known_ones() -> None:
    with pytest.raises(UnknownName, match=r"no plan 'claw': neither a file nor .*gripper"):
        find_plan("claw")


def test_struts_have_names() -> None:
    bar = design_of_strut("strut-6")
    assert bar is not None
    assert bar.problem.name == "strut-6"
    assert design_of_strut("strut-") is None
    assert design_of_strut("lever") is None
    with pytest.raises(InvalidSettings, match="at least 3"):
        design_of_strut("strut-2")
