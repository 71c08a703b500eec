"""Derivatives of the forces of beams by the positions of their nodes, widths and joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.mechanics.frames.kernels.beams import (
    axial_force,
    beam_tangent,
    elongation,
    plane_beam_of,
)
from bellcrank.mechanics.frames.kernels.plane import plane_deformations
from bellcrank.mechanics.frames.kernels.space_angles import add_cross
from bellcrank.mechanics.frames.kernels.state import force_share
from bellcrank.mechanics.kernels._compile import entry, kernel

if TYPE_CHECKING:
    from bellcrank.mechanics.frames.kernels.arrays import Frame, Memory, State, Structure
    from bellcrank.mechanics.kernels.arrays import Floats

LENGTH, WIDTH, JOINTS = 0, 1, 2
"""Rows of the derivatives of the stiffness and of the shortening of a beam; the joint of its second
end has the last row."""
PARAMETERS = 4
"""Number of these rows."""


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


@kernel
def space_parameter_force(
    frame: Frame,
    beam: int,
    section_slope: Floats,
    bow_slope: Floats,
    shortened: float,
    work: Floats,
    out: Floats,
) -> None:
    """As `plane_parameter_force`, (12,) in space, from what `beam_tangent` left in `work`."""
    d, gradient, slope = work[8, 0], work[0], work[8, 6]
    section, bow = frame.section[beam], frame.bow[beam]
    force, changed = section[0] * elongation(frame, beam, d), shortened
    for k in range(2, 4):
        a, b = d[k], d[k + 2]
        changed += bow_slope[0] * a * a + bow_slope[1] * a * b + bow_slope[2] * b * b
    axial = section_slope[0] * force / section[0] + section[0] * changed
    slope[0], slope[1] = axial, section_slope[1] * d[1]
    for k in range(2):
        own1, other, own2 = (
            section_slope[2 + 3 * k], section_slope[3 + 3 * k], section_slope[4 + 3 * k],
        )  # fmt: skip
        a, b = d[2 + k], d[4 + k]
        slope[2 + k] = own1 * a + other * b + axial * (2.0 * bow[0] * a + bow[1] * b)
        slope[4 + k] = other * a + own2 * b + axial * (2.0 * bow[2] * b + bow[1] * a)
        slope[2 + k] += force * (2.0 * bow_slope[0] * a + bow_slope[1] * b)
        slope[4 + k] += force * (2.0 * bow_slope[2] * b + bow_slope[1] * a)
    for i in range(9):
        total = 0.0
        for k in range(6):
            total += slope[k] * gradient[k, i]
        if i < 3:
            out[i], out[6 + i] = -total, total
        else:
            out[i if i < 6 else 3 + i] = total


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
    round_section: bool,
    explicit: Floats,
    memory: Memory,
) -> None:
    """Add products of adjoints with the derivatives of the forces of beams.

    Parameters
    ----------
    fraction
        Fraction of the load, with which the own weight grows.
    state
        Configuration, which need not be an equilibrium.
    adjoints
        (k, N, b)
    section_slope, bow_slope
        (4, M, 4) or (4, M, 8) and (4, M, 3) derivatives of the stiffness of beams and of the
        coefficients of their shortening, by length, width, and the length of each of both joints.
    by_position, by_width, by_joint
        (k, N, d), (k, M) and (k, M, 2) results.
    round_section
        Whether sections are discs, so that the own weight grows with the square of the width.
    explicit
        (4, 2 b) memory.
    """
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        tension = axial_force(frame, state, beam, memory)
        beam_tangent(frame.unit, frame, state, beam, tension, 1.0, memory)
        for row in range(PARAMETERS):
            slope, bow = section_slope[row, beam], bow_slope[row, beam]
            shortened = -1.0 if row == LENGTH else 0.0
            if len(frame.unit) == 3:
                plane_parameter_force(frame, state, beam, slope, bow, shortened, explicit[row])
            else:
                space_parameter_force(
                    frame, beam, slope, bow, shortened, memory.work, explicit[row]
                )
        for k in range(len(adjoints)):
            if len(frame.unit) == 3:
                add_plane_products(
                    frame, beam, adjoints[k], explicit[LENGTH], by_position[k], memory
                )
            else:
                add_space_products(
                    frame, beam, adjoints[k], explicit[LENGTH], by_position[k], memory
                )
            for end in range(2):
                node, size = frame.beams[beam, end], len(frame.unit)
                for axis in range(size):
                    weight, row = adjoints[k, node, axis], size * end + axis
                    by_width[k, beam] += weight * explicit[WIDTH, row]
                    by_joint[k, beam, 0] += weight * explicit[JOINTS, row]
                    by_joint[k, beam, 1] += weight * explicit[JOINTS + 1, row]
        if frame.has_weight:
            power = 2.0 if round_section else 1.0
            add_weight_products(frame, beam, fraction, adjoints, power, by_position, by_width)


@kernel
def add_plane_products(
    frame: Frame, beam: int, adjoint: Floats, explicit: Floats, by_position: Floats, memory: Memory
) -> None:
    """Add the products of an adjoint (N, 3) with the derivatives of a beam by positions.

    Parameters
    ----------
    explicit
        (6,) derivatives of the end forces by the length alone.
    by_position
        (N, 2) result.
    """
    first, second = frame.beams[beam, 0], frame.beams[beam, 1]
    length, tangent = frame.rest_length[beam], memory.tangent_block
    c, s = frame.rest[beam, 0, 0] / length, frame.rest[beam, 0, 1] / length
    x = y = turn = lengthened = 0.0
    for row in range(6):
        weight = adjoint[first if row < 3 else second, row % 3]
        # The second end moved with the first one held, and both ends turned.
        x += weight * tangent[row, 3]
        y += weight * tangent[row, 4]
        turn += weight * (tangent[row, 2] + tangent[row, 5])
        lengthened += weight * explicit[row]
    x += lengthened * c - turn * s / length
    y += lengthened * s + turn * c / length
    by_position[second, 0] += x
    by_position[second, 1] += y
    by_position[first, 0] -= x
    by_position[first, 1] -= y


@kernel
def add_space_products(
    frame: Frame,
    beam: int,
    adjoint: Floats,
    explicit: Floats,
    by_position: Floats,
    memory: Memory,
) -> None:
    """As `add_plane_products`, with an adjoint (N, 6) and the result (N, 3).

    With the position of the second end, the triads of a beam at rest turn by the vector
    w = t1 x dX / L, and those of an end with the rotation R of its node by the spin R w. The
    tangent has the symmetric second derivatives of the energy; half of the spin times the moment
    on the end is added, since spins do not commute.
    """
    length, tangent, moved = frame.rest_length[beam], memory.tangent_block, memory.work[8, 7]
    axis, spin, carried, turn = (
        frame.rest[beam, 1], memory.work[8, 8], memory.work[7, 8], memory.work[3],
    )  # fmt: skip
    lengthened = 0.0
    for i in range(3):
        moved[i] = carried[i] = 0.0
    for row in range(12):
        weight = adjoint[frame.beams[beam, row // 6], row % 6]
        lengthened += weight * explicit[row]
        for i in range(3):
            moved[i] += weight * tangent[row, 6 + i]
    for end in range(2):
        node = frame.beams[beam, end]
        for i in range(3):
            spin[i] = 0.0
            for row in range(12):
                weight = adjoint[frame.beams[beam, row // 6], row % 6]
                spin[i] += weight * tangent[row, 6 * end + 3 + i]
        # l . (s x m) / 2 = s . (m x l) / 2 for the spin s, the moment m and the adjoint l.
        add_cross(memory.force[6 * end + 3 : 6 * end + 6], adjoint[node, 3:6], 0.5, spin, 0)
        for i in range(3):
            for j in range(3):
                carried[i] += turn[3 * end + j, i] * spin[j]
    # The part of w: carried . (t1 x dX) / L = dX . (carried x t1) / L.
    add_cross(carried, axis, 1.0 / length, moved, 0)
    first, second = frame.beams[beam, 0], frame.beams[beam, 1]
    for i in range(3):
        moved[i] += lengthened * axis[i]
        by_position[second, i] += moved[i]
        by_position[first, i] -= moved[i]


@kernel
def add_weight_products(
    frame: Frame,
    beam: int,
    fraction: float,
    adjoints: Floats,
    power: float,
    by_position: Floats,
    by_width: Floats,
) -> None:
    """Subtract products of adjoints with the derivatives of the own weight of a beam.

    The weight grows with a power of the width.
    """
    first, second = frame.beams[beam, 0], frame.beams[beam, 1]
    length = frame.rest_length[beam]
    half = 0.5 * force_share(frame, frame.weight_group, fraction)
    for k in range(len(adjoints)):
        pulled = 0.0
        for axis in range(by_position.shape[2]):
            both = adjoints[k, first, axis] + adjoints[k, second, axis]
            pulled += half * frame.weight[beam, axis] * both
        for axis in range(by_position.shape[2]):
            along = pulled * frame.rest[beam, 0, axis] / (length * length)
            by_position[k, second, axis] -= along
            by_position[k, first, axis] += along
        by_width[k, beam] -= power * pulled / frame.width[beam]
