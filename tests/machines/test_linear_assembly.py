"""Linear assembly of condensed parts against the linear response of the whole lattice."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bellcrank.errors import InvalidFile
from bellcrank.machines import assemble, elementary, linear_assembly
from bellcrank.machines.elementary import strut_named
from bellcrank.machines.plan import MachineTable, PortName, plan_of
from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import Design

STROKE = 1e-5
"""Input displacement in the linear range."""


def actuator(seed: int, columns: int = 7) -> Design:
    """Some actuator: beams are missing anywhere outside the ports."""
    task = elementary(columns, "down")
    small = replace(task, input=replace(task.input, amount=STROKE))
    mask = small.initial.copy()
    rng = np.random.default_rng(seed)
    mask[rng.choice(small.designable, len(small.designable) // 4, replace=False)] = False
    return Design(small, mask)


def hinged() -> Design:
    """An actuator that hangs on its support by a single beam."""
    whole = actuator(1).problem
    mask = whole.initial.copy()
    at_supports = np.flatnonzero(whole.lattice.beams_touching(whole.supports.nodes))
    held = np.isin(whole.lattice.beams[at_supports], whole.supports.nodes).sum(axis=1)
    mask[at_supports] = False
    mask[at_supports[held == 1][0]] = True
    return Design(whole, mask)


def build(parts: dict[str, Any], links: list[Any] | None = None, **ends: Any) -> Any:
    told = {
        "name": "chain", "parts": parts, "links": links or [],
        "input": {"ports": ["a.input"]}, "output": {"ports": ["b.output"]}, **ends,
    }  # fmt: skip
    plan = plan_of(MachineTable.model_validate(told), "chain.toml")
    return assemble(plan, find)


def find(entry: str) -> Design:
    if entry == "hinged":
        return hinged()
    return strut_named(entry) or actuator(int(entry))


def whole(machine: Any) -> float:
    return SpringEvaluator(machine.design.problem).evaluate(machine.design.mask).efficiency


@pytest.mark.parametrize(("rotate", "within"), [(0, 1e-3), (300, 0.03)])
@pytest.mark.parametrize("seeds", [("1", "2"), ("3", "4"), ("5", "6")])
def test_two_parts_chained_move_as_their_lattice(
    seeds: tuple[str, str], rotate: int, within: float
) -> None:
    # Turned by 300 degrees, both parts have beams in one gap: its springs are not foreseen.
    first, second = seeds
    machine = build(
        {"a": {"entry": first}, "b": {"entry": second, "join": "a.output", "rotate": rotate}}
    )
    assert linear_assembly(machine).efficiency == pytest.approx(whole(machine), rel=within)


def test_one_part_alone_is_what_it_is() -> None:
    machine = build({"a": {"entry": "1"}}, output={"ports": ["a.output"]})
    assert linear_assembly(machine).efficiency == pytest.approx(whole(machine), rel=1e-3)


def test_a_longer_chain_too() -> None:
    parts: dict[str, Any] = {"a": {"entry": "1"}}
    for before, name, seed in (("a", "c", "2"), ("c", "d", "3"), ("d", "b", "4")):
        parts[name] = {"entry": seed, "join": f"{before}.output"}
    for port in ("a", "c", "d", "b"):
        alone = build(parts, output={"ports": [f"{port}.output"]})
        expected, found = whole(alone), linear_assembly(alone).efficiency
        assert found == pytest.approx(expected, rel=1e-3, abs=1e-9)


FORK = {
    "a": {"entry": "1"},
    "b": {"entry": "strut-6", "join": "a.output", "rotate": 60},
    "c": {"entry": "strut-6", "join": "a.output", "rotate": 300},
}
"""Three ports on one another."""


@pytest.mark.parametrize("output", ["b.output", "c.output"])
@pytest.mark.parametrize("links", [[], [{"from": "b.input", "to": "c.input"}]])
def test_three_parts_at_one_joint_share_its_beams_once(links: list[Any], output: str) -> None:
    machine = build(FORK, links, output={"ports": [output]})
    inside = machine.design.problem.lattice.beams
    joint = machine.port_nodes(PortName("a", "output"))
    assert np.isin(inside, joint).all(axis=1).sum() == 12
    # Turned struts have beams in the gaps of others: their springs there are not foreseen.
    assert linear_assembly(machine).efficiency == pytest.approx(whole(machine), rel=0.01)


def test_a_beam_that_only_one_part_has_in_a_joint_counts() -> None:
    machine = build({"a": {"entry": "1"}, "b": {"entry": "2", "join": "a.output"}})
    shared = machine.port_nodes(PortName("b", "input"))
    beams = machine.design.problem.lattice.beams
    within = np.flatnonzero(np.isin(beams, shared).all(axis=1))
    parts = dict(machine.parts)
    mask = parts["b"].design.mask.copy()
    mask[np.isin(machine.beams["b"], within[:4])] = False
    parts["b"] = replace(parts["b"], design=Design(parts["b"].design.problem, mask))
    lean = replace(machine, parts=parts)
    # Its springs are not quite those of a joint that both have whole; missing it is 13 %.
    assert linear_assembly(lean).efficiency == pytest.approx(
        linear_assembly(machine).efficiency, rel=0.02
    )


def test_a_bridge_is_an_element_too() -> None:
    machine = build(
        {"a": {"entry": "1"}, "b": {"entry": "2", "at": [-13.0, 0.0]}},
        [{"from": "a.output", "to": "b.input", "kind": "bridge"}],
    )
    assert linear_assembly(machine).efficiency == pytest.approx(whole(machine), rel=1e-3)


@pytest.mark.parametrize("by", ["input", "output"])
def test_what_a_cut_part_still_holds_counts_and_no_more(by: str) -> None:
    # Nothing leads from the input of b to the rest of it, which hangs on a where joined by output.
    joined = {"entry": "2", "join": "a.output", "by": by, "mirror": by == "output"}
    ends = {"output": {"ports": ["a.output"]}}
    whole_part = build({"a": {"entry": "1"}, "b": joined}, **ends)
    part = whole_part.parts["b"].design
    touching = np.isin(part.problem.lattice.beams, part.problem.input.nodes).sum(axis=1)
    cut = part.with_mask(part.mask & (touching != 1))
    machine = assemble(whole_part.plan, lambda entry: actuator(1) if entry == "1" else cut)
    assert linear_assembly(machine).efficiency == pytest.approx(whole(machine), rel=1e-3)
    alone = build({"a": {"entry": "1"}}, **ends)
    free = linear_assembly(machine).efficiency == pytest.approx(
        linear_assembly(alone).efficiency, rel=1e-6
    )
    assert free == (by == "input")


def test_a_part_can_be_driven_by_its_output() -> None:
    parts = {"a": {"entry": "1"}, "b": {"entry": "2", "join": "a.output", "by": "output",
                                        "mirror": True}}  # fmt: skip
    machine = build(parts, output={"ports": ["b.input"]})
    assert linear_assembly(machine).efficiency == pytest.approx(whole(machine), rel=1e-3)


def test_forces_are_not_chained_yet() -> None:
    pushed = {"ports": ["a.input"], "drive": "force", "amount": 0.01}
    machine = build({"a": {"entry": "1"}}, input=pushed, output={"ports": ["a.output"]})
    with pytest.raises(InvalidFile, match=r"input\.drive: .* expects a displacement, got 'force'"):
        linear_assembly(machine)


def test_what_swings_freely_is_refused() -> None:
    machine = build({"a": {"entry": "1"}, "b": {"entry": "hinged", "at": [-40.0, 0.0]}},
                    output={"ports": ["a.output"]})  # fmt: skip
    with pytest.raises(InvalidFile, match="stiffness of the machine is singular"):
        linear_assembly(machine)


def test_two_bridges_from_one_port_count_once_each() -> None:
    parts = {
        "a": {"entry": "1"}, "b": {"entry": "2", "at": [-13.0, 0.0]},
        "c": {"entry": "3", "at": [-8.0, 4.0 * 3.0**0.5], "rotate": 180},
    }  # fmt: skip
    links = [{"from": "a.output", "to": f"{end}.input", "kind": "bridge"} for end in "bc"]
    for port in ("a.output", "b.output", "c.output"):
        machine = build(parts, links, output={"ports": [port]})
        assert linear_assembly(machine).efficiency == pytest.approx(whole(machine), rel=0.01)
