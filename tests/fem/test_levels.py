"""What analyses say: stroke, contacts, snaps, stresses; the same at every level."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.fem import FemSettings, PathStatus, levels
from bellcrank.fem.contact import find_contacts
from bellcrank.model import Input, Lattice, Output, Problem, Supports, find_problem, human_design
from bellcrank.part import Material, Part, PartSpec, Section

RUBBER = Material(name="rubber", young=12.0, poisson=0.48, strain_limit=0.01)


def bar(stroke: float, direction: tuple[float, float]) -> Part:
    """A cantilever 20 mm long and 2 mm wide of two struts, moved at its tip."""
    problem = Problem(
        name="bar",
        lattice=Lattice([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], [[0, 1], [1, 2]]),
        supports=Supports(fixed=[0]),
        input=Input(nodes=[2], direction=direction, drive="displacement", amount=stroke / 10.0),
        output=Output(nodes=[1], direction=[1.0, 0.0]),
        designable=[0],
    )
    return Part(problem.full_design(), RUBBER, Section(2.0, 5.0))


@pytest.mark.parametrize("linear", [True, False])
def test_a_stretched_bar_has_the_stress_and_force_of_hooke_s_law(linear: bool) -> None:
    analysis = levels["frame"](bar(0.5, (1.0, 0.0)), FemSettings(linear=linear))
    last = analysis.last
    assert last.strain == pytest.approx(0.025)
    assert last.stress == pytest.approx(12.0 * 0.025)
    assert last.force == pytest.approx((12.0 * 10.0 * 0.025, 0.0), abs=1e-9)
    assert last.energy == pytest.approx(0.5 * last.force[0] * 0.5)
    assert last.output == pytest.approx((0.25, 0.0))
    assert analysis.efficiency == pytest.approx(0.5)
    assert re.search(r"strain.*rubber, 1%", " ".join(analysis.warnings))


@pytest.mark.parametrize("level", ["plane", "solid"])
def test_a_stretched_bar_has_nearly_the_same_figures_as_a_continuum(level: str) -> None:
    pytest.importorskip("ngsolve", reason="NGSolve is not installed")
    frame = levels["frame"](bar(0.5, (1.0, 0.0)), FemSettings(linear=True)).last
    last = levels[level](bar(0.5, (1.0, 0.0)), FemSettings(linear=True, size=2.0)).last
    assert last.force[0] == pytest.approx(frame.force[0], rel=0.05)
    assert last.output[0] == pytest.approx(frame.output[0], rel=0.05)
    assert last.energy == pytest.approx(0.5 * last.force[0] * 0.5, rel=1e-6)


@pytest.mark.parametrize(
    ("level", "tolerance"), [("frame", 1e-9), ("plane", 0.03), ("solid", 0.03)]
)
def test_a_node_of_a_bent_bar_turns_and_leaves_its_direction(level: str, tolerance: float) -> None:
    if level != "frame":
        pytest.importorskip("ngsolve", reason="NGSolve is not installed")
    part = bar(0.1, (0.6, 0.8))
    last = levels[level](part, FemSettings(linear=True, size=1.0)).last
    # Half way up a cantilever with a tip motion d, the deflection is 5 d / 16, the slope 9 d / 8 L;
    # half of the motion along the bar arrives there.
    assert last.off_axis == pytest.approx(0.08 * 5.0 / 16.0 / (0.06 / 2.0), rel=2.0 * tolerance)
    slope = math.degrees(9.0 * 0.08 / (8.0 * 20.0))
    assert last.rotation == pytest.approx(slope, rel=2.0 * tolerance)
    data = last.to_dict()
    assert data["off_axis"] == last.off_axis
    assert data["output_rotation_deg"] == last.rotation


def test_a_bent_bar_is_stressed_most_where_it_is_clamped() -> None:
    part = bar(0.1, (0.0, 1.0))
    last = levels["frame"](part, FemSettings(linear=True)).last
    # M = 3 E I d / L^2, stress M w / (2 I)
    assert last.stress == pytest.approx(3.0 * 12.0 * 0.1 / 20.0**2 * 1.0, rel=1e-9)
    assert last.strain == pytest.approx(last.stress / 12.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["crane", "anti-parallel"])
def test_short_strokes_are_small_motions_whatever_the_mesh(name: str) -> None:
    design = human_design(name)
    assert design is not None
    part = PartSpec().of(design)
    small = levels["frame"](part, FemSettings(linear=True)).efficiency
    for stroke in (1e-7, 1e-3):
        given = replace(design.problem.input, amount=stroke)
        short = replace(design, problem=replace(design.problem, input=given))
        for elements in (2, 16):
            analysis = levels["frame"](PartSpec().of(short), FemSettings(elements=elements))
            assert analysis.efficiency == pytest.approx(small, rel=max(1e-5, 5.0 * stroke))


@pytest.mark.parametrize("scale", [1e-5, 1e5])
def test_the_same_shape_moves_the_same_way_at_any_scale(scale: float) -> None:
    design = human_design("crane")
    assert design is not None
    analysis = levels["frame"](PartSpec(scale=scale, width=scale / 5.0).of(design), FemSettings())
    assert analysis.efficiency == pytest.approx(1.1760426999, rel=1e-8)


@pytest.mark.slow
def test_very_fine_meshes_converge_too() -> None:
    design = human_design("crane")
    assert design is not None
    analysis = levels["frame"](PartSpec().of(design), FemSettings(elements=96))
    assert analysis.efficiency == pytest.approx(1.1711, rel=1e-3)


def test_energy_is_the_work_done_along_the_stroke() -> None:
    design = human_design("crane")
    assert design is not None
    points = levels["frame"](PartSpec().of(design), FemSettings()).points
    load = np.array([0.0, *(point.load for point in points)])
    force = np.array([0.0, *(-point.force[1] for point in points)])
    work = np.trapezoid(force, load * design.problem.input.amount * 10.0)
    assert points[-1].energy == pytest.approx(work, rel=5e-3)
    assert points[-1].load == 1.0


def test_efficiencies_do_not_depend_on_modulus_thickness_or_units() -> None:
    design = human_design("anti-parallel")
    assert design is not None
    spec = PartSpec()
    one = levels["frame"](spec.of(design), FemSettings(elements=2)).last
    other = replace(spec, thickness=3.0, material=replace(RUBBER, young=2000.0))
    two = levels["frame"](other.of(design), FemSettings(elements=2)).last
    larger = replace(spec, width=6.0, scale=30.0)
    three = levels["frame"](larger.of(design), FemSettings(elements=2)).last
    assert two.efficiency == pytest.approx(one.efficiency, rel=1e-7)
    assert three.efficiency == pytest.approx(one.efficiency, rel=1e-7)
    assert three.strain == pytest.approx(one.strain, rel=1e-6)
    assert two.stress == pytest.approx(one.stress * 2000.0 / 12.0, rel=1e-6)


def arch(stroke: float) -> Part:
    """A shallow arch whose middle is pushed through by a force."""
    places = [[0.0, 0.0], [1.5, 0.225], [3.0, 0.45], [4.5, 0.225], [6.0, 0.0]]
    lattice = Lattice(places, [[0, 1], [1, 2], [2, 3], [3, 4]])
    problem = Problem(
        name="arch",
        lattice=lattice,
        supports=Supports(fixed=[0, 4]),
        input=Input(nodes=[2], direction=[0.0, -1.0], drive="force", amount=1.0),
        output=Output(nodes=[1], direction=[0.0, -1.0]),
        designable=[0],
    )
    part = Part(problem.full_design(), RUBBER, Section(1.0, 5.0))
    amount = stroke / (part.stiffness_unit * part.scale)
    driven = replace(problem, input=replace(problem.input, amount=amount))
    return replace(part, design=driven.full_design())


def test_an_arch_that_snaps_has_no_efficiency() -> None:
    analysis = levels["frame"](arch(0.05), FemSettings())
    assert analysis.status is PathStatus.SNAPPED
    assert math.isnan(analysis.efficiency)
    assert 0.0 < analysis.last.load < 0.9
    assert analysis.last.output[1] > -2.25  # above the line of the supports
    data = analysis.to_dict()
    assert data["efficiency"] is None
    assert data["input_force_N"] is None
    assert data["reached"] == analysis.last.load
    assert "stability is lost" in data["warnings"][0]


def test_an_arch_pushed_less_does_not_snap() -> None:
    analysis = levels["frame"](arch(0.02), FemSettings())
    assert analysis.status is PathStatus.CONVERGED
    assert analysis.loss is None


def test_a_mechanism_is_never_a_result() -> None:
    crane = find_problem("crane")
    loose = crane.lattice.beams_touching(crane.output.nodes)
    part = PartSpec().of(crane.full_design().with_mask(loose))
    with pytest.raises(InvalidSettings, match=r"not held against moving as a rigid body"):
        levels["frame"](part, FemSettings(linear=True))
    analysis = levels["frame"](part, FemSettings())
    assert analysis.status is PathStatus.MECHANISM
    assert math.isnan(analysis.efficiency)


LINES = np.array([[[0.0, 0.0], [5.0, 0.0], [10.0, 0.0]], [[0.0, 4.0], [5.0, 4.0], [10.0, 4.0]]])


def test_struts_that_come_near_touch() -> None:
    moved = LINES.copy()
    moved[1, 1] = [5.0, 1.5]
    contacts = find_contacts(np.array([3, 8]), LINES, [(1.0, moved)], 2.0)
    assert contacts.pairs.tolist() == [[3, 8]]
    assert contacts.overlap == pytest.approx([0.5])
    assert "beams 3 and 8" in contacts.message
    assert "0.5 mm" in contacts.message


def test_without_struts_there_is_no_contact() -> None:
    found = find_contacts(np.array([], dtype=int), LINES[:0], [(1.0, LINES[:0])], 2.0)
    assert len(found.pairs) == 0


def test_contacts_have_the_largest_overlap_and_the_first_load_of_the_stroke() -> None:
    states = []
    for load, height in ((0.2, 3.0), (0.4, 1.8), (0.6, 1.2), (0.8, 3.0)):
        moved = LINES.copy()
        moved[1, 1] = [5.0, height]
        states.append((load, moved))
    contacts = find_contacts(np.array([3, 8]), LINES, states, 2.0)
    assert contacts.pairs.tolist() == [[3, 8]]
    assert contacts.overlap == pytest.approx([0.8])
    assert contacts.onset.tolist() == [0.4]
    assert contacts.first == 0.4


def test_struts_that_cross_touch_all_the_more() -> None:
    moved = LINES.copy()
    moved[1] = [[3.0, 6.0], [3.1, 0.4], [3.2, -6.0]]
    contacts = find_contacts(np.array([3, 8]), LINES, [(1.0, moved)], 2.0)
    assert contacts.overlap == pytest.approx([2.0])


def test_struts_of_one_joint_do_not_touch_at_it_but_where_they_close() -> None:
    angle = np.radians(60.0)
    along = np.linspace(0.0, 10.0, 9)
    rest = np.array([np.outer(along, [1.0, 0.0]), np.outer(along, [np.cos(angle), np.sin(angle)])])
    assert len(find_contacts(np.array([0, 1]), rest, [(1.0, rest)], 2.0).pairs) == 0
    closed = rest.copy()
    closed[1] = np.outer(along, [np.cos(0.1), np.sin(0.1)])
    assert find_contacts(np.array([0, 1]), rest, [(1.0, closed)], 2.0).overlap[0] > 0.5


def test_struts_in_space_touch_where_they_pass_nearer_than_a_diameter() -> None:
    along = np.linspace(-5.0, 5.0, 3)
    rest = np.zeros((2, 3, 3))
    rest[0, :, 0], rest[1, :, 1], rest[1, :, 2] = along + 0.7, along - 0.3, 4.0
    stroke = [(load, rest - [[[0.0] * 3], [[0.0, 0.0, 4.0 * load]]]) for load in (0.25, 0.6, 0.75)]
    contacts = find_contacts(np.array([3, 8]), rest, stroke, 2.0)
    # Neither end of any segment is near the other strut.
    assert contacts.pairs.tolist() == [[3, 8]]
    assert contacts.overlap == pytest.approx([1.0])
    assert contacts.onset.tolist() == [0.6]


def test_contact_is_the_same_in_a_plane_of_space_whatever_its_orientation() -> None:
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]

    def in_space(lines: np.ndarray) -> np.ndarray:
        return np.pad(lines, ((0, 0), (0, 0), (0, 1))) @ turn.T

    rng = np.random.default_rng(4)
    starts = rng.uniform(0.0, 30.0, (12, 1, 2))
    part = np.linspace(0.0, 1.0, 5)[:, None]
    rest = starts + part * rng.uniform(-12.0, 12.0, (12, 1, 2))
    stroke = [(1.0, rest + 4.0 * rng.normal(size=rest.shape))]
    expected = find_contacts(np.arange(12), rest, stroke, 2.0)
    found = find_contacts(np.arange(12), in_space(rest), [(1.0, in_space(stroke[0][1]))], 2.0)
    assert len(expected.pairs) > 3
    assert found.pairs.tolist() == expected.pairs.tolist()
    assert found.overlap == pytest.approx(expected.overlap, abs=1e-9)


@pytest.mark.parametrize(
    ("wrong", "word"), [({"elements": 0}, "elements"), ({"size": -1.0}, "size")]
)
def test_settings_that_make_no_sense_are_refused(wrong: dict[str, float], word: str) -> None:
    with pytest.raises(InvalidSettings, match=f"^{word}: expected"):
        FemSettings(**wrong)  # type: ignore[arg-type]
