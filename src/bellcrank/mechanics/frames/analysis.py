"""Deformation, energy, strain and forces of a frame in equilibrium."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bellcrank.mechanics.analysis import Strain
from bellcrank.model.stroke_ranges import share_at

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bellcrank.mechanics.frames.equilibria import Equilibrium
    from bellcrank.mechanics.frames.kernels.arrays import Frame, Memory, State, Structure
    from bellcrank.mechanics.kernels.arrays import Floats, Ints
    from bellcrank.model import Problem


FIBRES = 16
"""Number of fibres around a round section."""


class ComputedFrame(Protocol):
    """A `bellcrank.mechanics.FrameEvaluator` with the response that it computed last."""

    problem: Problem
    divisions: int
    frame: Frame
    structure: Structure
    memory: Memory
    state: State

    @property
    def beams(self) -> Ints:
        """Beams of the lattice that the frame has."""

    @property
    def end(self) -> Equilibrium:
        """The last state of the path."""


def deformations(frame: Frame, beams: Ints, start: State, end: State) -> Floats:
    """Return the deformations of beams, in which their energy is quadratic.

    Parameters
    ----------
    beams : (m,)
        Indices of beams of the frame.
    start, end
        States of their first and second ends.

    Returns
    -------
    (m, 3) or (m, 6)
        In the plane elongation and both end rotations relative to the chord; in space
        elongation, twist, and the rotations of each end about two axes normal to the beam. The
        elongation includes the shortening by bending where the frame does.
    """
    shift = end.u - start.u
    rest = frame.rest[beams, 0]
    if len(frame.unit) == 3:
        shift[:, 2] = 0.0
    chord = rest + shift
    length = np.linalg.norm(chord, axis=1)
    # From the difference of squares: that of the lengths loses digits.
    elongation = ((rest + chord) * shift).sum(axis=1) / (length + frame.rest_length[beams])
    bow = frame.bow[beams]
    if len(frame.unit) == 3:
        turn = np.arctan2(
            rest[:, 0] * chord[:, 1] - rest[:, 1] * chord[:, 0], (rest * chord).sum(axis=1)
        )
        ends = [each.u[:, 2] - turn for each in (start, end)]
        one, two = ((angle + np.pi) % (2.0 * np.pi) - np.pi for angle in ends)
        return np.stack([elongation + _bowing(bow, one, two), one, two], axis=1)
    axes = [_turned(each.q, frame.rest[beams, 1:]) for each in (start, end)]
    (_, a1, a2), (_, b1, b2) = (np.moveaxis(each, 1, 0) for each in axes)
    twist = np.arctan2(
        (a2 * b1).sum(axis=1) - (a1 * b2).sum(axis=1), (a1 * b1).sum(axis=1) + (a2 * b2).sum(axis=1)
    )
    a, b, c, d = (each for one in axes for each in _end_rotations(one, chord))
    elongation = elongation + _bowing(bow, a, c) + _bowing(bow, b, d)
    return np.stack([elongation, twist, a, b, c, d], axis=1)


def _bowing(bow: Floats, one: Floats, two: Floats) -> Floats:
    """Return (m,) the elongation by end rotations, if the frame includes it."""
    elongation: Floats = bow[:, 0] * one * one + bow[:, 1] * one * two + bow[:, 2] * two * two
    return elongation


def _turned(rotation: Floats, triads: Floats) -> Floats:
    """Return triads (m, 3, 3), one vector a row, turned by unit quaternions, scalar first."""
    scalar, vector = rotation[:, None, :1], rotation[:, None, 1:]
    across = np.cross(vector, triads)
    turned: Floats = triads + 2.0 * (scalar * across + np.cross(vector, across))
    return turned


def _end_rotations(axes: Floats, chord: Floats) -> tuple[Floats, Floats]:
    """Return the rotations of an end relative to the chord, about its third and second axis."""
    x, y, z = np.einsum("mij,mj->im", axes, chord)
    q = np.hypot(y, z)
    angle = np.divide(np.arctan2(q, x), q, out=1.0 / np.abs(x), where=q > 0.0)
    return -y * angle, z * angle


def stress_resultants(frame: Frame, beams: Ints, deformation: Floats) -> Floats:
    """Return forces and moments conjugate to the deformations, of the same shape."""
    section = frame.section[beams]
    result = section[:, :1] * deformation
    if len(frame.unit) == 3:
        pairs = [(1, 2, 1)]
    else:
        result[:, 1] = section[:, 1] * deformation[:, 1]
        pairs = [(2, 4, 2), (3, 5, 5)]
    for one, other, column in pairs:
        first, carried, second = section[:, column : column + 3].T
        a, b = deformation[:, one], deformation[:, other]
        result[:, one], result[:, other] = first * a + carried * b, carried * a + second * b
    return result


def fibre_strain(frame: Frame, problem: Problem, beams: Ints, resultants: Floats) -> Floats:
    """Return (m,) the largest principal strain in beams.

    Axial strain and bending strain of the outermost fibre, in space with the shear strain of
    torsion of a round section. Compression in one direction is extension across it. Ends that do
    not bend have the strain of the axial force only, which is smaller.

    Parameters
    ----------
    beams : (m,)
        Indices of beams of the frame.
    resultants : (m, 3) or (m, 6)
        Their forces and moments; see `stress_resultants`.
    """
    assert problem.material is not None
    nu = problem.material.poisson
    axial, bending, shear = _fibre_strains(frame, problem, beams, resultants)
    strains = [
        0.5 * (1.0 - nu) * normal + np.hypot(0.5 * (1.0 + nu) * normal, 0.5 * shear)
        for normal in (axial + bending, axial - bending)
    ]
    largest: Floats = np.maximum(*strains)
    return largest


def fibre_stress(frame: Frame, problem: Problem, beams: Ints, resultants: Floats) -> Floats:
    """Return (m,) the largest von Mises stress in beams, of the outermost fibre.

    Parameters are those of `fibre_strain`.
    """
    assert problem.material is not None
    axial, bending, shear = _fibre_strains(frame, problem, beams, resultants)
    nu = problem.material.poisson
    stress: Floats = problem.material.young * np.hypot(
        np.abs(axial) + bending, math.sqrt(3.0) * 0.5 / (1.0 + nu) * shear
    )
    return stress


def _fibre_strains(
    frame: Frame, problem: Problem, beams: Ints, resultants: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return (m,) the axial strain, the largest bending strain and the largest shear strain."""
    axial, one, other = _end_strains(frame, problem, beams, resultants)
    bending = np.hypot(one, other).max(axis=1, initial=0.0)
    shear = np.zeros(len(beams))
    if resultants.shape[1] == 6:
        bent = frame.rest_length[beams] - frame.rigid[beams].sum(axis=1)
        torsional = frame.section[beams, 1] * bent
        shear = np.abs(resultants[:, 1]) * 0.5 * frame.width[beams] / torsional
    return axial, bending, shear


def normal_strains(frame: Frame, problem: Problem, beams: Ints, resultants: Floats) -> Floats:
    """Return (m, 2, k) the normal strain of outer fibres at both ends of beams.

    In the plane the fibres are those of both sides, in space `FIBRES` around the section.
    Parameters are those of `fibre_strain`.
    """
    axial, one, other = _end_strains(frame, problem, beams, resultants)
    angles = 2.0 * np.pi * np.arange(FIBRES) / FIBRES
    if resultants.shape[1] == 3:
        angles = np.array([0.0, np.pi])
    bending = one[..., None] * np.cos(angles) + other[..., None] * np.sin(angles)
    strain: Floats = axial[:, None, None] + bending
    return strain


def _end_strains(
    frame: Frame, problem: Problem, beams: Ints, resultants: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return (m,) the axial strain, and (m, 2) the bending strains about two axes at both ends."""
    section = problem.section
    assert section is not None
    length, rigid = frame.rest_length[beams], frame.rigid[beams]
    # From the stiffness of each beam, which may be a part of that of its section.
    extensional = frame.section[beams, 0] * length
    gyration = section.inertia / section.area * (frame.width[beams] / section.width) ** 2
    by_moment = (0.5 * frame.width[beams] / (extensional * gyration))[:, None]
    # Moments vary linearly along a beam.
    share = rigid / length[:, None]
    if resultants.shape[1] == 3:
        one = without_ends(resultants[:, 1:], share)
        other = np.zeros_like(one)
    else:
        one, other = (without_ends(resultants[:, [k, k + 2]], share) for k in (2, 3))
    return resultants[:, 0] / extensional, one * by_moment, other * by_moment


def strain_amplitude(states: Iterable[Equilibrium]) -> float:
    """Return the largest amplitude of a normal strain in a cycle from rest through states and back.

    It is half the difference of the largest and the smallest strain of an outer fibre.

    Parameters
    ----------
    states
        Equilibria along the stroke.
    """
    low: Floats | float = 0.0
    high: Floats | float = 0.0
    for state in states:
        frame, beams = state.frame, np.flatnonzero(state.structure.present)
        strained = stress_resultants(frame, beams, deformations(frame, beams, *state.ends(beams)))
        strain = normal_strains(frame, state.problem, beams, strained)
        low, high = np.minimum(low, strain), np.maximum(high, strain)
    return 0.5 * float(np.max(high - low, initial=0.0))


def without_ends(moments: Floats, share: Floats) -> Floats:
    """Return (m, 2) the moments where beams begin to deform, from those at their nodes."""
    inner: Floats = moments - share * moments.sum(axis=1)[:, None]
    return inner


def strain_of_frame(evaluator: ComputedFrame, equilibrium: Equilibrium | None = None) -> Strain:
    """Return the energy of each beam and the input forces in the response computed last.

    At its end, or at one of its equilibria.
    """
    frame, end = evaluator.frame, equilibrium or evaluator.end
    beams = np.arange(len(frame.beams))
    d = deformations(frame, beams, *end.ends(beams))
    energy = 0.5 * (stress_resultants(frame, beams, d) * d).sum(axis=1)
    energy *= evaluator.structure.present != 0
    of_beam = np.zeros(evaluator.problem.lattice.beam_count)
    of_beam[evaluator.beams] = energy.reshape(-1, evaluator.divisions).sum(axis=1)
    forces = input_forces(end)
    along = float((forces * evaluator.problem.input.direction).sum())
    return Strain(of_beam, forces, along)


def input_forces(equilibrium: Equilibrium) -> Floats:
    """Return (i, d) the external force on each input node."""
    given = equilibrium.problem.input
    if given.drive == "force":
        share = share_at(given.ranges, equilibrium.fraction)
        return np.array(given.amount * share[:, None] * given.direction)
    reactions: Floats = equilibrium.residual()[given.nodes, : given.direction.shape[1]]
    return reactions


def orientation(state: State, node: int) -> Floats:
    """Return (d, d) the rotation matrix of a node."""
    if not len(state.q):
        c, s = math.cos(state.u[node, 2]), math.sin(state.u[node, 2])
        return np.array([[c, -s], [s, c]])
    turned: Floats = _turned(state.q[node][None], np.eye(3)[None])[0].T
    return turned


def centre_lines(evaluator: ComputedFrame, state: State) -> tuple[Floats, Floats]:
    """Return (s, k, d) the ends of the elements along each beam of the frame.

    Returns
    -------
    rest, displaced
        For the beams ``evaluator.beams`` in order, at rest and in a state.
    """
    count, dimension = evaluator.problem.lattice.positions.shape
    ends = evaluator.problem.lattice.beams[evaluator.beams]
    inner = count + np.arange(len(ends) * (evaluator.divisions - 1)).reshape(len(ends), -1)
    along = np.column_stack([ends[:, 0], inner, ends[:, 1]])
    rest = evaluator.frame.positions[:, :dimension]
    return rest[along], (rest + state.u[:, :dimension])[along]
