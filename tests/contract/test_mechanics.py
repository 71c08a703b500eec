"""Properties of every registered objective, and of evaluators."""

from __future__ import annotations

import numpy as np
import pytest

from bellcrank.errors import InvalidProblem, InvalidSettings, UnknownName
from bellcrank.mechanics import (
    SpringEvaluator,
    Status,
    efficiency_of,
    objective_of,
    objectives,
)
from bellcrank.model import Input, Lattice, Output, Problem, Supports

POSITIONS = [[0, 0], [1, 0], [0.5, 0.9], [1.5, 0.9], [1, 1.8]]
BEAMS = [[0, 2], [0, 3], [1, 2], [1, 3], [2, 3], [2, 4], [3, 4]]

DRIVES = {
    "displacement": (Input([4], [0.0, -1.0], "displacement", 0.05), Output([2], [-1.0, 0.0])),
    "force": (Input([4], [0.0, -1.0], "force", 0.02), Output([2], [-1.0, 0.0], 0.5)),
}


def tiny(drive: str) -> Problem:
    """Five nodes and seven beams, two of the nodes held."""
    given, watched = DRIVES[drive]
    return Problem(
        name=f"tiny {drive}",
        lattice=Lattice(POSITIONS, BEAMS),
        supports=Supports(fixed=[0, 1]),
        input=given,
        output=watched,
        designable=[1, 2, 4],
    )


def suits(objective: str, drive: str) -> bool:
    try:
        objective_of(tiny(drive), objective)
    except InvalidSettings:
        return False
    return True


@pytest.mark.parametrize("objective", list(objectives))
def test_every_objective_suits_some_drive(objective: str) -> None:
    assert any(suits(objective, drive) for drive in DRIVES)


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("objective", list(objectives))
def test_every_objective_gives_a_number_or_says_why_not(objective: str, drive: str) -> None:
    problem = tiny(drive)
    if not suits(objective, drive):
        with pytest.raises(InvalidSettings, match=objective):
            SpringEvaluator(problem, objective)
        return
    evaluator = SpringEvaluator(problem, objective)
    response = evaluator.evaluate(problem.initial)
    assert response.status is Status.CONVERGED
    assert np.isfinite(response.efficiency)
    measured = efficiency_of(problem, response.displacement, objective)
    assert measured == pytest.approx(response.efficiency, rel=1e-12)
    assert np.isfinite(evaluator.sensitivity(problem.initial)).all()


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("objective", list(objectives))
def test_every_objective_turns_its_sign_with_the_output(objective: str, drive: str) -> None:
    if not suits(objective, drive):
        pytest.skip(f"{objective} does not suit a {drive} drive")
    problem = tiny(drive)
    along = objective_of(problem, objective)
    assert along.numerator_scale > 0.0
    assert along.exponent >= 2.0


def test_two_evaluations_give_the_same_bits() -> None:
    problem = tiny("displacement")
    first = SpringEvaluator(problem).evaluate(problem.initial)
    second = SpringEvaluator(problem).evaluate(problem.initial)
    assert first.efficiency == second.efficiency
    assert first.energy == second.energy
    assert (first.displacement == second.displacement).all()


def test_a_mechanism_is_recognised() -> None:
    problem = tiny("force")
    none = np.zeros(len(BEAMS), dtype=bool)
    response = SpringEvaluator(problem).evaluate(none)
    assert response.status is Status.MECHANISM
    assert np.isnan(response.efficiency)


def test_loose_pieces_stay_at_rest() -> None:
    problem = tiny("displacement")
    cut = np.array([True, True, True, True, True, False, False])
    response = SpringEvaluator(problem).evaluate(cut)
    assert response.status is Status.CONVERGED
    assert response.efficiency == 0.0
    assert (response.displacement[:4] == 0.0).all()


@pytest.mark.parametrize("status", list(Status))
def test_every_status_has_a_word_and_a_sentence(status: Status) -> None:
    assert status.label == status.name.lower()
    assert len(status.message.split()) > 5


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"objective": "speed"}, UnknownName),
        ({"objective": "displacement:3"}, InvalidSettings),
        ({"objective": "directional:1.5"}, InvalidSettings),
        ({"objective": "directional:much"}, InvalidSettings),
        ({"unloaded_beams": "sometimes"}, InvalidSettings),
    ],
)
def test_what_does_not_exist_is_refused_by_name(options: dict[str, str], error: type) -> None:
    value = next(iter(options.values()))
    with pytest.raises(error, match=value.split(":")[0]):
        SpringEvaluator(tiny("displacement"), **options)


def test_a_mask_of_the_wrong_length_is_refused() -> None:
    with pytest.raises(InvalidProblem, match=r"expected shape \(7,\)"):
        SpringEvaluator(tiny("displacement")).evaluate(np.ones(8, dtype=bool))
