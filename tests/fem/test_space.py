"""Solids of parts in space: their meshes, their responses beside frames, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bellcrank.errors import InvalidProblem, InvalidSettings
from bellcrank.export.struts import struts_solid
from bellcrank.fem import FemSettings, levels
from bellcrank.fem.continuum.space_mesh import RoundStruts, space_mesh, stuffed
from bellcrank.mechanics import VERIFICATION_INCREMENT, FrameEvaluator
from bellcrank.mechanics.frames.joints import with_joints
from bellcrank.model import (
    Design,
    Elasticity,
    Input,
    Item,
    Lattice,
    Output,
    Problem,
    Section,
    Specification,
    Supports,
    lattices,
)
from bellcrank.part import PartSpec
from bellcrank.workflows.validation import validate

ngsolve = pytest.importorskip("ngsolve")

POSITIONS = [[0, 0, 0], [1.6, 0, 0.5], [0.2, 1.5, 0], [2.2, 1.4, 1.2], [0, 0, 1.6]]
BEAMS = [[0, 1], [2, 1], [1, 3], [4, 3], [2, 3]]


def arm(**changes: object) -> Design:
    """Return a frame of five slender struts, four of them held at one end."""
    problem = Problem(
        name="arm", lattice=Lattice(POSITIONS, BEAMS), supports=Supports(fixed=[0, 2, 4]),
        section=Section.round(0.2, joint=0.06), material=Elasticity(12.0, 0.4), designable=[3],
        input=Input([1], [0, 0, -1], "displacement", 0.2), output=Output([3], [1, 0, 0]),
    )  # fmt: skip
    design = replace(problem, **changes).full_design()
    return replace(design, problem=with_joints(design.problem, design.mask))


@pytest.mark.parametrize("seed", range(3))
def test_a_mesh_fills_the_union_of_struts(seed: int) -> None:
    """Its volume is that of the exported surface; it is closed, and no element is flat."""
    lattice = lattices["octet"]([2, 2, 2])
    rng = np.random.default_rng(seed)
    mask = rng.random(lattice.beam_count) < 0.5
    height = lattice.positions[:, 2]
    held = np.flatnonzero(height == height.min())
    top = int(np.argmax(height))
    problem = Problem(
        name="octets", lattice=lattice, supports=Supports(fixed=held), section=Section.round(0.2),
        input=Input([top], [0, 0, -1], "displacement", 0.1), designable=[0],
        output=Output([int(np.flatnonzero(height == height.max())[1])], [1, 0, 0]),
    )  # fmt: skip
    part = PartSpec.of_section(problem.section).of(Design(problem, mask))
    mesh = space_mesh(part)
    volume = ngsolve.Integrate(ngsolve.CF(1.0), mesh.mesh)
    assert volume == pytest.approx(struts_solid(part, 0.002).volume, rel=0.01)
    corners = mesh.vertices[mesh.elements]
    sizes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
    assert np.abs(sizes).min() > 1e-4 * np.abs(sizes).max()
    built = np.unique(lattice.beams[mask])
    assert set(mesh.hubs.tolist()) == set(problem.special_nodes.tolist()) & set(built.tolist())
    for node in mesh.hubs.tolist():
        around = corners[mesh.hub_of_element == node].mean(axis=(0, 1))
        assert around == pytest.approx(part.positions[node], abs=0.3)


def test_elements_of_a_single_strut_share_their_faces() -> None:
    struts = RoundStruts(np.array([[[0.0, 0.0, 0.0], [6.0, 2.0, 1.0]]]), np.array([1.0]))
    vertices, elements = stuffed(struts, 0.9)
    faces = np.sort(elements[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]], axis=2)
    found, counts = np.unique(faces.reshape(-1, 3), axis=0, return_counts=True)
    assert set(counts.tolist()) == {1, 2}
    outer = found[counts == 1]
    sides = np.sort(outer[:, [[0, 1], [0, 2], [1, 2]]], axis=2).reshape(-1, 2)
    assert set(np.unique(sides, axis=0, return_counts=True)[1].tolist()) == {2}
    assert np.abs(struts.distance(vertices[np.unique(outer)])).max() < 1e-3


def test_a_solid_moves_as_a_frame_of_eight_elements() -> None:
    design = arm()
    frame = FrameEvaluator(design.problem, elements=8)
    expected = frame.evaluate(design.mask, VERIFICATION_INCREMENT)
    spec = PartSpec.of_section(design.problem.section)
    validation = validate(design, spec, [("solid", FemSettings())])
    (analysis,) = validation.analyses
    assert analysis.status.value == "converged"
    assert analysis.efficiency == pytest.approx(expected.efficiency, rel=0.04)
    moved = expected.displacement[3] * spec.scale
    assert np.array(analysis.last.output) == pytest.approx(moved, abs=0.04 * np.linalg.norm(moved))
    assert analysis.last.energy == pytest.approx(expected.energy * spec.scale**3, rel=0.04)
    turned = frame.output_motion()
    assert analysis.last.off_axis == pytest.approx(turned.off_axis, rel=0.04)
    # The hub at the end of the strut turns by a little less than its axis.
    assert analysis.last.rotation == pytest.approx(np.linalg.norm(turned.rotation), rel=0.05)
    beams = levels["frame"](spec.of(design), FemSettings(elements=8)).last
    # The material of the part has another Poisson's ratio.
    assert beams.off_axis == pytest.approx(turned.off_axis, rel=1e-3)
    assert beams.rotation == pytest.approx(np.linalg.norm(turned.rotation), rel=1e-2)
    assert len(analysis.last.force) == 3
    assert not len(analysis.contacts.pairs)
    assert validation.doubts == []


@pytest.mark.slow
def test_items_of_a_part_in_space_are_computed_in_the_solid() -> None:
    case = {"case": "case", "output": "output"}
    items = (
        Item(quantity="gain", at_least=0.1, **case),
        Item(quantity="off_axis", at_most=3.0, **case),
        Item(quantity="rotation", at_least=-90.0, at_most=90.0, **case),
        Item(quantity="stiffness", at_least=1e-6, **case),
        Item(quantity="payload", at_least=1e-5, **case),
        Item(quantity="blocked_force", at_least=1e-6, **case),
        Item(quantity="strain", case="case", at_most=1.0),
        Item(quantity="clearance", case="case", at_least=0.0),
    )
    design = arm(specification=Specification(items=items))
    spec = PartSpec.of_section(design.problem.section)
    validation = validate(design, spec, [("solid", FemSettings())])
    *_, frames, solid = validation.items.values()
    assert list(validation.items)[-1] == "solid"
    for one, other in zip(frames, solid, strict=True):
        if one.item.quantity == "clearance":
            assert np.isinf([one.value, other.value]).all()
        else:
            rough = 0.25 if one.item.quantity == "strain" else 0.12
            assert other.value == pytest.approx(one.value, rel=rough), one.item.quantity
    # The rotation of the output has an axis in both models.
    one, other = (
        validation.figures[model][0]["rotation_axis"] for model in list(validation.items)[-2:]
    )
    assert np.linalg.norm(one) == pytest.approx(1.0, abs=2e-3)
    assert np.dot(one, other) > 0.95


def test_a_frame_in_space_has_the_figures_of_the_solid() -> None:
    design = arm()
    part = PartSpec.of_section(design.problem.section).of(design)
    frame, solid = (levels[level](part, FemSettings()) for level in ("frame", "solid"))
    assert frame.status == solid.status == "converged"
    for figure in ("efficiency", "push", "energy"):
        expected = getattr(solid.last, figure)
        assert getattr(frame.last, figure) == pytest.approx(expected, rel=0.05), figure
    # The solid has the stress of the joints too.
    assert frame.last.stress == pytest.approx(solid.last.stress, rel=0.15)
    assert frame.last.strain == pytest.approx(solid.last.strain, rel=0.2)
    assert [point.load for point in frame.points] == [k / 16 for k in range(1, 17)]


def test_a_part_in_space_that_is_not_held_has_no_path() -> None:
    push = Input([1], [0, 0, -1], "force", 0.2)
    design = arm(supports=Supports(fixed=[4]), input=push)
    part = PartSpec.of_section(design.problem.section).of(design.with_mask(np.arange(5) != 3))
    found = levels["frame"](part, FemSettings())
    assert found.status == "mechanism"
    assert [point.load for point in found.points] == [0.0]
    assert np.isnan(found.efficiency)


def test_levels_that_are_for_the_plane_refuse_a_part_in_space() -> None:
    part = PartSpec.of_section(arm().problem.section).of(arm())
    with pytest.raises(InvalidProblem, match="is in space; only problems in the plane"):
        levels["plane"].check(part, FemSettings())
    with pytest.raises(InvalidSettings, match="level 'frame': parts in space are analysed with"):
        levels["frame"].check(part, FemSettings(linear=True))
    with pytest.raises(InvalidSettings, match="no element within the joint of node"):
        space_mesh(part, 4.0)
    with pytest.raises(InvalidSettings, match="size: expected a length above 0 mm"):
        space_mesh(part, 0.0)
