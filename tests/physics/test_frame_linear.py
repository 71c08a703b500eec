"""Frames under small loads against OpenSees' linear elements, an independent code."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bellcrank.mechanics import FrameEvaluator
from bellcrank.mechanics.frames.beams import beam_stiffness
from bellcrank.mechanics.frames.kernels.response import solve_fields
from bellcrank.mechanics.frames.system import allocate_state
from bellcrank.model import Problem, Section
from tests.physics.frames import MATERIAL, random_frame

SECTIONS = [Section.round(0.2), Section(0.15, 0.4)]


def opensees(problem: Problem, section: Section, load: np.ndarray, theory: str) -> np.ndarray:
    """Return (N, 6) the displacements and rotations of the nodes under forces and moments."""
    ops = pytest.importorskip("openseespy.opensees", reason="OpenSeesPy is not installed")
    lattice = problem.lattice
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    for node, place in enumerate(lattice.positions.tolist()):
        ops.node(node, *place)
    for nodes, fixity in (
        (problem.supports.fixed, (1, 1, 1, 1, 1, 1)),
        (problem.supports.fixed_x, (1, 0, 0, 0, 0, 0)),
        (problem.supports.fixed_z, (0, 0, 1, 0, 0, 0)),
    ):
        for node in nodes.tolist():
            ops.fix(node, *fixity)
    young, shear, area = MATERIAL.young, MATERIAL.shear_modulus, section.area
    torsion, about_y, about_z = (
        section.torsion_constant, section.inertia_out_of_plane, section.inertia
    )  # fmt: skip
    for beam, (first, last) in enumerate(lattice.beams.tolist()):
        along = lattice.positions[last] - lattice.positions[first]
        steep = abs(along[2]) >= 0.9 * np.linalg.norm(along)
        ops.geomTransf("Linear", beam, *((1.0, 0.0, 0.0) if steep else (0.0, 0.0, 1.0)))
        if theory == "timoshenko":
            sheared = section.shear_coefficient * area
            ops.element(
                "ElasticTimoshenkoBeam", beam, first, last, young, shear, area, torsion, about_y,
                about_z, sheared, sheared, beam,
            )  # fmt: skip
        else:
            ops.element(
                "elasticBeamColumn", beam, first, last, area, young, shear, torsion, about_y,
                about_z, beam,
            )  # fmt: skip
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    for node, forces in enumerate(load.tolist()):
        ops.load(node, *forces)
    ops.constraints("Plain")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.algorithm("Linear")
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static", "-noWarnings")
    assert ops.analyze(1) == 0
    moved = np.array([ops.nodeDisp(node) for node in range(lattice.node_count)])
    ops.wipe()
    return moved


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("section", SECTIONS, ids=["round", "rectangle"])
@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
def test_space_frames_move_as_in_opensees(theory: str, section: Section, seed: int) -> None:
    problem = random_frame(seed, fixed_x=[7], fixed_z=[9])
    mask = np.ones(problem.lattice.beam_count, dtype=bool)
    load = np.random.default_rng(seed).normal(size=(problem.lattice.node_count, 6))
    load[problem.supports.fixed] = 0.0
    expected = opensees(problem, section, load, theory)
    for elements in (1, 3):
        evaluator = FrameEvaluator(problem, elements=elements)
        evaluator.evaluate(mask)  # builds the frame
        length = evaluator.frame.rest_length
        stiffness = beam_stiffness(section, MATERIAL, length, theory, 3)
        evaluator.frame = replace(evaluator.frame, section=stiffness)
        assert evaluator.evaluate(mask).status.label == "converged"
        rest = allocate_state(len(evaluator.frame.positions), 6)
        fields = np.zeros((1, len(evaluator.frame.positions), 6))
        fields[0, : len(load)] = load
        assert solve_fields(
            evaluator.frame, evaluator.structure, 0.0, rest, fields, evaluator.memory
        )
        error = np.abs(fields[0, : len(load)] - expected)
        assert error.max() < 1e-9 * np.abs(expected).max()
