"""Parts with struts of different widths, as frames and as sheets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bellcrank.fem import FemSettings, levels
from bellcrank.fem.contact import find_contacts
from bellcrank.model import Input, Lattice, Output, Problem, Supports
from bellcrank.part import Material, Part, PartSpec, Section
from bellcrank.workflows import find_design

RUBBER = Material(name="rubber", young=12.0, poisson=0.0, strain_limit=0.5)


def bar(direction: tuple[float, float]) -> Part:
    """A cantilever of two struts 30 mm long, 2 mm and 1 mm wide, moved by 0.3 mm at its tip."""
    problem = Problem(
        name="bar",
        lattice=Lattice([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], [[0, 1], [1, 2]]),
        supports=Supports(fixed=[0]),
        input=Input(nodes=[2], direction=direction, drive="displacement", amount=0.01),
        output=Output(nodes=[1], direction=direction),
        designable=[0],
        section=Section(2.0 / 30.0, 5.0 / 30.0),
        widths=[2.0 / 30.0, 1.0 / 30.0],
    )
    return Part(problem.full_design(), RUBBER, Section(2.0, 5.0), scale=30.0)


def test_two_struts_in_line_share_a_stretch_as_their_widths_say() -> None:
    last = levels["frame"](bar((1.0, 0.0)), FemSettings()).last
    # Stiffness E A / L of 4 and 2 N/mm in series.
    assert last.force[0] == pytest.approx(0.3 * 4.0 * 2.0 / 6.0, rel=1e-9)
    assert last.output[0] == pytest.approx(0.1, rel=1e-9)
    assert last.strain == pytest.approx(0.2 / 30.0, rel=1e-9)


def test_a_sheet_of_two_struts_in_line_is_as_stiff_as_its_frame() -> None:
    pytest.importorskip("ngsolve")
    frame, sheet = (
        levels[name](bar((1.0, 0.0)), FemSettings()).last for name in ("frame", "plane")
    )
    # Hubs and the fillet at the step between both widths stiffen the sheet.
    assert sheet.force[0] == pytest.approx(frame.force[0], rel=0.06)
    assert sheet.output[0] == pytest.approx(frame.output[0], rel=0.1)


def test_two_struts_in_line_bend_as_their_widths_say() -> None:
    last = levels["frame"](bar((0.0, 1.0)), FemSettings(linear=True)).last
    # Cantilever of two parts: tip deflection F (L^3 (1 + 3 + 3) / 3 E I1 + L^3 / 3 E I2), with
    # I1 = 8 I2.
    inertia = 5.0 / 12.0
    flexibility = 30.0**3 / (3.0 * 12.0 * inertia) * (7.0 / 8.0 + 1.0)
    assert last.force[1] == pytest.approx(0.3 / flexibility, rel=1e-9)


def test_contacts_count_from_the_mean_of_both_widths() -> None:
    lines = np.array([[[0.0, 0.0], [5.0, 0.0], [10.0, 0.0]]] * 2)
    lines[1] += [0.0, 6.0]
    states = [(1.0, lines - [[[0.0, 0.0]], [[0.0, 3.5]]])]
    found = find_contacts(np.array([0, 1]), lines, states, [4.0, 2.0])
    assert found.overlap == pytest.approx([0.5])
    assert not len(find_contacts(np.array([0, 1]), lines, states, [2.0, 2.0]).overlap)


@pytest.mark.slow
def test_a_frame_of_different_widths_moves_as_its_sheet() -> None:
    pytest.importorskip("ngsolve")
    design = find_design("machine:crane")
    problem = design.problem
    assert problem.section is not None
    widths = problem.section.width * np.random.default_rng(1).uniform(0.6, 1.2, 352)
    changed = problem.with_geometry(problem.lattice.positions, widths)
    part = PartSpec.of_section(problem.section).of(replace(design, problem=changed))
    frame, sheet = (levels[name](part, FemSettings()) for name in ("frame", "plane"))
    assert frame.efficiency == pytest.approx(sheet.efficiency, rel=0.03)
    assert frame.last.energy == pytest.approx(sheet.last.energy, rel=0.12)
