"""Joints of finite size: beams whose ends do not deform."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from bellcrank.mechanics.frames.beams import beam_stiffness, bow_coefficients
from bellcrank.mechanics.frames.evaluator import FrameEvaluator
from bellcrank.mechanics.frames.quantities import quantities
from bellcrank.model import Elasticity, Lattice, Problem, Section, Supports, find_problem
from bellcrank.model.conditions import Input, Output
from bellcrank.part import PartSpec, frame_problem

SECTION = Section(0.2, 0.5)
MATERIAL = Elasticity(100.0, 0.48)


def bending(stiffness: np.ndarray) -> np.ndarray:
    """Return the (2, 2) bending stiffness of a beam in the plane."""
    return np.array([stiffness[[1, 2]], stiffness[[2, 3]]])


@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
@pytest.mark.parametrize("ends", [(0.05, 0.05), (0.1, 0.0), (0.03, 0.08)])
def test_stiffness_equals_that_of_three_beams_of_which_two_are_rigid(
    ends: tuple[float, float], theory: str
) -> None:
    found = beam_stiffness(SECTION, MATERIAL, np.ones(1), theory, 2, np.array([ends]))[0]
    inner = np.array([1.0 - sum(ends)])
    alone = beam_stiffness(SECTION, MATERIAL, inner, theory, 2)[0]
    assert found[0] == pytest.approx(alone[0])
    # End rotations a and b, relative to the chord of the whole beam, move the ends of the part
    # that deforms by e a and -e b, and so turn its chord.
    turn = -np.array(ends) / inner
    relative = np.eye(2) - turn
    assert bending(found) == pytest.approx(relative.T @ bending(alone) @ relative, rel=1e-12)


@pytest.mark.parametrize("joint", [0.0, 0.05, 0.1])
def test_shortening_is_half_the_mean_squared_slope(joint: float) -> None:
    inner = 1.0 - 2.0 * joint
    p, q = bow_coefficients(np.ones(1), joint)[0]
    rng = np.random.default_rng(0)
    for one, two in rng.normal(size=(5, 2)):
        chord = -joint * (one + two) / inner
        a, b = one - chord, two - chord

        def squared(x: float, a: float = a, b: float = b, chord: float = chord) -> float:
            cubic = a * (1.0 - 4.0 * x + 3.0 * x**2) + b * (3.0 * x**2 - 2.0 * x)
            return (chord + cubic) ** 2

        exact = 0.5 * (joint * (one**2 + two**2) + inner * quad(squared, 0.0, 1.0)[0])
        assert p * (one**2 + two**2) + q * one * two == pytest.approx(exact, rel=1e-12)


def cantilever(joint: float) -> Problem:
    """A cantilever of two beams that a force at its tip bends."""
    return Problem(
        name="cantilever",
        lattice=Lattice(np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]), np.array([[0, 1], [1, 2]])),
        supports=Supports(fixed=np.array([0])),
        input=Input(np.array([2]), np.array([[0.0, 1.0]]), "force", 1e-6),
        output=Output(np.array([1]), np.array([[0.0, 1.0]])),
        designable=np.arange(2),
        section=replace(SECTION, joint=joint),
        material=MATERIAL,
    )


@pytest.mark.parametrize("elements", [None, 1, 8])
def test_a_cantilever_deflects_and_strains_as_that_without_its_joints(elements: int | None) -> None:
    joint, force = 0.1, 1e-6
    evaluator = FrameEvaluator(cantilever(joint), elements=elements)
    response = evaluator.evaluate(np.ones(2, dtype=bool))
    rigidity = MATERIAL.young * SECTION.inertia
    # Its curvature is F (2 - x) / EI between the joints.
    tip = sum(
        quad(lambda x: (2.0 - x) ** 2, start + joint, start + 1.0 - joint)[0]
        for start in (0.0, 1.0)
    )
    assert response.displacement[2, 1] == pytest.approx(force / rigidity * tip, rel=1e-6)
    strain = force * (2.0 - joint) * 0.5 * SECTION.width / rigidity
    assert quantities["strain"].value(evaluator.end) == pytest.approx(strain, rel=1e-6)


def test_one_element_and_eight_agree_in_a_lattice_with_joints() -> None:
    problem = frame_problem(find_problem("crane"), PartSpec())
    assert problem.section is not None
    assert problem.section.joint == pytest.approx(0.06)
    one, eight, without = (
        FrameEvaluator(each, elements=elements).evaluate(problem.initial).energy
        for each, elements in (
            (problem, None), (problem, 8), (replace(problem, section=SECTION), 8),
        )
    )  # fmt: skip
    assert one == pytest.approx(eight, rel=2e-3)
    assert without < 0.9 * eight
