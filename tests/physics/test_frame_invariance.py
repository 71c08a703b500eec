"""Responses of frames do not depend on the orientation of the model or on its numbering."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bellcrank.mechanics import FrameEvaluator, Response
from bellcrank.model import Elasticity, Lattice, Problem, Supports, find_problem
from bellcrank.part import PartSpec, frame_problem
from tests.physics.frames import Array, chain, equilibrium, frame_of, random_frame

TOLERANCE = 1e-9


def problem_in(dimension: int, drive: str) -> Problem:
    """Return the crane as a frame, or a random frame in space, with large motions."""
    if dimension == 2:
        problem = frame_problem(find_problem("crane"), PartSpec(width=2.0, thickness=5.0))
        amount = {"displacement": 0.4, "force": 0.01}[drive]
    else:
        problem = random_frame(4)
        amount = {"displacement": 0.3, "force": 2e-4}[drive]
    return replace(problem, input=replace(problem.input, drive=drive, amount=amount))


def masks_of(problem: Problem) -> list[Array]:
    """Return the full design and three with fewer beams."""
    rng = np.random.default_rng(3)
    masks = [np.ones(problem.lattice.beam_count, dtype=bool)]
    for share in (0.1, 0.2, 0.3):
        masks.append(problem.initial & (rng.random(problem.lattice.beam_count) > share))
        masks[-1][problem.lattice.beams_touching(problem.supports.nodes)] = True
    return masks


def responses(problem: Problem, masks: list[Array], elements: int) -> list[Response]:
    evaluator = FrameEvaluator(problem, elements=elements)
    return [evaluator.evaluate(mask) for mask in masks]


def compare(ours: list[Response], theirs: list[Response], turn: Array) -> None:
    converged = 0
    for one, other in zip(ours, theirs, strict=True):
        assert one.status is other.status
        if one.status.label == "converged":
            converged += 1
            assert one.efficiency == pytest.approx(other.efficiency, abs=TOLERANCE)
            assert one.energy == pytest.approx(other.energy, rel=TOLERANCE)
            moved = one.displacement @ turn.T
            assert np.abs(moved - other.displacement).max() < TOLERANCE
    assert converged >= 2
    assert max(np.abs(one.displacement).max() for one in ours) > 0.05


def rotated(problem: Problem, turn: Array) -> Problem:
    lattice = problem.lattice
    return replace(
        problem,
        lattice=Lattice(lattice.positions @ turn.T + 1.0, lattice.beams),
        input=replace(problem.input, direction=problem.input.direction @ turn.T),
        output=replace(problem.output, direction=problem.output.direction @ turn.T),
    )


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("drive", ["displacement", "force"])
@pytest.mark.parametrize(("dimension", "elements"), [(2, 1), (2, 3), (3, 1), (3, 3)])
def test_a_rotation_of_the_model_rotates_the_response(
    dimension: int, elements: int, drive: str, seed: int
) -> None:
    problem = problem_in(dimension, drive)
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    if dimension == 2:
        turn = Rotation.from_euler("z", 2.0 * seed).as_matrix()[:2, :2]
    masks = masks_of(problem)
    ours = responses(problem, masks, elements)
    compare(ours, responses(rotated(problem, turn), masks, elements), turn)


def relabelled(problem: Problem, nodes: Array, beams: Array, flipped: Array) -> Problem:
    """Return a problem whose node k is node nodes[k], and beam k is beam beams[k]."""
    number = np.argsort(nodes)
    ends = number[problem.lattice.beams[beams]]
    ends[flipped] = ends[flipped, ::-1]
    given, wanted = problem.input, problem.output
    return replace(
        problem,
        lattice=Lattice(problem.lattice.positions[nodes], ends),
        supports=Supports(fixed=number[problem.supports.fixed]),
        input=replace(given, nodes=number[given.nodes]),
        output=replace(wanted, nodes=number[wanted.nodes]),
        designable=np.argsort(beams)[problem.designable],
        initial=problem.initial[beams],
    )


@pytest.mark.parametrize("drive", ["displacement", "force"])
@pytest.mark.parametrize(("dimension", "elements"), [(2, 1), (2, 3), (3, 1), (3, 3)])
def test_responses_do_not_depend_on_the_numbers_of_nodes_and_beams(
    dimension: int, elements: int, drive: str
) -> None:
    problem = problem_in(dimension, drive)
    rng = np.random.default_rng(7)
    nodes = rng.permutation(problem.lattice.node_count)
    beams = rng.permutation(problem.lattice.beam_count)
    other = relabelled(problem, nodes, beams, rng.random(len(beams)) < 0.5)
    masks = masks_of(problem)
    ours = responses(problem, masks, elements)
    theirs = responses(other, [mask[beams] for mask in masks], elements)
    back = [replace(one, displacement=one.displacement[np.argsort(nodes)]) for one in theirs]
    compare(ours, back, np.eye(dimension))


@pytest.mark.parametrize("drive", ["displacement", "force"])
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(("length", "modulus"), [(0.1, 1.0), (25.0, 1.0), (1.0, 1e-6), (1.0, 1e6)])
def test_efficiencies_do_not_depend_on_the_units(
    dimension: int, drive: str, length: float, modulus: float
) -> None:
    problem = problem_in(dimension, drive)
    section, material = problem.section, problem.material
    assert section is not None
    assert material is not None
    factor = length if drive == "displacement" else modulus * length**2
    other = replace(
        problem,
        lattice=Lattice(length * problem.lattice.positions, problem.lattice.beams),
        section=section.scaled(length),
        material=Elasticity(modulus * material.young, material.poisson),
        input=replace(problem.input, amount=factor * problem.input.amount),
    )
    masks = masks_of(problem)
    for one, two in zip(responses(problem, masks, 1), responses(other, masks, 1), strict=True):
        assert one.status is two.status
        assert two.efficiency == pytest.approx(one.efficiency, abs=TOLERANCE, nan_ok=True)


@pytest.mark.parametrize("angle", [1.0, 2.5, 3.1, 6.0])
@pytest.mark.parametrize("dimension", [2, 3])
def test_a_prescribed_rotation_of_the_root_moves_a_frame_as_a_rigid_body(
    dimension: int, angle: float
) -> None:
    places = np.zeros((6, dimension))
    places[:, 0], places[:, 1] = [0.0, 1.0, 2.0, 2.0, 2.0, 3.0], [0.0, 0.0, 0.0, 1.0, 2.0, 2.0]
    places[4:, 2:] = 0.7
    frame = frame_of(chain(places))
    vector = angle * np.array([0.3, -0.5, 0.8]) / np.sqrt(0.98)
    if dimension == 2:
        vector = np.array([0.0, 0.0, angle])
    turn = Rotation.from_rotvec(vector).as_matrix()[:dimension, :dimension]
    drive, prescribed = frame.drive.copy(), frame.prescribed.copy()
    drive[0, :dimension], prescribed[0] = 0.4, 1
    drive[0, dimension:] = vector[-1] if dimension == 2 else vector
    none = np.zeros_like(frame.load)
    grounded = np.zeros_like(frame.grounded)
    moved = equilibrium(
        replace(frame, drive=drive, prescribed=prescribed, grounded=grounded, load=none)
    )
    assert moved.status == "converged"
    assert moved.energy == pytest.approx(0.0, abs=1e-20)
    assert places + moved.u[:, :dimension] == pytest.approx(places @ turn.T + 0.4, abs=TOLERANCE)
