"""Amplitude of the strain in cycles of the stroke."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bellcrank.mechanics import Channel
from bellcrank.mechanics.frames.analysis import (
    deformations,
    normal_strains,
    strain_amplitude,
    stress_resultants,
)
from bellcrank.mechanics.frames.case import CaseEvaluator
from bellcrank.model import (
    Elasticity,
    Input,
    Lattice,
    Output,
    Problem,
    Section,
    Supports,
    find_problem,
    human_design,
)
from bellcrank.part import PartSpec, frame_problem

LENGTH, WIDTH = 10.0, 0.2


def cantilever(amount: float, *, dimension: int) -> CaseEvaluator:
    """A straight strut, held at one end, whose other end moves sideways."""
    positions = np.zeros((3, dimension))
    positions[1:, 0] = 0.5 * LENGTH, LENGTH
    sideways = np.zeros(dimension)
    sideways[-1] = np.sign(amount)
    problem = Problem(
        name="cantilever",
        lattice=Lattice(positions=positions, beams=np.array([[0, 1], [1, 2]])),
        supports=Supports(fixed=[0]),
        input=Input(nodes=[2], direction=sideways, amount=abs(amount), drive="displacement"),
        output=Output(nodes=[1], direction=sideways),
        section=Section(WIDTH, 0.5) if dimension == 2 else Section.round(WIDTH),
        material=Elasticity(young=1.0, poisson=0.3),
        designable=[0, 1],
    )
    evaluator = CaseEvaluator(problem, 8)
    evaluator.respond(np.ones(2, dtype=bool))
    return evaluator


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_bent_strut_has_half_its_largest_bending_strain(dimension: int) -> None:
    """3 w d / (2 L^2) at its support, of which each fibre has the range from 0."""
    deflection = 1e-4  # larger ones stretch the strut too
    state = cantilever(deflection, dimension=dimension).state(1.0)
    assert state is not None
    expected = 0.5 * 3.0 * 0.5 * WIDTH * deflection / LENGTH**2
    assert strain_amplitude([state]) == pytest.approx(expected, rel=1e-3)


def test_strains_of_both_signs_add() -> None:
    """A stroke that would bend to both sides has the amplitude of one side, not half of it."""
    states = [cantilever(amount, dimension=2).state(1.0) for amount in (1e-4, -1e-4)]
    one, both = strain_amplitude(states[:1]), strain_amplitude(states)
    assert both == pytest.approx(2.0 * one, rel=1e-3)


@pytest.mark.parametrize("name", ["crane", "orthogonal"])
def test_the_largest_principal_strain_follows_from_the_fibres(name: str) -> None:
    design = human_design(name) or find_problem(name).full_design()
    problem = frame_problem(design.problem, PartSpec())
    problem = replace(problem, input=replace(problem.input, amount=0.05 * problem.input.amount))
    evaluator = CaseEvaluator(problem)
    evaluator.respond(design.mask)
    state = evaluator.state(1.0)
    assert state is not None
    frame, beams = state.frame, np.flatnonzero(state.structure.present)
    found = deformations(frame, beams, *state.ends(beams))
    strain = normal_strains(frame, problem, beams, stress_resultants(frame, beams, found))
    channel = Channel("strain")
    principal = float(evaluator.values([channel], [1.0])[channel].max())
    assert problem.material is not None
    by_fibres = max(strain.max(), -problem.material.poisson * strain.min())
    if problem.lattice.dimension == 2:
        assert by_fibres == pytest.approx(principal, rel=1e-9)
    else:  # torsion adds to it
        assert 0.9 * principal < by_fibres <= principal * (1.0 + 1e-9)
