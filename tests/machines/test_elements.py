"""Arms, potentials and elements: their derivatives are those of finite differences."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank.errors import InvalidFile
from bellcrank.machines import Potential
from bellcrank.machines.blocks import blocks_of
from bellcrank.machines.elements import OUT, Live, Tabled
from bellcrank.machines.equilibria import Chain
from bellcrank.machines.members import Arm
from bellcrank.machines.potential import exponents_of
from bellcrank.machines.standing import linear
from bellcrank.mechanics import Rigid

from .actuators import SOFT, STRONG, build, machine

if TYPE_CHECKING:
    from numpy.typing import NDArray

STEP = 1e-6


def difference(function: Any, at: NDArray[np.float64]) -> NDArray[np.float64]:
    """(.., n) central differences of a function by each of its n arguments."""
    columns = [
        (np.asarray(function(at + step)) - np.asarray(function(at - step))) / (2.0 * STEP)
        for step in STEP * np.eye(len(at))
    ]
    return np.stack(columns, axis=-1)


@pytest.fixture
def potential() -> Potential:
    """Some stable one, with cubic and quartic terms."""
    rng = np.random.default_rng(1)
    lever, exponents = rng.normal(size=(3, 3)), exponents_of(6, 4)
    quadratic = np.block([[2.0 * np.eye(3), lever.T], [lever, -3.0 * np.eye(3)]])
    return Potential(
        prescribed=np.arange(6) < 3,
        quadratic=quadratic,
        scale=rng.uniform(0.5, 2.0, 6),
        exponents=exponents,
        coefficients=0.05 * rng.normal(size=len(exponents)),
    )


def test_a_potential_expands_to_its_derivatives(potential: Potential) -> None:
    x = np.random.default_rng(2).uniform(-0.5, 0.5, 6)
    value, slope, bend = potential.expand(x)
    assert slope == pytest.approx(difference(lambda y: potential.expand(y)[0], x), abs=1e-8)
    assert bend == pytest.approx(difference(lambda y: potential.expand(y)[1], x), abs=1e-8)
    sign = np.where(potential.prescribed, 1.0, -1.0)
    assert sign * slope == pytest.approx(potential.answer(x), abs=1e-12)
    assert sign[:, None] * bend == pytest.approx(potential.transfer(x), abs=1e-12)
    assert value + slope[OUT] @ -x[OUT] == pytest.approx(potential.energy(x), abs=1e-12)


def test_an_arm_turns_with_its_block() -> None:
    frame = np.diag([-1.0, 1.0, -1.0])
    arm = Arm(0, np.array([2.0, -1.0]), frame)
    q, force = np.array([0.1, 0.2, 0.7]), np.array([0.3, -0.4, 0.5])
    assert arm.motions(q) == pytest.approx(difference(arm.place, q), abs=1e-8)
    bend = difference(lambda p: force @ arm.motions(p), q)
    assert arm.bend(q, force) == pytest.approx(bend, abs=1e-8)
    assert not arm.place(np.zeros(3)).any()


def settled(element: Tabled | Live, q: NDArray[np.float64]) -> Any:
    """Follow a motion of the ports until the interior is in equilibrium."""
    memory, felt = element.begin(), None
    for part in np.linspace(0.1, 1.0, 10):
        for _ in range(8):
            felt = element.feel(part * q, memory)
            assert felt is not None
            memory = felt.advance(np.zeros(6))
    felt = element.feel(q, memory)
    assert felt is not None
    assert felt.departure < 1e-10
    return felt


def test_an_output_that_sits_beside_the_middle_of_its_block_turns_with_it() -> None:
    rng = np.random.default_rng(3)
    found = blocks_of(machine("row"))
    offset = rng.standard_normal(found.offset.shape)
    angle = rng.uniform(0.0, 2.0 * np.pi, len(offset))
    direction = np.column_stack([np.cos(angle), np.sin(angle)])
    blocks = replace(found, offset=offset, direction=direction)
    q = np.zeros_like(blocks.stroke)
    (block,) = set(blocks.moved.tolist())
    q[block] = [0.3, -0.2, 0.7]
    moved = Rigid(np.arange(len(offset)), offset, np.zeros(2)).place(q[block])
    assert blocks.output(q) == pytest.approx((moved * direction).sum(axis=1).mean())
    step = 1e-6 * q
    difference = (blocks.output(step) - blocks.output(-step)) / 2.0
    assert blocks.output_slope(step) == pytest.approx(difference, rel=1e-6)


@pytest.mark.parametrize("kind", ["table", "live"])
def test_what_an_element_feels_is_the_slope_of_its_energy(kind: str, potential: Potential) -> None:
    live = Live(blocks_of(machine("row")).members[1].body.element)
    element = Tabled(potential) if kind == "table" else live
    q = np.array([0.01, -0.05, 0.01, 0.02, -0.03, 0.02])
    felt = settled(element, q)
    slope = difference(lambda at: settled(element, at).energy, q)
    assert felt.force == pytest.approx(slope, abs=1e-7)
    bend = difference(lambda at: settled(element, at).force, q)
    assert felt.stiffness == pytest.approx(bend, abs=1e-5)
    assert felt.stiffness == pytest.approx(felt.stiffness.T, abs=1e-12)


def test_a_table_whose_output_would_give_way_is_no_place_to_be(potential: Potential) -> None:
    weak = Potential(
        potential.prescribed, -potential.quadratic, potential.scale, potential.exponents,
        potential.coefficients,
    )  # fmt: skip
    assert Tabled(weak).feel(np.zeros(6), np.zeros(3)) is None


def test_the_stiffness_of_a_machine_is_symmetric_wherever_it_is() -> None:
    for kind in ("turned", "bridge"):
        blocks = blocks_of(machine(kind))
        chain = Chain(blocks, [Live(member.body.element) for member in blocks.members])
        moved = chain.moved(chain.rest, chain.at_rest, chain.tangent(chain.at_rest, 0.5))
        arrived = chain.settle(moved)
        assert arrived is not None
        for found in (chain.at_rest, arrived[1]):
            size = np.abs(found.stiffness).max()
            assert np.abs(found.stiffness - found.stiffness.T).max() < 1e-8 * size
            assert np.linalg.eigvalsh(found.stiffness)[0] > -1e-8 * size


def test_ports_are_reciprocal_in_the_chain() -> None:
    # Maxwell and Betti: push a and feel at b, or push b and feel at a.
    parts = {"a": STRONG, "b": {**SOFT, "join": "a.output"}}
    blocks = blocks_of(build(parts, ["b.output"]))
    chain = Chain(blocks, [linear(member).element for member in blocks.members])
    give = np.linalg.inv(chain.at_rest.stiffness[3:, 3:])
    assert give == pytest.approx(give.T, rel=1e-8, abs=1e-10)


def test_parts_of_one_kind_share_a_body() -> None:
    blocks = blocks_of(machine("gripper"))
    first, second = (member.body for member in blocks.members)
    assert first is second
    assert blocks.members[0].arms[0].block == blocks.members[1].arms[0].block


def test_a_block_that_swings_freely_is_named() -> None:
    built = build({"a": STRONG, "b": {**SOFT, "join": "a.output"}}, ["b.output"])
    blocks = blocks_of(built)

    class Slack(Tabled):
        """Resists nothing."""

        def feel(self, q: NDArray[np.float64], memory: NDArray[np.float64]) -> Any:
            felt = Tabled.feel(self, q, memory)
            assert felt is not None
            felt.stiffness[3:] = felt.stiffness[:, 3:] = 0.0
            felt.stiffness[3, 3] = 1e-15
            return felt

    elements = [linear(member).element for member in blocks.members]
    slack = Slack(elements[1].potential)  # type: ignore[attr-defined]
    with pytest.raises(InvalidFile, match=r"chain\.toml: b\.output swings freely"):
        Chain(blocks, [elements[0], slack])


def test_a_drive_that_would_bend_a_port_is_refused() -> None:
    built = build(
        {"a": SOFT, "b": {**SOFT, "join": "a.input", "mirror": True}}, ["a.output", "b.output"]
    )
    directions = built.design.problem.input.direction
    directions.flags.writeable = True
    directions[0] = [1.0, 0.0]
    with pytest.raises(InvalidFile, match=r"moves the nodes of a\.input apart"):
        blocks_of(built)
