"""Forces and tangent stiffness of a co-rotational beam in the plane.

The deformations of a beam are its elongation and the rotations of its two ends relative to the
chord; the beam is linear in them. With n the direction of the chord, t = n turned by 90 degrees,
l the length, N the axial force and M1, M2 the end moments, the tangent stiffness is

    B' K B + (N / l) z z' + ((M1 + M2) / l^2) (r z' + z r')

where r is the derivative of the elongation by the end displacements and z / l that of the
rotation of the chord (M. A. Crisfield, Non-linear finite element analysis of solids and
structures, vol. 1, 1991, ch. 7).

A bent beam is shorter. With `bow` = L / 30 the elongation includes the shortening by the mean slope
squared of its cubic, bow (2 a^2 - a b + 2 b^2) for end rotations a and b, so that compression
softens the beam against bending and a single element follows the buckling of a strut. With 0 it is
linear in its deformations.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.mechanics.kernels._compile import kernel

if TYPE_CHECKING:
    from bellcrank.mechanics.kernels.arrays import Floats

TAU = 2.0 * math.pi
PLANE_WORK = 14
"""Numbers of memory that a beam in the plane needs."""


@kernel
def wrapped(angle: float) -> float:
    """Return an angle between -pi and pi."""
    return angle - TAU * math.floor(angle / TAU + 0.5)


@kernel
def plane_deformations(rest: Floats, first: Floats, second: Floats, out: Floats) -> None:
    """Compute the deformations of a beam.

    Parameters
    ----------
    rest
        (2,) vector along the beam at rest.
    first, second
        (3,) displacements and rotation of the ends.
    out
        (6,) elongation, end rotations, length, direction of the chord.
    """
    dx, dy = second[0] - first[0], second[1] - first[1]
    x, y = rest[0] + dx, rest[1] + dy
    length = math.sqrt(x * x + y * y)
    rest_length = math.sqrt(rest[0] * rest[0] + rest[1] * rest[1])
    turn = math.atan2(rest[0] * y - rest[1] * x, rest[0] * x + rest[1] * y)
    # From the difference of squares: that of the lengths loses digits.
    out[0] = ((rest[0] + x) * dx + (rest[1] + y) * dy) / (length + rest_length)
    out[1] = wrapped(first[2] - turn)
    out[2] = wrapped(second[2] - turn)
    out[3], out[4], out[5] = length, x / length, y / length


@kernel
def plane_force(
    rest: Floats,
    section: Floats,
    bow: float,
    first: Floats,
    second: Floats,
    work: Floats,
    force: Floats,
) -> None:
    """Compute the end forces of a beam; see `plane_beam`.

    Left in `work` are axial force (6), sum of the end moments over the length (7), and the
    derivative of axial force over EA/L by the end displacements (8 to 13).
    """
    plane_deformations(rest, first, second, work)
    length, c, s = work[3], work[4], work[5]
    one, two = work[1], work[2]
    axial = section[0] * (work[0] + bow * (2.0 * (one * one + two * two) - one * two))
    bow1, bow2 = bow * (4.0 * one - two), bow * (4.0 * two - one)
    moment1 = section[1] * one + section[2] * two + axial * bow1
    moment2 = section[2] * one + section[1] * two + axial * bow2
    shear = (moment1 + moment2) / length
    force[0], force[1] = -axial * c - shear * s, -axial * s + shear * c
    force[2], force[5] = moment1, moment2
    force[3], force[4] = -force[0], -force[1]
    work[6], work[7] = axial, shear
    turn = (bow1 + bow2) / length
    work[8], work[9], work[10] = -c - turn * s, -s + turn * c, bow1
    work[11], work[12], work[13] = -work[8], -work[9], bow2


@kernel
def plane_beam(
    rest: Floats,
    section: Floats,
    bow: float,
    first: Floats,
    second: Floats,
    tension: float,
    softening: float,
    work: Floats,
    force: Floats,
    tangent: Floats,
) -> None:
    """Compute the end forces and the tangent stiffness of a beam.

    Parameters
    ----------
    rest
        (2,) vector along the beam at rest.
    section
        (3,) stiffness: axial EA/L, bending of an end by its own and by the other rotation.
    bow
        L / 30, or 0 to leave out the shortening of a bent beam.
    first, second
        (3,) displacements and rotation of the ends.
    tension
        Axial force in the tangent stiffness; that of the beam itself gives the exact derivative.
    softening
        Factor of the part of the tangent that depends on the forces: 1, or 0 to leave it out.
    work
        (PLANE_WORK,) memory.
    force
        (6,) result: forces and moment on the first and on the second end.
    tangent
        (6, 6) result: derivative of the forces by the end displacements.
    """
    plane_force(rest, section, bow, first, second, work, force)
    inverse, c, s = 1.0 / work[3], work[4], work[5]
    axial, shear = softening * tension, softening * work[7]
    own, other = section[1] + 4.0 * bow * axial, section[2] - bow * axial
    # Blocks of displacements: b t t' + e (n t' + t n'); the axial part a g g' is added below.
    a = section[0]
    b = 2.0 * (own + other) * inverse * inverse + axial * inverse
    e = shear * inverse
    xx = b * s * s - 2.0 * e * c * s
    yy = b * c * c + 2.0 * e * c * s
    xy = -b * c * s + e * (c * c - s * s)
    bend = (own + other) * inverse
    for k in range(2):
        sign_k = 1.0 if k else -1.0
        for m in range(2):
            sign = sign_k if m else -sign_k
            tangent[3 * k, 3 * m] = sign * xx
            tangent[3 * k, 3 * m + 1] = tangent[3 * k + 1, 3 * m] = sign * xy
            tangent[3 * k + 1, 3 * m + 1] = sign * yy
            tangent[3 * k + 2, 3 * m + 2] = own if k == m else other
            tangent[3 * k, 3 * m + 2] = tangent[3 * m + 2, 3 * k] = sign_k * bend * s
            tangent[3 * k + 1, 3 * m + 2] = tangent[3 * m + 2, 3 * k + 1] = -sign_k * bend * c
    for k in range(6):
        for m in range(6):
            tangent[k, m] += a * work[8 + k] * work[8 + m]
