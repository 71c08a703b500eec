"""Strokes foretold from parts alone are those of the whole lattice."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from bellcrank.errors import InvalidFile, InvalidSettings
from bellcrank.machines import (
    assemble,
    block_ports,
    compare,
    fit,
    foretell,
    foretold_to_dict,
    predict,
    ranges,
    simulate,
)
from bellcrank.machines import foretelling as module
from bellcrank.machines.blocks import blocks_of
from bellcrank.machines.elements import IN, OUT, Live
from bellcrank.machines.foretelling import way_of
from bellcrank.machines.standing import DEGREES, linear
from bellcrank.machines.stroke import follow_stroke, straight
from bellcrank.mechanics import Status

from .actuators import KINDS, SOFT, STRONG, actuator, build, machine

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.machines import Foretold, Machine
    from bellcrank.machines.blocks import Blocks
    from bellcrank.machines.standing import Stand
    from bellcrank.machines.stroke import Stroke

POINTS = 8
STATED = 0.01
"""Largest difference from the simulation, in docs/machines.md, for machines like these."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Tables that several tests use."""
    return tmp_path_factory.mktemp("potentials")


def told(built: Machine, folder: Path, points: int = POINTS, **more: Any) -> Foretold:
    return foretell(built, points, folder=folder, **more)


@pytest.mark.parametrize("live", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_the_stroke_is_that_of_the_whole_lattice(kind: str, live: bool, folder: Path) -> None:
    built = machine(kind)
    found = told(built, folder, live=live)
    check = compare(found, simulate(built, POINTS))
    assert found.stroke.reached == 1.0
    assert check.output_error < STATED
    assert check.force_error < STATED
    assert all((stand.kind == "itself") == live for stand in found.stands)


def test_that_says_more_than_the_linear_answer(folder: Path) -> None:
    # Else the tables would have had nothing to do.
    built = machine("turned")
    whole = simulate(built, POINTS)
    assert abs(predict(built).efficiency / whole.efficiency[-1] - 1.0) > 0.2


def test_far_beyond_the_usual_stroke_tables_are_made_around_the_way(folder: Path) -> None:
    built = machine("turned", drive={"amount": 0.4})
    found = told(built, folder)
    check = compare(found, simulate(built, POINTS))
    assert {stand.kind for stand in found.stands} == {"around"}
    assert check.output_error < 0.03
    assert not found.doubts


@pytest.mark.parametrize("live", [False, True])
@pytest.mark.parametrize("kind", ["row", "bridge"])
def test_energy_is_the_work_of_the_input(kind: str, live: bool, folder: Path) -> None:
    found = told(machine(kind), folder, points=40, live=live)
    for curve in (found, found.stroke):
        work = cumulative_simpson(curve.input_force, x=curve.motion, initial=0.0)
        assert curve.energy == pytest.approx(work, abs=1e-6 * work[-1])


@pytest.mark.parametrize("live", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_forces_and_motions_balance_at_every_block(kind: str, live: bool, folder: Path) -> None:
    built = machine(kind)
    found = told(built, folder, live=live)
    blocks, stroke = blocks_of(built), found.stroke
    for q, ports, forces in zip(stroke.blocks, stroke.ports, stroke.forces, strict=True):
        total = np.zeros_like(q)
        for member, at, force in zip(blocks.members, ports, forces, strict=True):
            for arm, part in zip(member.arms, (IN, OUT), strict=True):
                assert at[part] == pytest.approx(arm.place(q[arm.block]), abs=1e-12)
                total[arm.block] += arm.motions(q[arm.block]).T @ force[part]
        assert np.abs(total[~blocks.driven]).max(initial=0.0) < 1e-8
    for stand, way, ports, forces in zip(
        found.stands,
        way_of(stroke).transpose(1, 0, 2),
        stroke.ports.transpose(1, 0, 2),
        stroke.forces.transpose(1, 0, 2),
        strict=True,
    ):
        if stand.fit is not None:
            answers = np.array([stand.fit.potential.answer(x) for x in way])
            assert answers[:, IN] == pytest.approx(forces[:, IN], abs=1e-8)
            assert answers[:, OUT] == pytest.approx(ports[:, OUT], abs=1e-8)


@pytest.mark.parametrize(("degrees", "mirror"), [(60, False), (180, False), (0, True), (300, True)])
@pytest.mark.parametrize("kind", ["row", "turned"])
def test_turned_and_mirrored_as_a_whole_it_does_the_same(
    kind: str, degrees: int, mirror: bool, folder: Path
) -> None:
    expected = told(machine(kind), folder)
    found = told(machine(kind, degrees, mirror=mirror), folder)
    assert found.output == pytest.approx(expected.output, abs=1e-8)
    assert found.input_force == pytest.approx(expected.input_force, abs=1e-8)


def test_a_part_of_another_size_has_tables_of_its_own(folder: Path) -> None:
    parts = {"a": {**STRONG, "scale": 2.0}, "b": {**SOFT, "scale": 2.0, "join": "a.output"}}
    built = build(parts, ["b.output"])
    check = compare(told(built, folder), simulate(built, POINTS))
    assert max(check.output_error, check.force_error) < STATED


def test_a_part_without_supports_is_carried_along(folder: Path) -> None:
    parts = {"a": STRONG, "b": {**SOFT, "join": "a.output", "supports": False}}
    built = build(parts, ["b.output"])
    check = compare(told(built, folder), simulate(built, POINTS))
    assert max(check.output_error, check.force_error) < STATED


def test_a_chain_can_be_driven_from_either_end(folder: Path) -> None:
    parts = {"a": STRONG, "b": {**SOFT, "join": "a.output", "by": "output", "mirror": True}}
    for pushed, moved in (("a.input", "b.input"), ("b.input", "a.input")):
        built = build(parts, [moved], inputs=[pushed])
        check = compare(told(built, folder), simulate(built, POINTS))
        assert max(check.output_error, check.force_error) < 2.0 * STATED


def test_rigid_ports_alone_are_not_enough_and_the_linear_chain_puts_them_right(
    folder: Path,
) -> None:
    built = machine("row")
    found, whole = told(built, folder), simulate(built, POINTS)
    true = whole.efficiency[-1]
    by_rigid_ports = found.stroke.output[-1] / found.stroke.motion[-1]
    assert abs(by_rigid_ports - true) > 5.0 * abs(found.efficiency - true)
    assert found.linear.efficiency == predict(built).efficiency
    slope = (found.output[1] - found.output[0]) / found.motion[1]
    assert slope == pytest.approx(found.linear.efficiency, rel=0.01)


def test_where_a_table_ends_is_said_with_the_name_of_its_part(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "TOLERATED", 0.5)
    found = told(machine("row"), folder)
    assert any(
        doubt.startswith("b goes beyond the range of its table from") for doubt in found.doubts
    )
    assert foretold_to_dict(found)["doubts"] == list(found.doubts)


def test_a_part_that_is_no_polynomial_is_followed_itself(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bellcrank.machines.standing.ROUGH", 1e-9)
    found = told(machine("row"), folder)
    assert [stand.kind for stand in found.stands] == ["itself", "itself"]
    assert "a has no table and is followed itself: a polynomial of degree" in found.doubts[0]
    expected = told(machine("row"), folder, live=True)
    assert found.output == pytest.approx(expected.output, abs=1e-12)


def test_a_part_that_nothing_moves_stays_at_rest(folder: Path) -> None:
    built = build({"a": STRONG, "b": {**SOFT, "at": [-30.0, 0.0]}}, ["a.output"])
    found = told(built, folder)
    assert found.stands[1].kind == "linear"
    assert not found.stroke.blocks[:, 2:].any()
    assert compare(found, simulate(built, POINTS)).output_error < STATED


def test_live_parts_of_blocks_are_the_linear_chain_of_blocks_for_small_strokes() -> None:
    built = machine("turned", drive={"amount": 1e-5})
    blocks = blocks_of(built)
    expected = straight(blocks, [linear(member).element for member in blocks.members])
    stroke = follow_stroke(blocks, [Live(member.body.element) for member in blocks.members], 1)
    assert stroke.output[-1] / stroke.motion[-1] == pytest.approx(expected.efficiency, rel=1e-3)
    assert stroke.input_force[-1] / 1e-5 == pytest.approx(expected.input_stiffness, rel=1e-3)


@pytest.mark.parametrize("port", ["input", "output"])
@pytest.mark.parametrize("name", ["a", "b"])
def test_a_part_that_has_lost_a_port_moves_nothing_beyond_it(
    name: str, port: str, folder: Path
) -> None:
    whole = machine("row")
    part = whole.parts[name].design
    nodes = whole.parts[name].region(port).nodes
    touching = np.isin(part.problem.lattice.beams, nodes).sum(axis=1)
    cut = part.with_mask(part.mask & (touching != 1))
    entry = whole.plan.table.parts[name].entry
    built = assemble(whole.plan, lambda given: cut if given == entry else actuator(given))
    found = told(built, folder)
    assert np.abs(found.output).max() < 1e-12
    assert compare(found, simulate(built, POINTS)).force_error < STATED


def test_what_cannot_be_foretold_is_refused_in_words(folder: Path) -> None:
    forced = build({"a": STRONG}, ["a.output"], drive={"drive": "force", "amount": 0.01})
    with pytest.raises(InvalidFile, match="driven by a displacement"):
        told(forced, folder)
    with pytest.raises(InvalidSettings, match="points: expected at least one"):
        told(machine("row"), folder, points=0)


def test_a_table_that_is_known_already_is_not_made_again(folder: Path, tmp_path: Path) -> None:
    built = machine("gripper")
    known = fit(block_ports(built.parts["a"].design), DEGREES)
    found = told(built, tmp_path, known={"a": known, "b": known})
    assert all(stand.fit is known for stand in found.stands)
    assert not list(tmp_path.iterdir())
    assert found.output == pytest.approx(told(built, folder).output, abs=1e-8)


def test_parts_are_followed_where_tables_lose_their_stability(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lose(
        blocks: Blocks, _ways: Any, points: int, _make: Any
    ) -> tuple[tuple[Stand, ...], Stroke, float]:
        stands = tuple(linear(member) for member in blocks.members)
        stroke = follow_stroke(blocks, [stand.element for stand in stands], points)
        return stands, replace(stroke, status=Status.SNAPPED, reached=0.25), 0.0

    monkeypatch.setattr("bellcrank.machines.foretelling._by_tables", lose)
    found = told(machine("row"), folder)
    assert [stand.kind for stand in found.stands] == ["itself", "itself"]
    assert found.stroke.status is Status.CONVERGED
    assert [stand.reason for stand in found.stands] == [
        "by tables, stability is lost at 25.0% of the stroke"
    ] * 2
    expected = told(machine("row"), folder, live=True)
    assert found.output == pytest.approx(expected.output, abs=1e-12)


def test_what_ports_that_give_make_of_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    built = machine("row")
    assert foretell(built, 1, live=True).doubts == ()
    monkeypatch.setattr(module, "BENT", 1e-3)
    (doubt,) = foretell(built, 1, live=True).doubts
    rigid = straight(blocks_of(built), [linear(each).element for each in blocks_of(built).members])
    assert doubt == (
        "ports that give make much of it: the linear efficiency is "
        f"{predict(built).efficiency:.4g}, with rigid ports {rigid.efficiency:.4g}"
    )


def test_a_comparison_says_how_far_off_it_is_as_far_as_both_go() -> None:
    built = machine("row")
    found, whole = foretell(built, 4, live=True), simulate(built, 4)
    same = replace(whole, output=found.output, input_force=found.input_force)
    assert (compare(found, same).output_error, compare(found, same).force_error) == (0.0, 0.0)
    other = replace(same, output=1.25 * found.output, input_force=0.8 * found.input_force)
    assert compare(found, other).output_error == pytest.approx(0.2)
    assert compare(found, other).force_error == pytest.approx(0.25)
    early = replace(other, motion=other.motion[:3], output=other.output[:3].copy(),
                    input_force=other.input_force[:3])  # fmt: skip
    early.output[:2] = found.output[:2]
    assert compare(found, early).output_error == pytest.approx(0.2)


def test_where_a_machine_snaps_is_foretold(folder: Path) -> None:
    # Driven 25 times as far as it was made for.
    built = build({"a": STRONG, "b": {**STRONG, "join": "a.output"}}, ["b.output"],
                  drive={"amount": 3.5})  # fmt: skip
    whole, found = simulate(built, POINTS), told(built, folder, live=True)
    assert whole.status is found.stroke.status is Status.SNAPPED
    assert found.stroke.reached == pytest.approx(whole.reached, abs=0.02)
    assert any(doubt.startswith("stability is lost at 7") for doubt in found.doubts)
    assert compare(found, whole).output_error < 0.15


def test_ranges_are_measured_along_and_across_the_way() -> None:
    built = machine("row")
    body = blocks_of(built).members[0].body
    way = np.array([0.0, -0.1, 0.0, 0.0, 0.01, 0.0])
    assert body.bend is not None
    span = ranges.Range(ranges.around(body, body.bend, way))
    assert span.excess(way) < 1.0 < span.excess(1.5 * way)
    assert span.excess(-0.5 * way) > 1.0
    assert span.excess(way + 0.05 * np.eye(6)[0]) > 1.0
