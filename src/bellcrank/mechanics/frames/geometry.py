"""Derivatives of quantities by the positions of nodes and by the widths of beams.

At an equilibrium r(u; p) = 0 the derivative of a measure Q(u, z; p) by the parameters p of the
geometry is

    dQ/dp = Q_p - l . r_p - y . (K_p z) ,

with the adjoints l of Q, y of the linear motion z on which it may depend, and the stiffness K. One
adjoint solution for each measure and one pass over the beams give the derivatives by all positions
and widths.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bellcrank.mechanics.frames.beams import beam_stiffness, bow_coefficients
from bellcrank.mechanics.frames.joints import joint_slopes
from bellcrank.mechanics.frames.quantities.strain import strain_by_geometry

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray
    from scipy.sparse import csr_matrix

    from bellcrank.mechanics.frames.equilibria import Equilibrium
    from bellcrank.mechanics.frames.evaluator import FrameEvaluator
    from bellcrank.mechanics.frames.quantities import Measures, Quantity
    from bellcrank.mechanics.kernels.arrays import Floats

COMPLEX_STEP = 1e-30
MOTION_STEP = 1e-3
"""Largest displacement or rotation in central differences of the stiffness along a motion."""


class GeometrySlopes(NamedTuple):
    """Derivatives of measures by the geometry."""

    positions: NDArray[np.float64]
    """(k, N, d) by the positions of the nodes."""
    widths: NDArray[np.float64]
    """(k, M) by the widths of the beams."""


class BeamSlopes(NamedTuple):
    """Derivatives of the properties of beams by length, width, and the length of both joints."""

    section: Floats
    """(4, M, c) of their stiffness."""
    bow: Floats
    """(4, M, 3) of the coefficients of their shortening."""
    joints: csr_matrix
    """(N d + M, 2 M) of the lengths of joints by positions and widths."""


def beam_slopes(
    evaluator: FrameEvaluator, mask: NDArray[np.bool_], joints: csr_matrix | None = None
) -> BeamSlopes:
    """Return the derivatives of the properties of all beams, by complex steps.

    Parameters
    ----------
    evaluator
        Evaluator of the frame.
    mask : (M,) bool
        The design.
    joints : (2 M, N d + M) sparse, optional
        Derivatives of the lengths of joints, as `joint_slopes` returns them. By default joints
        follow the geometry of the design if the problem has joints of its own; else they are in
        proportion to the width.
    """
    from scipy.sparse import csr_matrix

    problem, frame = evaluator.problem, evaluator.frame
    assert problem.section is not None
    assert problem.material is not None
    given, dimension = problem.section, problem.lattice.dimension
    section, bow = [], []
    bowed = evaluator.elements is None
    for row in range(4):
        length, width, first, second = 1j * COMPLEX_STEP * np.eye(4)[row]
        rigid = frame.rigid + np.array([first, second])
        stiffness = beam_stiffness(
            given, problem.material, frame.rest_length + length, evaluator.theory, dimension,
            rigid, (frame.width + width) / given.width,
        )  # fmt: skip
        section.append(stiffness.imag / COMPLEX_STEP)
        coefficients = bow_coefficients(frame.rest_length + length, rigid)
        bow.append(coefficients.imag / COMPLEX_STEP * bowed)
    if joints is None and problem.joints is not None:
        joints = joint_slopes(problem, mask)
    elif joints is None:
        beams = problem.lattice.beam_count
        columns = problem.lattice.positions.size + np.repeat(np.arange(beams), 2)
        joints = csr_matrix(
            (np.full(2 * beams, given.joint / given.width), (np.arange(2 * beams), columns)),
            shape=(2 * beams, problem.lattice.positions.size + beams),
        )
    return BeamSlopes(np.stack(section), np.stack(bow), joints.T.tocsr())


def geometry_slopes(
    equilibrium: Equilibrium,
    measured: Sequence[tuple[Quantity, Measures]],
    beams: BeamSlopes,
) -> list[GeometrySlopes] | None:
    """Return the derivatives of measures by the geometry; None if the equilibrium is unstable.

    Parameters
    ----------
    equilibrium
        One of an evaluator with one element in each beam.
    measured
        Quantities, and their measures there.
    beams
        Derivatives of the properties of beams.
    """
    from bellcrank.mechanics.frames.kernels.response import solve_fields

    slopes = [quantity.slopes(equilibrium, found) for quantity, found in measured]
    rows = [each.fields for each in slopes]
    rows += [each.by_motion for each in slopes if each.by_motion is not None]
    adjoints = np.concatenate(rows)
    stable = solve_fields(
        equilibrium.frame, equilibrium.structure, equilibrium.fraction, equilibrium.state,
        adjoints, equilibrium.memory,
    )  # fmt: skip
    if not stable:
        return None
    counts = np.cumsum([0] + [len(each.fields) for each in slopes])
    for begin, each in zip(counts[:-1].tolist(), slopes, strict=True):
        if each.on_held is not None:
            adjoints[begin : begin + len(each.fields)] += each.on_held
    direct = _products(equilibrium, adjoints[: counts[-1]], beams)
    found, begin_motion = [], int(counts[-1])
    for index, (_, measures) in enumerate(measured):
        own = slice(int(counts[index]), int(counts[index + 1]))
        positions, widths, joints = (-each[own] for each in direct)
        by_motion = slopes[index].by_motion
        if by_motion is not None:
            motion_adjoints = adjoints[begin_motion : begin_motion + len(by_motion)]
            begin_motion += len(by_motion)
            if measures.motion is not None:
                second = _stiffness_products(equilibrium, motion_adjoints, measures.motion, beams)
                positions, widths, joints = (
                    one - two for one, two in zip((positions, widths, joints), second, strict=True)
                )
        if measures.beams is not None:
            by_chord, by_width, by_joint = strain_by_geometry(equilibrium, measures.beams)
            row = np.arange(len(by_chord))
            first_node, second_node = equilibrium.frame.beams[measures.beams].T
            positions[row, second_node] += by_chord
            positions[row, first_node] -= by_chord
            widths[row, measures.beams] += by_width
            joints[row, measures.beams] += by_joint
        by_joints = (beams.joints @ joints.reshape(len(joints), -1).T).T
        coordinates = positions[0].size
        positions = positions + by_joints[:, :coordinates].reshape(positions.shape)
        found.append(GeometrySlopes(positions, widths + by_joints[:, coordinates:]))
    return found


class _Products(NamedTuple):
    """Derivatives by positions (k, N, d), widths (k, M) and joints (k, M, 2), each alone."""

    positions: NDArray[np.float64]
    widths: NDArray[np.float64]
    joints: NDArray[np.float64]


def _products(
    equilibrium: Equilibrium, adjoints: NDArray[np.float64], beams: BeamSlopes
) -> _Products:
    """Return the products of adjoints (k, N, b) with the derivatives of the residual."""
    from bellcrank.mechanics.frames.kernels.geometry import PARAMETERS, geometry_products

    frame = equilibrium.frame
    dimension, section = equilibrium.problem.lattice.dimension, equilibrium.problem.section
    assert section is not None
    positions = np.zeros((len(adjoints), len(frame.positions), dimension))
    widths = np.zeros((len(adjoints), len(frame.beams)))
    joints = np.zeros((*widths.shape, 2))
    geometry_products(
        frame, equilibrium.structure, equilibrium.fraction, equilibrium.state,
        np.ascontiguousarray(adjoints), beams.section, beams.bow, positions, widths,
        joints, section.shape == "round", np.zeros((PARAMETERS, 2 * len(frame.unit))),
        equilibrium.memory,
    )  # fmt: skip
    return _Products(positions, widths, joints)


def _stiffness_products(
    equilibrium: Equilibrium,
    adjoints: NDArray[np.float64],
    motion: NDArray[np.float64],
    beams: BeamSlopes,
) -> _Products:
    """Return the products of adjoints with the derivatives of the stiffness times a motion.

    By central differences of fourth order along the motion.
    """
    step = MOTION_STEP / max(float(np.abs(motion).max()), 1e-300)
    total: list[Any] = [0.0, 0.0, 0.0]
    for shift, weight in ((1.0, 2.0 / 3.0), (2.0, -1.0 / 12.0)):
        for sign in (1.0, -1.0):
            moved = equilibrium.moved(sign * shift * step * motion)
            found = _products(moved, adjoints, beams)
            total = [
                now + sign * weight / step * each for now, each in zip(total, found, strict=True)
            ]
    return _Products(*total)
