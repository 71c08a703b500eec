"""Joints of finite size: beams whose ends do not bend."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.integrate import quad

from bellcrank.mechanics.frames.beams import beam_stiffness, bow_coefficients
from bellcrank.mechanics.frames.evaluator import FrameEvaluator
from bellcrank.mechanics.frames.joints import with_joints
from bellcrank.mechanics.frames.quantities import quantities
from bellcrank.model import (
    Elasticity,
    Lattice,
    Problem,
    Section,
    Supports,
    find_problem,
    gallery_design,
)
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
    whole = beam_stiffness(SECTION, MATERIAL, np.ones(1), theory, 2)[0]
    assert found[0] == pytest.approx(whole[0])  # joints stretch
    # End rotations a and b, relative to the chord of the whole beam, move the ends of the part
    # that deforms by e a and -e b, and so turn its chord.
    turn = -np.array(ends) / inner
    relative = np.eye(2) - turn
    assert bending(found) == pytest.approx(relative.T @ bending(alone) @ relative, rel=1e-12)


@pytest.mark.parametrize("joints", [(0.0, 0.0), (0.1, 0.1), (0.05, 0.2)])
def test_shortening_is_half_the_mean_squared_slope(joints: tuple[float, float]) -> None:
    inner = 1.0 - sum(joints)
    p, q, r = bow_coefficients(np.ones(1), np.array([joints]))[0]
    rng = np.random.default_rng(0)
    for one, two in rng.normal(size=(5, 2)):
        chord = -(joints[0] * one + joints[1] * two) / inner
        a, b = one - chord, two - chord

        def squared(x: float, a: float = a, b: float = b, chord: float = chord) -> float:
            cubic = a * (1.0 - 4.0 * x + 3.0 * x**2) + b * (3.0 * x**2 - 2.0 * x)
            return (chord + cubic) ** 2

        ends = joints[0] * one**2 + joints[1] * two**2
        exact = 0.5 * (ends + inner * quad(squared, 0.0, 1.0)[0])
        assert p * one**2 + q * one * two + r * two**2 == pytest.approx(exact, rel=1e-12)


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


@pytest.mark.parametrize("of_design", [False, True])
def test_one_element_and_eight_agree_in_a_lattice_with_joints(of_design: bool) -> None:
    found = gallery_design("machine", "crane")
    assert found is not None
    mask = found.mask
    problem = frame_problem(found.problem, PartSpec())
    assert problem.section is not None
    assert problem.section.joint == pytest.approx(0.06)
    if of_design:
        problem = with_joints(problem, mask)
    small = replace(problem, input=replace(problem.input, amount=0.1 * problem.input.amount))
    points = replace(small, section=SECTION, joints=None)
    one, eight, without = (
        FrameEvaluator(each, elements=elements).evaluate(mask).energy
        for each, elements in ((small, None), (small, 8), (points, 8))
    )
    assert one == pytest.approx(eight, rel=2e-3)
    assert without < (0.9 if of_design else 0.95) * eight


def joints_of(
    angles: list[float], widths: list[float] | None = None, length: float = 1.0
) -> np.ndarray:
    """Return the joints at the common node of beams at given angles, degrees."""
    turns = np.radians(angles)
    ends = length * np.column_stack([np.cos(turns), np.sin(turns)])
    lattice = Lattice(
        np.concatenate([np.zeros((1, 2)), ends]),
        np.column_stack([np.zeros(len(angles), np.int64), 1 + np.arange(len(angles))]),
    )
    problem = Problem(
        name="star",
        lattice=lattice,
        supports=Supports(fixed=np.array([1])),
        input=Input(np.array([2]), np.array([[0.0, 1.0]]), "displacement", 0.01),
        output=Output(np.array([0]), np.array([[0.0, 1.0]])),
        designable=np.arange(len(angles)),
        section=replace(SECTION, joint=0.06),
        material=MATERIAL,
        widths=None if widths is None else np.array(widths),
    )
    found = with_joints(problem, np.ones(len(angles), dtype=bool)).joints
    assert found is not None
    assert not found[:, 1].any()
    return found[:, 0]


def test_joints_end_where_the_edges_of_neighbours_meet() -> None:
    width = SECTION.width
    # Six beams meet at 60 degrees on both sides, three at 120 degrees, opposite ones nowhere.
    half = 0.5 * width
    # Rounding next to opposite beams and at right angles changes the lengths by less than 1 %.
    approx = partial(pytest.approx, rel=0.01)
    assert joints_of([0, 60, 120, 180, 240, 300]) == approx(np.full(6, half * np.sqrt(3.0)))
    assert joints_of([0, 120, 240]) == approx(np.full(3, half / np.sqrt(3.0)))
    assert joints_of([0, 180]) == pytest.approx(np.zeros(2))
    # The mean of both sides; at a right angle it is half the width of the other beam.
    assert joints_of([0, 90], [0.2, 0.3]) == approx([0.075, 0.05])
    # At 60 degrees by the sum (a + b / 2) / sin(60) of half widths.
    assert joints_of([0, 60], [0.2, 0.3])[0] == approx(0.5 * 0.2 / np.sin(np.pi / 3))


def test_a_joint_takes_at_most_two_fifths_of_a_beam() -> None:
    assert joints_of([0, 10]) == pytest.approx([0.4, 0.4])


def test_joints_have_no_kinks() -> None:
    """Their derivative is continuous, at right angles and near the largest size too."""
    step = 0.05
    angles = np.arange(15.0, 120.0, step)
    lengths = np.array([joints_of([0, angle], [0.2, 0.3]) for angle in angles])
    bend = np.diff(lengths, 2, axis=0) / step
    assert np.abs(bend).max() < 1e-3


def test_joints_that_are_points_or_in_space_stay_as_they_are() -> None:
    crane = find_problem("crane")
    assert with_joints(crane, crane.initial) is crane
    points = replace(crane, section=SECTION)
    assert with_joints(points, crane.initial) is points
