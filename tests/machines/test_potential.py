"""Potentials: exact where they must be, and honest about their error."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.machines import (
    Potential,
    Reach,
    block_ports,
    fit,
    fit_potential,
    mean_ports,
    sample,
    sampling,
    two_port_at,
    usual_reach,
)
from bellcrank.machines.potential import answers_of, variables_of
from bellcrank.mechanics import Conditions, Linear, Loose, State, Superelement, follow

from ..physics.problems import patch  # noqa: TID252 - the tests' own small problems
from .test_two_port import actuator


def quartic(seed: int = 0) -> Potential:
    """Some potential of three variables, the last one a force."""
    rng = np.random.default_rng(seed)
    quadratic = rng.standard_normal((3, 3))
    return Potential(
        prescribed=np.array([True, True, False]),
        quadratic=quadratic + quadratic.T,
        scale=np.array([0.5, 2.0, 3.0]),
        exponents=np.array([[3, 0, 0], [1, 2, 0], [0, 1, 3], [2, 1, 1], [0, 0, 4]]),
        coefficients=rng.standard_normal(5),
    )


def test_answers_are_derivatives_of_the_potential() -> None:
    potential = quartic()
    x = np.array([0.3, -0.7, 0.4])
    h = 1e-5
    signs = np.where(potential.prescribed, 1.0, -1.0)

    def value(place: np.ndarray) -> float:
        """The potential itself: stored energy less what the load has done."""
        loaded = ~potential.prescribed
        return potential.energy(place) - float(place[loaded] @ potential.answer(place)[loaded])

    slope = [(value(x + h * e) - value(x - h * e)) / (2 * h) for e in np.eye(3)]
    assert potential.answer(x) == pytest.approx(signs * slope, abs=1e-8)
    bend = [
        (potential.answer(x + h * e) - potential.answer(x - h * e)) / (2 * h) for e in np.eye(3)
    ]
    assert potential.transfer(x) == pytest.approx(np.array(bend).T, abs=1e-8)


def test_reciprocity_holds_everywhere() -> None:
    transfer = quartic().transfer(np.array([0.9, 0.1, -1.3]))
    assert transfer[0, 1] == pytest.approx(transfer[1, 0], rel=1e-12)
    assert transfer[0, 2] == pytest.approx(-transfer[2, 0], rel=1e-12)


@pytest.mark.parametrize("degree", [2, 4])
def test_the_quadratic_part_is_the_linear_two_port(degree: int) -> None:
    element = mean_ports(actuator("human:crane"))
    found = fit(element, [degree])
    port = two_port_at(element, element.rest())
    assert found.potential.transfer(np.zeros(2)) == pytest.approx(port.hybrid, rel=1e-9)
    assert found.potential.answer(np.zeros(2)).tolist() == [0.0, 0.0]
    assert found.degree == degree


def test_a_potential_tells_states_that_it_has_not_seen() -> None:
    design = actuator("human:crane")
    element = mean_ports(design)
    found = fit(element, [2, 4, 6])
    assert found.degree == 6
    assert found.lost == 0
    none = np.zeros(2)
    largest = follow(
        element, element.rest(), Conditions([True, False], [0.433, 0.0], none)
    ).state.coordinates[1]
    for motion, force in ((0.433, 0.0), (0.2, -0.02), (0.35, -0.04)):
        state = follow(
            element, element.rest(), Conditions([True, False], [motion, force], none)
        ).state
        told = found.potential.answer(np.array([motion, force]))
        # What is said of the error bounds it on states of the same range, give or take.
        assert abs(told[1] - state.coordinates[1]) < 3.0 * found.error[1] * largest + 1e-6
        energy = found.potential.energy(np.array([motion, force]))
        assert energy == pytest.approx(state.energy, abs=1e-3 * 0.12)
    assert found.error.max() < 0.02
    assert (found.typical_error <= found.error).all()


def test_its_error_is_measured_on_states_that_had_no_part_in_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    taken: list[State] = []

    def noted(*words: Any) -> tuple[list[State], int]:
        states, lost = sample(*words)
        taken.extend(states)
        return states, lost

    monkeypatch.setattr(sampling, "sample", noted)
    found = fit(mean_ports(actuator("human:crane")), [3])
    held_out = taken[::5]
    assert len(held_out) == found.held_out
    assert found.samples == len(taken) - len(held_out) - len(taken[1::5])
    moved = np.array([True, False])
    true = np.array([answers_of(state, moved) for state in taken])
    told = np.array([found.potential.answer(variables_of(state, moved)) for state in held_out])
    missed = (told - true[::5]) / np.abs(true).max(axis=0)
    assert found.error == pytest.approx(np.abs(missed).max(axis=0))
    assert found.typical_error == pytest.approx(np.sqrt((missed**2).mean(axis=0)))


def test_blocks_are_told_to_a_few_percent() -> None:
    found = fit(block_ports(actuator("human:anti-parallel")), [4])
    assert found.error.max() < 0.05
    assert found.held_out > 40
    assert found.samples > 3 * found.held_out - 5


def test_a_cubic_material_is_found_again_exactly() -> None:
    # Samples of a known polynomial, in place of an actuator's.
    element = Superelement(patch().full_design(), [Loose(np.array([8]))])
    states, lost = sample(element, plain_reach(), 60)
    assert lost == 0
    assert len(states) == 60
    potential = fit_potential(element, np.array([True, True]), states, 5)
    linear = fit_potential(element, np.array([True, True]), states, 2)
    x = np.array([0.03, -0.02])
    held = Conditions([True, True], x, np.zeros(2))
    state = follow(element, element.rest(), held).state
    assert potential.answer(x) == pytest.approx(state.force, abs=1e-5)
    assert np.abs(linear.answer(x) - state.force).max() > 1e-3
    assert potential.transfer(x) == pytest.approx(
        Linear(state.stiffness, np.eye(2), held).transfer(), abs=1e-3
    )


def plain_reach() -> Reach:
    return Reach(
        np.array([True, True]), np.array([0.03, 0.0]), np.array([[0.03, 0.0], [0.0, 0.05]])
    )


def test_the_usual_reach_goes_from_free_to_blocked() -> None:
    element = mean_ports(actuator("human:crane"))
    port = two_port_at(element, element.rest())
    reach = usual_reach(element)
    amount = element.design.problem.input.amount
    blocking = -port.transmitted_stiffness * amount
    assert reach.axis == pytest.approx([amount, 0.5 * blocking])
    assert np.abs(reach.spread).sum(axis=1) == pytest.approx([0.0, 0.6 * abs(blocking)])


def test_places_that_snap_are_counted() -> None:
    found = fit(mean_ports(actuator("machine:anti-parallel")), [2, 3])
    assert found.lost > 0
    assert found.error.max() > 0.02


def test_what_cannot_be_fitted_is_refused() -> None:
    element = mean_ports(actuator("human:crane"))
    with pytest.raises(InvalidSettings, match="degrees: expected some of at least 2"):
        fit(element, [])
    with pytest.raises(InvalidSettings, match="degrees"):
        fit(element, [1])
    with pytest.raises(InvalidSettings, match="degree: expected at least 2, got 1"):
        fit_potential(element, np.array([True, False]), [], 1)
    with pytest.raises(InvalidSettings, match="states: expected at least 3 for a polynomial"):
        fit_potential(element, np.array([True, False]), [], 3)
    with pytest.raises(InvalidSettings, match="samples: expected at least one"):
        sample(element, usual_reach(element), 0)
