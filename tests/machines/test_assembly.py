"""Plans and assemblies: parts in their places make one ordinary design, or one clear error."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank.errors import BellcrankError, InvalidFile, InvalidSettings, UnknownName
from bellcrank.machines.assembly import Machine, assemble
from bellcrank.machines.elementary import elementary
from bellcrank.machines.plan import MachineTable, PortName, plan_of, read_plan
from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import Stiffness, Supports
from bellcrank.part import PartSpec, frame_problem

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.model import Design

ENDS: dict[str, Any] = {"input": {"ports": ["a.input"]}, "output": {"ports": ["b.output"]}}


def thinned(columns: int = 7, seed: int = 0) -> Design:
    """Return an actuator without some of its beams."""
    full = elementary(columns, "down").full_design()
    mask = full.mask.copy()
    chosen = np.random.default_rng(seed).choice(full.problem.designable, 20, replace=False)
    mask[chosen] = False
    return full.with_mask(mask)


def rolling() -> Design:
    """Return an actuator that stands on rollers, but for one node."""
    problem = elementary(7, "down")
    nodes = problem.supports.fixed
    return replace(
        problem, supports=Supports(fixed=nodes[:1], fixed_y=nodes[1:]), designable=[0]
    ).full_design()


def stiff() -> Design:
    """Return an actuator of other struts."""
    return replace(elementary(7, "down"), stiffness=Stiffness(bond=7.0, angle=0.1)).full_design()


def find(name: str) -> Design:
    known = {
        "full": elementary(7, "down").full_design(),
        "thin": thinned(),
        "rolling": rolling(),
        "stiff": stiff(),
    }
    if name not in known:
        raise UnknownName(f"no design {name!r}")
    return known[name]


def build(parts: dict[str, Any], links: list[Any] | None = None, **ends: Any) -> Machine:
    told = {"name": "trial", "parts": parts, "links": links or [], **ENDS, **ends}
    return assemble(plan_of(MachineTable.model_validate(told), "trial.toml"), find)


PAIR = {"a": {"entry": "full"}, "b": {"entry": "full", "join": "a.output"}}


def test_two_parts_share_the_nodes_of_their_ports_and_nothing_else() -> None:
    machine = build(PAIR)
    one = elementary(7, "down")
    count = one.lattice.node_count
    assert machine.design.problem.lattice.node_count == 2 * count - 7
    shared = np.intersect1d(machine.nodes["a"], machine.nodes["b"])
    assert np.array_equal(shared, np.sort(machine.port_nodes(PortName("a", "output"))))
    assert np.array_equal(shared, np.sort(machine.port_nodes(PortName("b", "input"))))
    inside = 12  # beams of a hexagon of seven nodes
    assert machine.design.problem.lattice.beam_count == 2 * one.lattice.beam_count - inside


def test_a_machine_is_an_ordinary_design() -> None:
    machine = build(PAIR)
    response = SpringEvaluator(machine.design.problem).evaluate(machine.design.mask)
    assert response.is_admissible
    assert np.isfinite(response.efficiency)
    again = SpringEvaluator(machine.design.problem).evaluate(machine.design.mask)
    assert again.efficiency == response.efficiency


@pytest.mark.parametrize("mirror", [False, True])
@pytest.mark.parametrize("rotate", [0, 60, 120, 180, 240, 300])
def test_a_machine_of_one_part_does_what_the_part_does(rotate: int, mirror: bool) -> None:
    placed = {"a": {"entry": "thin", "rotate": rotate, "mirror": mirror, "at": [3.0, -2.0]}}
    machine = build(placed, output={"ports": ["a.output"]})
    alone, here = thinned(), machine.design
    expected = SpringEvaluator(alone.problem).evaluate(alone.mask).efficiency
    found = SpringEvaluator(here.problem).evaluate(here.mask).efficiency
    assert found == pytest.approx(expected, abs=1e-9)
    centre = here.problem.lattice.positions[machine.port_nodes(PortName("a", "input"))].mean(axis=0)
    assert centre == pytest.approx([3.0, -2.0], abs=1e-12)


def test_turned_and_mirrored_parts_fit_their_ports() -> None:
    for rotate, mirror in ((0, False), (300, False), (180, True), (240, True)):
        second = {"entry": "thin", "join": "a.output", "rotate": rotate, "mirror": mirror}
        machine = build({"a": {"entry": "thin"}, "b": second})
        count = elementary(7, "down").lattice.node_count
        assert machine.design.problem.lattice.node_count == 2 * count - 7


def test_masks_of_parts_become_the_mask_of_the_machine() -> None:
    machine = build({"a": {"entry": "thin"}, "b": {"entry": "full", "join": "a.output"}})
    mask = machine.design.mask
    missing = ~mask[machine.beams["a"]]
    assert np.array_equal(missing, ~thinned().mask)
    assert mask[machine.beams["b"]].all()
    beams = machine.design.problem.lattice.beams
    assert np.array_equal(
        machine.nodes["b"][elementary(7, "down").lattice.beams], beams[machine.beams["b"]]
    )


def test_widths_of_parts_become_those_of_the_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """A strut of two parts has the larger width; bridges have that of the section."""
    given = frame_problem(elementary(7, "down"), PartSpec())
    assert given.section is not None
    width = given.section.width
    rng = np.random.default_rng(0)
    several = width * rng.uniform(1.0, 1.8, given.lattice.beam_count)
    designs = {
        "full": given.full_design(),
        "wide": given.with_geometry(given.lattice.positions, several).full_design(),
    }
    monkeypatch.setattr(sys.modules[__name__], "find", designs.__getitem__)
    machine = build({"a": {"entry": "wide"}, "b": {"entry": "full", "join": "a.output"}})
    widths = machine.design.problem.beam_widths
    assert widths[machine.beams["a"]] == pytest.approx(several)
    alone = np.setdiff1d(machine.beams["b"], machine.beams["a"])
    assert (widths[alone] == width).all()
    parts = {"a": {"entry": "full"}, "b": {"entry": "wide", "at": [-13.0, 0.0]}}
    machine = build(parts, [{"from": "a.output", "to": "b.input", "kind": "bridge"}])
    widths = machine.design.problem.beam_widths
    assert len(machine.bridges)
    assert (widths[machine.bridges] == width).all()
    assert widths[machine.beams["b"]] == pytest.approx(several)
    assert build(PAIR).design.problem.widths is None


def test_a_bridge_joins_ports_that_are_apart() -> None:
    parts = {"a": {"entry": "full"}, "b": {"entry": "full", "at": [-13.0, 0.0]}}
    machine = build(parts, [{"from": "a.output", "to": "b.input", "kind": "bridge"}])
    ends = machine.design.problem.lattice.beams[machine.bridges]
    assert len(ends) > 10
    length = np.linalg.norm(
        np.diff(machine.design.problem.lattice.positions[ends], axis=1)[:, 0], axis=1
    )
    assert length == pytest.approx(np.ones(len(ends)))  # one grid: the lattice goes on
    response = SpringEvaluator(machine.design.problem).evaluate(machine.design.mask)
    assert abs(response.efficiency) > 1e-6


def test_a_drive_is_that_of_the_first_part_in_its_size_or_what_the_plan_says() -> None:
    alone: dict[str, Any] = {"output": {"ports": ["a.output"]}}
    own = elementary(7, "down").input
    large = build({"a": {"entry": "full", "scale": 2.0}}, **alone).design.problem.input
    assert (large.drive, large.amount) == ("displacement", 2.0 * own.amount)
    pushed = {"ports": ["a.input"], "drive": "force", "amount": 0.25}
    given = build({"a": {"entry": "full", "scale": 2.0}}, input=pushed, **alone)
    assert (given.design.problem.input.drive, given.design.problem.input.amount) == ("force", 0.25)


def test_designable_is_all_but_ports_and_supports() -> None:
    problem = build(PAIR).design.problem
    port = set(build(PAIR).port_nodes(PortName("a", "output")).tolist())
    beams = problem.lattice.beams[problem.designable]
    taken = {*problem.supports.nodes.tolist(), *problem.input.nodes.tolist()}
    assert not any(taken.intersection(pair) for pair in beams.tolist())
    assert not any(port.issuperset(pair) for pair in beams.tolist())
    assert any(port.intersection(pair) for pair in beams.tolist())


@pytest.mark.parametrize(
    ("parts", "links", "ends", "told"),
    [
        (
            {"a": {"entry": "full"}, "b": {"entry": "full", "at": [-20.0, 0.0]}},
            [{"from": "a.output", "to": "b.input"}],
            {},
            "ports a.output and b.input do not meet",
        ),
        (
            {"a": {"entry": "full"}, "b": {"entry": "full", "at": [1.0, 0.0]}},
            [],
            {},
            "parts a and b overlap near",
        ),
        (
            {"a": {"entry": "full"}, "b": {"entry": "full", "at": [0.5, 0.29]}},
            [],
            {},
            "parts a and b overlap",
        ),
        (
            PAIR,
            [],
            {"input": {"ports": ["b.input"]}},
            "port b.input is driven twice: by the input of the machine and by a.output",
        ),
        (
            {name: {**part, "supports": False} for name, part in PAIR.items()},
            [],
            {},
            "parts without support: a, b",
        ),
        (
            {**PAIR, "c": {"entry": "full", "join": "b.input", "mirror": True}},
            [],
            {"input": {"ports": ["c.input"]}},
            "port c.input is driven twice: by the input of the machine and by a.output",
        ),
        (
            PAIR,
            [],
            {"input": {"ports": ["a.input"], "drive": "force"}},
            "input.amount: required with drive 'force'",
        ),
        (PAIR, [], {"output": {"ports": ["b.exit"]}}, "unknown port 'b.exit'"),
        (PAIR, [], {"output": {"ports": ["a.input"]}}, "port 'a.input' is both input and output"),
        ({"a": {"entry": "absent"}}, [], {"output": {"ports": ["a.output"]}}, "parts.a.entry: no"),
        (PAIR, [{"from": "a.output", "to": "c.input"}], {}, "unknown port 'c.input'"),
        (PAIR, [{"from": "a.output", "to": "a.output"}], {}, "linked to itself"),
        ({"a": {"entry": "full"}, "b": {"entry": "full"}}, [], {}, "parts.b: no position"),
        (
            {"a": {"entry": "full", "join": "b.output"}, "b": {"entry": "full", "join": "a.input"}},
            [],
            {},
            "the positions of parts a, b depend on each other",
        ),
        (
            {"a": {"entry": "rolling", "rotate": 60}},
            [],
            {"output": {"ports": ["a.output"]}},
            "part a has roller supports and cannot be rotated by 60 degrees",
        ),
        (
            {"a": {"entry": "full"}, "b": {"entry": "stiff", "join": "a.output"}},
            [],
            {},
            "parts a and b have different stiffness: bond 5 and angle 0.1 against bond 7",
        ),
        (
            {"a": {"entry": "full"}, "b": {"entry": "full", "at": [-13.0, 0.0]}},
            [{"from": "a.output", "to": "b.input", "kind": "bridge"}] * 2,
            {},
            "bridge from a.output to b.input: the space between the ports is taken at",
        ),
        ({"a": {"entry": "full", "rotate": 45}}, [], {}, "expected a multiple of 60 degrees"),
        ({"a": {"entry": "full", "join": "z.output"}}, [], {}, "unknown part 'z'"),
        ({"a": {"entry": "full", "join": "a.output"}}, [], {}, "cannot join itself"),
    ],
)
def test_bad_plans_get_one_clear_error(
    parts: dict[str, Any], links: list[Any], ends: dict[str, Any], told: str
) -> None:
    with pytest.raises(InvalidFile, match=told.replace(".", r"\.")):
        build(parts, links, **ends)


@pytest.mark.parametrize("rotate", [0, 180])
def test_rollers_roll_along_their_axis_upside_down_too(rotate: int) -> None:
    machine = build({"a": {"entry": "rolling", "rotate": rotate}}, output={"ports": ["a.output"]})
    held = machine.design.problem.supports
    assert np.array_equal(
        held.fixed_y, np.sort(machine.nodes["a"][rolling().problem.supports.fixed_y])
    )
    assert len(held.fixed_x) == 0


def test_ports_can_have_a_direction_each() -> None:
    machine = build(PAIR, output={"ports": ["a.output", "b.output"],
                                  "direction": [[2.0, 0.0], [0.0, -3.0]]})  # fmt: skip
    wanted = machine.design.problem.output
    for port, unit in (("a", [1.0, 0.0]), ("b", [0.0, -1.0])):
        own = np.isin(wanted.nodes, machine.port_nodes(PortName(port, "output")))
        assert own.sum() == 7
        assert wanted.direction[own].tolist() == [unit] * 7
    with pytest.raises(InvalidFile, match=r"output\.direction: .*one for each of 1 ports, got 2"):
        build(PAIR, output={"ports": ["a.output"], "direction": [[1.0, 0.0], [0.0, 1.0]]})


def test_files_are_checked_too(tmp_path: Path) -> None:
    path = tmp_path / "machine.toml"
    path.write_text('name = "x"\nengine = 3\n[parts.a]\nentry = "e"\n')
    with pytest.raises(BellcrankError, match=r"machine\.toml: .*'(input|engine)'"):
        read_plan(path)
    path.write_text(
        'name = "x"\n[parts.a]\nentry = "full"\n[output]\nports = ["a.output"]\n'
        '[input]\nports = ["a.input"]\ndirection = [0.0, 0.0]\n'
    )
    with pytest.raises(InvalidFile, match=r"input\.direction: .*a nonzero vector \[x, y\]"):
        read_plan(path)
    path.write_text(
        'name = "x"\n[parts.a]\nentry = "full"\n'
        '[input]\nports = ["a.input"]\n[output]\nports = ["a.output"]\n'
    )
    assert read_plan(path).order == ("a",)


def test_elementary_tasks_refuse_what_makes_no_sense() -> None:
    with pytest.raises(InvalidSettings, match="direction: expected one of right"):
        elementary(9, "north")
    with pytest.raises(InvalidSettings, match="columns: expected at least 5"):
        elementary(4, "up")
    for columns in (5, 6, 9, 12):
        problem = elementary(columns, "up-left")
        assert len(problem.input.nodes) == len(problem.output.nodes) == 7
