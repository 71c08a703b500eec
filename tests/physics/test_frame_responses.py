"""Responses of frames against an independent code (`../shared/reference3d`).

The limits are those of the README there.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank.mechanics import FrameEvaluator
from bellcrank.mechanics.output import output_motion
from tests.reference3d import NAMES, read_reference

if TYPE_CHECKING:
    from bellcrank.mechanics import Response
    from bellcrank.model import Problem

THEORIES = {"bernoulli": "euler-bernoulli", "timoshenko": "timoshenko"}


def respond(
    problem: Problem, entry: dict[str, Any], elements: int
) -> tuple[FrameEvaluator, Response]:
    """Return the evaluator and the response to the problem of an entry."""
    mask = np.unpackbits(np.frombuffer(bytes.fromhex(entry["mask"]), np.uint8))
    driven = replace(problem, input=replace(problem.input, amount=entry["amount"]))
    evaluator = FrameEvaluator(driven, elements=elements, theory=THEORIES[entry["theory"]])
    return evaluator, evaluator.evaluate(mask[: problem.lattice.beam_count].astype(bool))


def errors(name: str, element: str, elements: int) -> dict[str, list[float]]:
    """Return the errors of the efficiency, at the full and at small amounts."""
    problem, data = read_reference(name)
    full = max(entry["amount"] for entry in data["results"])
    found: dict[str, list[float]] = {"full": [], "small": []}
    for entry in data["results"]:
        if entry["element"] == element and entry["status"] == "stable":
            _, response = respond(problem, entry, elements)
            assert response.status.label == "converged"
            amount = "full" if entry["amount"] > 0.3 * full else "small"
            found[amount].append(abs(response.efficiency - entry["efficiency"]))
    return found


@pytest.mark.parametrize("name", NAMES)
def test_one_element_agrees_with_an_independent_corotational_code(name: str) -> None:
    found = errors(name, "corotational", 1)
    # In space one-element results depend on the formulation.
    tolerance = 1e-10 if name == "planar-crane" else 1e-3
    assert max(found["full"] + found["small"]) < tolerance


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_sixteen_elements_agree_with_the_limit_of_many_geometrically_exact_ones(name: str) -> None:
    found = errors(name, "any", 16)
    assert np.median(found["full"]) < 1e-4
    assert max(found["full"]) < 1e-3
    if found["small"]:
        assert np.median(found["small"]) < 5e-6
        assert max(found["small"]) < 5e-5


@pytest.mark.slow
@pytest.mark.parametrize("name", ["planar-crane", "octet-twist", "cubic-bcc-force"])
def test_errors_are_of_second_order_in_the_element(name: str) -> None:
    coarse, fine = (errors(name, "any", elements)["small"] for elements in (4, 8))
    ratio = np.array(coarse) / fine
    assert np.median(ratio) == pytest.approx(4.0, abs=0.4)


@pytest.mark.parametrize("name", ["planar-crane", "octet-crane", "cubic-bcc-force"])
def test_displacement_rotation_and_force_agree_too(name: str) -> None:
    problem, data = read_reference(name)
    dimension = problem.lattice.dimension
    compared = 0
    for entry in data["results"]:
        if entry["element"] == "any" and entry["theory"] == "bernoulli" and compared < 3:
            evaluator, response = respond(problem, entry, 16)
            motion = output_motion(problem, response.displacement)
            turned = np.array(entry["output_rotation_deg"])
            for ours, theirs in (
                (motion.displacement, np.array(entry["mean_output_displacement"])[:dimension]),
                (motion.rotation, turned if dimension == 3 else turned[2]),
                (
                    evaluator.strain().input_forces.sum(axis=0),
                    np.array(entry["input_force"])[:dimension],
                ),
            ):
                assert ours == pytest.approx(theirs, abs=2e-3 * np.abs(theirs).max())
            compared += 1
    assert compared == 3


@pytest.mark.parametrize("name", ["star-dome", "cubic-bcc-force"])
@pytest.mark.parametrize("increment", [1.0, 1.0 / 64.0])
def test_stability_is_lost_at_the_same_load(name: str, increment: float) -> None:
    problem, data = read_reference(name)
    (entry,) = (entry for entry in data["results"] if entry["status"] == "snapped")
    evaluator, response = respond(problem, entry, entry["elements_per_strut"])
    if increment < 1.0:
        mask = np.unpackbits(np.frombuffer(bytes.fromhex(entry["mask"]), np.uint8))
        response = evaluator.evaluate(mask[: problem.lattice.beam_count], increment)
    assert response.status.label == "snapped"
    assert response.reached == pytest.approx(entry["reached"], abs=0.02)
