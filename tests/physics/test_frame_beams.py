"""Beams of frames: derivatives, invariance, agreement of plane and space, a published bend."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation

from bellcrank.fem.frame.equations import PartFrame, part_frame
from bellcrank.mechanics.frames.kernels.beams import plane_beams, space_beams
from bellcrank.workflows import find_design, spec_for

Array = np.ndarray


def oriented(positions: Array, ends: Array, normal: Array) -> Array:
    """Return (m, 4, 3) vectors and triads of beams, t2 normal to a given vector."""
    chord = positions[ends[:, 1]] - positions[ends[:, 0]]
    axis = chord / np.linalg.norm(chord, axis=1)[:, None]
    side = np.cross(np.broadcast_to(normal, chord.shape), axis)
    side /= np.linalg.norm(side, axis=1)[:, None]
    return np.stack([chord, axis, side, np.cross(axis, side)], axis=1)


def stiffness(
    rest: Array, axial: float, torsion: float, bending: tuple[float, float], shear: float = np.inf
) -> Array:
    """Return (m, 8) the stiffness of beams from EA, GJ, both EI and the shear stiffness GA."""
    length = np.linalg.norm(rest[:, 0], axis=1)
    columns = [axial / length, torsion / length]
    for value in bending:
        ratio = 12.0 * value / (shear * length**2)
        flexural = value / (length * (1.0 + ratio))
        own = flexural * (4.0 + ratio)
        columns += [own, flexural * (2.0 - ratio), own]
    return np.stack(columns, axis=1)


def response(
    ends: Array, rest: Array, section: Array, u: Array, rotation: Array, bow: Array | None = None
) -> tuple[Array, Array]:
    force, tangent = np.zeros((len(ends), 12)), np.zeros((len(ends), 12, 12))
    bow = np.zeros((len(ends), 3)) if bow is None else bow
    space_beams(ends, rest, section, bow, u, rotation, np.zeros((9, 9, 9)), force, tangent)
    return force, tangent


def energy(rest: Array, section: Array, bow: Array, u: Array, rotation: Array) -> float:
    """Return the energy of one beam, by the formulas of the documentation."""
    chord = rest[0] + u[1] - u[0]
    first, second = ((r @ rest[1:].T).T for r in rotation)
    twist = np.arctan2(
        first[2] @ second[1] - first[1] @ second[2], first[1] @ second[1] + first[2] @ second[2]
    )
    bends = []
    for axes in (first, second):
        x, y, z = axes @ chord
        q = np.hypot(y, z)
        angle = np.arctan2(q, x)
        bends.append((-y * angle / q, z * angle / q))
    (a3, a2), (b3, b2) = bends
    longer = np.linalg.norm(chord) - np.linalg.norm(rest[0])
    for a, b in ((a3, b3), (a2, b2)):
        longer += bow[0] * a**2 + bow[1] * a * b + bow[2] * b**2
    stored = section[0] * longer**2 + section[1] * twist**2
    stored += section[2] * a3**2 + 2.0 * section[3] * a3 * b3 + section[4] * b3**2
    stored += section[5] * a2**2 + 2.0 * section[6] * a2 * b2 + section[7] * b2**2
    return 0.5 * float(stored)


@pytest.mark.parametrize("size", [0.02, 0.3, 0.9])
def test_forces_and_stiffness_are_derivatives_of_the_energy(size: float) -> None:
    rng = np.random.default_rng(1)
    ends = np.array([[0, 1]])
    rest = oriented(np.array([[0.0, 0.0, 0.0], [1.3, 0.4, -0.2]]), ends, np.array([0.1, 0.2, 1.0]))
    section = stiffness(rest, 50.0, 3.0, (2.0, 5.0))
    section[:, [4, 7]] *= 1.3  # the second end has a longer part that does not deform
    bow = np.array([[0.3, -0.1, 0.2]])
    u = 0.3 * size * rng.normal(size=(2, 3))
    rotation = Rotation.from_rotvec(size * rng.normal(size=(2, 3))).as_matrix()
    force, tangent = response(ends, rest, section, u, rotation, bow)
    assert np.allclose(tangent[0], tangent[0].T, atol=1e-12)
    for _ in range(4):
        way = rng.normal(size=(2, 6))

        def along(step: float, way: Array = way) -> float:
            turned = Rotation.from_rotvec(step * way[:, 3:]).as_matrix() @ rotation
            return energy(rest[0], section[0], bow[0], u + step * way[:, :3], turned)

        h = 1e-3
        e = [along(k * h) for k in (-3, -2, -1, 0, 1, 2, 3)]
        slope = np.dot(e, [-1, 9, -45, 0, 45, -9, 1]) / (60 * h)
        curvature = np.dot(e, [2, -27, 270, -490, 270, -27, 2]) / (180 * h**2)
        assert slope == pytest.approx(float(force[0] @ way.ravel()), rel=1e-8, abs=1e-9)
        expected = float(way.ravel() @ tangent[0] @ way.ravel())
        assert curvature == pytest.approx(expected, rel=1e-6)


def crisfield(frame: PartFrame, u: Array) -> tuple[Array, Array]:
    """Forces (e, 6) and stiffness (e, 6, 6) of plane beams by Crisfield's matrices.

    M. A. Crisfield, Non-linear finite element analysis of solids and structures, vol. 1, 1991,
    chapter 7.
    """
    force, tangent = np.zeros((len(frame.rest), 6)), np.zeros((len(frame.rest), 6, 6))
    for beam, (ends, rest) in enumerate(zip(frame.elements, frame.rest, strict=True)):
        axial, one, other, two = frame.stiffness[beam]
        matrix = np.array([[axial, 0.0, 0.0], [0.0, one, other], [0.0, other, two]])
        chord = rest + u[ends[1], :2] - u[ends[0], :2]
        before, length = np.hypot(*rest), np.hypot(*chord)
        c, s = chord / length
        turn = np.angle(complex(*chord) / complex(*rest))
        r, z = np.array([-c, -s, 0.0, c, s, 0.0]), np.array([s, -c, 0.0, -s, c, 0.0])
        gradient = np.array([r, -z / length, -z / length])
        gradient[1, 2] += 1.0
        gradient[2, 5] += 1.0
        rotations = np.angle(np.exp(1j * (u[ends, 2] - turn)))
        normal, first, second = stress = matrix @ [length - before, *rotations]
        force[beam] = gradient.T @ stress
        mixed = np.outer(r, z) + np.outer(z, r)
        tangent[beam] = gradient.T @ matrix @ gradient + normal / length * np.outer(z, z)
        tangent[beam] += (first + second) / length**2 * mixed
    return force, tangent


def crane_states() -> tuple[PartFrame, Array]:
    """Return the frame of a crane and random displacements."""
    design = find_design("machine:crane")
    frame = part_frame(spec_for(design).of(design), 2)
    rng = np.random.default_rng(0)
    count = len(frame.positions)
    shift = rng.normal(size=(count, 2))
    return frame, np.column_stack([2.0 * shift, 0.5 * rng.normal(size=count)])


def test_plane_beams_equal_the_matrices_of_crisfield() -> None:
    frame, u = crane_states()
    expected_force, expected = crisfield(frame, u)
    force, tangent = np.zeros_like(expected_force), np.zeros_like(expected)
    bow = np.zeros((len(frame.rest), 3))
    plane_beams(frame.elements, frame.rest, frame.stiffness, bow, u, force, tangent)
    assert np.allclose(force, expected_force, rtol=1e-12, atol=1e-12 * abs(force).max())
    assert np.allclose(tangent, expected, rtol=1e-12, atol=1e-12 * abs(tangent).max())


def test_beams_in_space_equal_those_in_the_plane_whatever_the_orientation() -> None:
    frame, u = crane_states()
    expected_force, expected = crisfield(frame, u)
    positions = np.column_stack([frame.positions, np.zeros(len(u))])
    rest = oriented(positions, frame.elements, np.array([0.0, 0.0, 1.0]))
    both = frame.stiffness[:, [0, 0, 1, 2, 3, 1, 2, 3]]
    shift = np.column_stack([u[:, :2], np.zeros(len(u))])
    turns = np.column_stack([np.zeros((len(u), 2)), u[:, 2]])
    rotation = Rotation.from_rotvec(turns).as_matrix()
    force, tangent = response(frame.elements, rest, both, shift, rotation)
    plane = [0, 1, 5, 6, 7, 11]
    assert np.allclose(force[:, plane], expected_force, atol=1e-12 * abs(force).max())
    assert np.allclose(tangent[:, plane][:, :, plane], expected, atol=1e-12 * abs(tangent).max())
    turn = Rotation.from_rotvec([0.3, -1.2, 2.0]).as_matrix()
    moved = (positions + shift) @ turn.T - positions
    turned, _ = response(frame.elements, rest, both, moved, turn @ rotation)
    back = turned.reshape(-1, 4, 3) @ turn
    assert np.allclose(back.reshape(-1, 12), force, atol=1e-12 * abs(force).max())


def bend(count: int) -> Array:
    """Return the tip displacement of the 45-degree bend (Bathe and Bolourchi, 1979)."""
    angle = np.linspace(0.0, np.pi / 4, count + 1)
    positions = 100.0 * np.stack([np.sin(angle), 1.0 - np.cos(angle), 0.0 * angle], axis=1)
    ends = np.array(list(pairwise(range(count + 1))))
    rest = oriented(positions, ends, np.array([0.0, 0.0, 1.0]))
    section = stiffness(rest, 1e7, 5e6 / 6, (1e7 / 12, 1e7 / 12), shear=5e6)
    u, rotation = np.zeros((count + 1, 3)), np.repeat(np.eye(3)[None], count + 1, axis=0)
    places = (6 * ends[:, :, None] + np.arange(6)).reshape(count, 12)
    rows, columns = np.repeat(places, 12, axis=1).ravel(), np.tile(places, (1, 12)).ravel()
    for load in np.linspace(100.0, 600.0, 6):
        for _ in range(30):
            force, tangent = response(ends, rest, section, u, rotation)
            residual = np.bincount(places.ravel(), force.ravel())
            residual[6 * count + 2] -= load
            if abs(residual[6:]).max() < 1e-6:
                break
            matrix = coo_matrix((tangent.ravel(), (rows, columns))).tocsc()[6:, 6:]
            step = spsolve(matrix, -residual[6:]).reshape(count, 6)
            u[1:] += step[:, :3]
            rotation[1:] = Rotation.from_rotvec(step[:, 3:]).as_matrix() @ rotation[1:]
        else:
            pytest.fail(f"no convergence at {load:g}")
    return np.abs(u[-1])


def test_the_bend_of_45_degrees_converges_at_second_order_to_the_published_tip() -> None:
    exact = np.array([23.56024, 13.60452, 53.47486])
    coarse, fine = bend(16) - exact, bend(32) - exact
    assert (abs(fine) < 5e-4 * exact).all()
    assert np.linalg.norm(coarse) == pytest.approx(4.0 * np.linalg.norm(fine), rel=0.1)
