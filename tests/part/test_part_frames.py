"""Frames that represent parts, and work that is only defined in the plane."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bellcrank.errors import BellcrankError, InvalidProblem, InvalidSettings, UnknownName
from bellcrank.fem import FemSettings
from bellcrank.machines.library import library
from bellcrank.machines.library.tasks import straight_motion
from bellcrank.model import (
    Elasticity,
    Input,
    Lattice,
    Output,
    Problem,
    Section,
    Supports,
    find_problem,
)
from bellcrank.part import Material, Part, PartSpec, frame_problem, materials, spring_problem
from bellcrank.task.units import units_of
from bellcrank.workflows.fabricate import Grips
from bellcrank.workflows.validation import spec_for, validate


def in_space() -> Problem:
    """A tower of two tetrahedra."""
    return Problem(
        name="tower",
        lattice=Lattice(
            [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.9, 0.9, 1.0]],
            [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3], [1, 4], [2, 4], [3, 4]],
        ),
        supports=Supports(fixed=[0, 1, 2]),
        input=Input([3], [0, 0, -1], "displacement", 0.1),
        output=Output([4], [0, 0, 1]),
        designable=[8],
        section=Section.round(0.1),
    )


@pytest.mark.parametrize("name", ["crane", "pliers", "discs"])
def test_beams_of_a_frame_have_the_stiffness_of_the_springs(name: str) -> None:
    problem = find_problem(name)
    frame = frame_problem(problem, PartSpec(width=1.6, thickness=4.0, scale=8.0, material="pla"))
    assert frame.section is not None
    assert frame.material is not None
    assert frame.section == Section(0.2, 0.5, joint=0.06)
    assert frame.material.poisson == materials["pla"].poisson
    mean = float(problem.lattice.rest_length.mean())
    assert frame.material.young * frame.section.area / mean == pytest.approx(
        2.0 * problem.stiffness.bond
    )


@given(st.floats(0.1, 0.9), st.floats(0.1, 3.0), st.floats(2.0, 50.0))
def test_forces_of_a_problem_are_the_same_newtons_for_springs_and_frames(
    width: float, thickness: float, scale: float
) -> None:
    crane = find_problem("crane")
    spec = PartSpec(width=width * scale, thickness=thickness * scale, scale=scale)
    part = spec.of(crane.full_design())
    expected = part.material.young * part.section.area / scale / (2.0 * crane.stiffness.bond)
    assert part.stiffness_unit == pytest.approx(expected)
    frame = frame_problem(crane, spec)
    assert spec.of(frame.full_design()).stiffness_unit == pytest.approx(expected)
    assert frame.section is not None
    assert frame.section.scaled(scale).area == pytest.approx(part.section.area)


def test_forces_of_a_frame_problem_are_relative_to_its_own_material() -> None:
    spec = PartSpec()
    frame = frame_problem(find_problem("crane"), spec)
    assert frame.material is not None
    stiff = replace(frame, material=Elasticity(2.0 * frame.material.young, 0.48))
    unit = spec.of(frame.full_design()).stiffness_unit
    assert spec.of(stiff.full_design()).stiffness_unit == pytest.approx(unit / 2.0)


def test_springs_come_back_from_a_frame() -> None:
    for name in ("crane", "pliers"):
        problem = find_problem(name)
        assert spring_problem(frame_problem(problem, PartSpec())).hash == problem.hash
        assert spring_problem(problem).hash == problem.hash


def test_a_frame_is_made_anew_from_a_frame() -> None:
    crane = find_problem("crane")
    thin = frame_problem(crane, PartSpec(width=1.0))
    assert frame_problem(thin, PartSpec(width=2.0)).hash == (
        frame_problem(crane, PartSpec(width=2.0)).hash
    )


def test_struts_of_a_frame_in_space_are_round() -> None:
    tower = frame_problem(in_space(), PartSpec(width=2.0, thickness=5.0))
    assert tower.section == Section.round(0.2, joint=0.06)
    assert tower.material is not None
    assert tower.material.poisson == 0.48


def test_a_frame_uses_a_material_that_is_not_registered() -> None:
    rubber = Material(name="rubber", young=12.0, poisson=0.4)
    frame = frame_problem(find_problem("crane"), PartSpec(material=rubber))
    assert frame.material is not None
    assert frame.material.poisson == 0.4


@pytest.mark.parametrize(
    ("spec", "error", "message"),
    [
        (PartSpec(width=12.0), InvalidSettings, r"width: struts 12 mm wide are not slender"),
        (PartSpec(width=-1.0), InvalidProblem, r"section.width: expected a number greater than 0"),
        (PartSpec(width=float("nan")), InvalidProblem, r"section.width: expected a finite number"),
        (PartSpec(thickness=0.0), InvalidProblem, r"section.thickness: expected a number greater"),
        (PartSpec(material="jelly"), UnknownName, r"unknown material 'jelly'"),
    ],
)
def test_parts_that_cannot_be_frames_are_refused(
    spec: PartSpec, error: type[BellcrankError], message: str
) -> None:
    with pytest.raises(error, match=message):
        frame_problem(find_problem("crane"), spec)


def test_a_part_in_the_plane_has_no_round_struts() -> None:
    crane = find_problem("crane").full_design()
    with pytest.raises(InvalidSettings, match=r"^section: expected the shape 'rectangle'"):
        Part(crane, materials["ninjaflex"], Section.round(2.0))


def test_work_in_the_plane_names_the_problem_in_space_that_it_refuses() -> None:
    design = in_space().full_design()
    message = "problem 'tower' is in space; only problems in the plane are accepted here"
    for work in (
        lambda: spring_problem(design.problem),
        lambda: PartSpec().of(design).outline(),
        lambda: validate(design, PartSpec(), [("plane", FemSettings())]),
        lambda: Grips(plate=True).applied(PartSpec().of(design)),
    ):
        with pytest.raises(BellcrankError, match=message):
            work()


def test_a_refined_design_keeps_the_unit_of_its_loads() -> None:
    """Its nodes have moved, so that its beams are not one lattice unit long on average."""
    design = library().find("up-7-straight-10g").design
    spec = spec_for(design)
    problem = straight_motion(design.problem, 0.1, spec)
    again = frame_problem(problem, spec)
    assert float(problem.lattice.rest_length.mean()) != pytest.approx(1.0, abs=0.01)
    assert again.material == problem.material
    assert problem.specification is not None
    payload = next(item for item in problem.specification.items if item.quantity == "payload")
    assert payload.at_least is not None
    assert payload.at_least * units_of(again, spec).force == pytest.approx(0.1)
    # Half the width has half the area: the same stiffness of a beam has twice the modulus.
    narrow = frame_problem(problem, replace(spec, width=1.0, joint=0.3))
    assert problem.material is not None
    assert narrow.material is not None
    assert narrow.material.young == pytest.approx(2.0 * problem.material.young)
