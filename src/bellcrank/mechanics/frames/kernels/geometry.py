"""Derivatives of the forces of beams by the positions of their nodes, widths and joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.mechanics.frames.kernels.beams import axial_force, beam_tangent, plane_beam_of
from bellcrank.mechanics.frames.kernels.plane import plane_deformations
from bellcrank.mechanics.kernels._compile import entry, kernel

if TYPE_CHECKING:
    from bellcrank.mechanics.frames.kernels.arrays import Frame, Memory, State, Structure
    from bellcrank.mechanics.kernels.arrays import Floats

LENGTH, WIDTH, JOINTS = 0, 1, 2
"""Rows of the derivatives of the stiffness and of the shortening of a beam; the joint of its second
end has the last row."""
PARAMETERS = 4


@kernel
def plane_parameter_force(
    frame: Frame,
    state: State,
    beam: int,
    section_slope: Floats,
    bow_slope: Floats,
    shortened: float,
    out: Floats,
) -> None:
    """Compute the derivative (6,) of the end forces of a beam by one parameter alone.

    Parameters
    ----------
    section_slope, bow_slope
        (4,) and (3,) derivatives of its stiffness and of the coefficients of its shortening.
    shortened
        Derivative of its elongation: -1 for the length at rest, 0 for the others.
    """
    first, second = frame.beams[beam, 0], frame.beams[beam, 1]
    elongation, a, b, _, _, _ = plane_deformations(
        frame.rest[beam, 0], frame.rest_length[beam], state.u[first], state.u[second]
    )
    section, bow = frame.section[beam], frame.bow[beam]
    stretched = elongation + bow[0] * a * a + bow[1] * a * b + bow[2] * b * b
    changed = shortened + bow_slope[0] * a * a + bow_slope[1] * a * b + bow_slope[2] * b * b
    # Derivative of the energy by the parameter, differentiated by elongation and end rotations.
    axial = section_slope[0] * stretched + section[0] * changed
    force = section[0] * stretched
    moment1 = axial * (2.0 * bow[0] * a + bow[1] * b)
    moment2 = axial * (2.0 * bow[2] * b + bow[1] * a)
    moment1 += force * (2.0 * bow_slope[0] * a + bow_slope[1] * b)
    moment2 += force * (2.0 * bow_slope[2] * b + bow_slope[1] * a)
    moment1 += section_slope[1] * a + section_slope[2] * b
    moment2 += section_slope[2] * a + section_slope[3] * b
    result = plane_beam_of(frame, state, beam)
    shear = (moment1 + moment2) * result.inverse
    out[0] = -axial * result.cosine - shear * result.sine
    out[1] = -axial * result.sine + shear * result.cosine
    out[2], out[3], out[4], out[5] = moment1, -out[0], -out[1], moment2


@entry
def geometry_products(
    frame: Frame,
    structure: Structure,
    fraction: float,
    state: State,
    adjoints: Floats,
    section_slope: Floats,
    bow_slope: Floats,
    by_position: Floats,
    by_width: Floats,
    by_joint: Floats,
    memory: Memory,
) -> None:
    """Add products of adjoints with the derivatives of the forces of beams, in the plane.

    Parameters
    ----------
    fraction
        Fraction of the load, with which the own weight grows.
    state
        Configuration, which need not be an equilibrium.
    adjoints
        (k, N, b)
    section_slope, bow_slope
        (4, M, 4) and (4, M, 3) derivatives of the stiffness of beams and of the coefficients of
        their shortening, by length, width, and the length of each of both joints.
    by_position, by_width, by_joint
        (k, N, d), (k, M) and (k, M, 2) results.
    """
    tangent, explicit = memory.tangent_block, memory.work[0]
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        first, second = frame.beams[beam, 0], frame.beams[beam, 1]
        tension = axial_force(frame, state, beam, memory)
        beam_tangent(frame.unit, frame, state, beam, tension, 1.0, memory)
        length = frame.rest_length[beam]
        c, s = frame.rest[beam, 0, 0] / length, frame.rest[beam, 0, 1] / length
        for row in range(PARAMETERS):
            plane_parameter_force(
                frame, state, beam, section_slope[row, beam], bow_slope[row, beam],
                -1.0 if row == LENGTH else 0.0, explicit[row],
            )  # fmt: skip
        for k in range(len(adjoints)):
            x = y = turn = lengthened = widened = 0.0
            for end in range(2):
                node = frame.beams[beam, end]
                for axis in range(3):
                    weight, row = adjoints[k, node, axis], 3 * end + axis
                    # The second end moved with the first one held, and both ends turned.
                    x += weight * tangent[row, 3]
                    y += weight * tangent[row, 4]
                    turn += weight * (tangent[row, 2] + tangent[row, 5])
                    lengthened += weight * explicit[LENGTH, row]
                    widened += weight * explicit[WIDTH, row]
                    by_joint[k, beam, 0] += weight * explicit[JOINTS, row]
                    by_joint[k, beam, 1] += weight * explicit[JOINTS + 1, row]
            x += lengthened * c - turn * s / length
            y += lengthened * s + turn * c / length
            by_position[k, second, 0] += x
            by_position[k, second, 1] += y
            by_position[k, first, 0] -= x
            by_position[k, first, 1] -= y
            by_width[k, beam] += widened
        if frame.has_weight:
            add_weight_products(frame, beam, fraction, adjoints, by_position, by_width)


@kernel
def add_weight_products(
    frame: Frame,
    beam: int,
    fraction: float,
    adjoints: Floats,
    by_position: Floats,
    by_width: Floats,
) -> None:
    """Subtract products of adjoints with the derivatives of the own weight of a beam."""
    first, second = frame.beams[beam, 0], frame.beams[beam, 1]
    length = frame.rest_length[beam]
    for k in range(len(adjoints)):
        pulled = 0.0
        for axis in range(2):
            both = adjoints[k, first, axis] + adjoints[k, second, axis]
            pulled += 0.5 * fraction * frame.weight[beam, axis] * both
        for axis in range(2):
            along = pulled * frame.rest[beam, 0, axis] / (length * length)
            by_position[k, second, axis] -= along
            by_position[k, first, axis] += along
        by_width[k, beam] -= pulled / frame.width[beam]
