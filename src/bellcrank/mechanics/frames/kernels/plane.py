"""Forces and tangent stiffness of a co-rotational beam in the plane.

The deformations of a beam are its elongation and the rotations of its two ends relative to the
chord; the beam is linear in them. A beam may have rigid ends: parts of its length next to the nodes
that turn with them. With n the direction of the chord, t = n turned by 90 degrees,
l the length, N the axial force and M1, M2 the end moments, the tangent stiffness is

    B' K B + (N / l) z z' + ((M1 + M2) / l^2) (r z' + z r')

where r is the derivative of the elongation by the end displacements and z / l that of the
rotation of the chord (M. A. Crisfield, Non-linear finite element analysis of solids and
structures, vol. 1, 1991, ch. 7).

A bent beam is shorter by half the integral of its squared slope, p (a^2 + b^2) + q a b for end
rotations a and b and the coefficients (p, q) of `bow`. The elongation includes this, so that
compression softens the beam against bending and a single element follows the buckling of a strut.
With zeros the beam is linear in its deformations.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from bellcrank.mechanics.kernels._compile import kernel

if TYPE_CHECKING:
    from bellcrank.mechanics.kernels.arrays import Floats

TAU = 2.0 * math.pi


class PlaneBeam(NamedTuple):
    """Forces of a deformed beam in the plane.

    Scalars, which a compiled function keeps in registers: arrays would take twice the time.
    """

    axial: float
    shear: float
    """Sum of the end moments over the length."""
    moment1: float
    moment2: float
    inverse: float
    """One over the length."""
    cosine: float
    sine: float
    """Direction of the chord."""
    slope_x: float
    slope_y: float
    """Derivative of axial force over EA/L by the displacements of the first end; the negative of
    that by those of the second."""
    bow1: float
    bow2: float
    """The same by the rotations of the ends."""


class PlaneStiffness(NamedTuple):
    """Entries of the stiffness of a beam in the plane."""

    xx: float
    xy: float
    yy: float
    """Block of the displacements of an end; the negative of that between both ends."""
    xt: float
    yt: float
    """Displacements of the first end by its own rotation."""
    xo: float
    yo: float
    """The same by the rotation of the other end."""
    own1: float
    other: float
    own2: float
    """Rotations."""


@kernel
def wrapped(angle: float) -> float:
    """Return an angle between -pi and pi."""
    return angle - TAU * math.floor(angle / TAU + 0.5)


@kernel
def plane_deformations(
    rest: Floats, rest_length: float, first: Floats, second: Floats
) -> tuple[float, float, float, float, float, float]:
    """Return elongation, end rotations, one over the length, and the direction of the chord.

    Parameters
    ----------
    rest, rest_length
        (2,) vector along the beam at rest and its length.
    first, second
        (3,) displacements and rotation of the ends.
    """
    dx, dy = second[0] - first[0], second[1] - first[1]
    x, y = rest[0] + dx, rest[1] + dy
    length = math.sqrt(x * x + y * y)
    turn = math.atan2(rest[0] * y - rest[1] * x, rest[0] * x + rest[1] * y)
    # From the difference of squares: that of the lengths loses digits.
    elongation = ((rest[0] + x) * dx + (rest[1] + y) * dy) / (length + rest_length)
    inverse = 1.0 / length
    return (
        elongation, wrapped(first[2] - turn), wrapped(second[2] - turn), inverse, x * inverse,
        y * inverse,
    )  # fmt: skip


@kernel
def plane_beam(
    rest: Floats, rest_length: float, section: Floats, bow: Floats, first: Floats, second: Floats
) -> PlaneBeam:
    """Compute the forces of a beam.

    Parameters
    ----------
    rest, rest_length, first, second
        As in `plane_deformations`.
    section
        (4,) stiffness: axial, bending of the first end by its own and by the other rotation, and
        of the second end by its own.
    bow
        (3,) coefficients of the shortening of a bent beam: of the squared rotation of its first
        end, of the product of both rotations, and of that of its second end squared; or zeros.
    """
    elongation, one, two, inverse, c, s = plane_deformations(rest, rest_length, first, second)
    shortening = bow[0] * one * one + bow[1] * one * two + bow[2] * two * two
    axial = section[0] * (elongation + shortening)
    bow1 = 2.0 * bow[0] * one + bow[1] * two
    bow2 = 2.0 * bow[2] * two + bow[1] * one
    moment1 = section[1] * one + section[2] * two + axial * bow1
    moment2 = section[2] * one + section[3] * two + axial * bow2
    turn = (bow1 + bow2) * inverse
    return PlaneBeam(
        axial, (moment1 + moment2) * inverse, moment1, moment2, inverse, c, s, -c - turn * s,
        -s + turn * c, bow1, bow2,
    )  # fmt: skip


@kernel
def plane_stiffness(
    beam: PlaneBeam, section: Floats, bow: Floats, tension: float, softening: float
) -> PlaneStiffness:
    """Compute the tangent stiffness of a beam.

    Parameters
    ----------
    tension
        Axial force in the tangent stiffness; that of the beam itself gives the exact derivative.
    softening
        Factor of the part of the tangent that depends on the forces: 1, or 0 to leave it out.
    """
    inverse, c, s = beam.inverse, beam.cosine, beam.sine
    axial = softening * tension
    own1, own2 = section[1] + 2.0 * bow[0] * axial, section[3] + 2.0 * bow[2] * axial
    other = section[2] + bow[1] * axial
    # Displacements: b t t' + e (n t' + t n') + a g g', with the derivative g of the axial force.
    a = section[0]
    bend1, bend2 = (own1 + other) * inverse, (own2 + other) * inverse
    b = (bend1 + bend2 + axial) * inverse
    e = softening * beam.shear * inverse
    gx, gy = beam.slope_x, beam.slope_y
    xx = b * s * s - 2.0 * e * c * s + a * gx * gx
    xy = -b * c * s + e * (c * c - s * s) + a * gx * gy
    yy = b * c * c + 2.0 * e * c * s + a * gy * gy
    g1, g2 = a * beam.bow1, a * beam.bow2
    return PlaneStiffness(
        xx, xy, yy, gx * g1 - bend1 * s, gy * g1 + bend1 * c, gx * g2 - bend2 * s,
        gy * g2 + bend2 * c, own1 + g1 * beam.bow1, other + g1 * beam.bow2, own2 + g2 * beam.bow2,
    )  # fmt: skip


@kernel
def add_plane_force(beam: PlaneBeam, first: Floats, second: Floats) -> None:
    """Add forces and moment on the first and on the second end."""
    x = -beam.axial * beam.cosine - beam.shear * beam.sine
    y = -beam.axial * beam.sine + beam.shear * beam.cosine
    first[0] += x
    first[1] += y
    first[2] += beam.moment1
    second[0] -= x
    second[1] -= y
    second[2] += beam.moment2


@kernel
def fill_plane_tangent(k: PlaneStiffness, tangent: Floats) -> None:
    """Store (6, 6) the derivative of the forces by the end displacements."""
    for end in range(2):
        for other in range(2):
            sign = 1.0 if end == other else -1.0
            i, j = 3 * end, 3 * other
            tangent[i, j], tangent[i + 1, j + 1] = sign * k.xx, sign * k.yy
            tangent[i, j + 1] = tangent[i + 1, j] = sign * k.xy
        sign = -1.0 if end else 1.0
        i = 3 * end
        tangent[i, 2] = tangent[2, i] = sign * k.xt
        tangent[i + 1, 2] = tangent[2, i + 1] = sign * k.yt
        tangent[i, 5] = tangent[5, i] = sign * k.xo
        tangent[i + 1, 5] = tangent[5, i + 1] = sign * k.yo
    tangent[2, 2], tangent[5, 5] = k.own1, k.own2
    tangent[2, 5] = tangent[5, 2] = k.other


@kernel
def add_plane_stiffness(
    k: PlaneStiffness, i: int, j: int, entry: int, diagonal: Floats, entries: Floats
) -> None:
    """Add the stiffness of a beam to the lower triangles of blocks i and j, and to their coupling.

    Parameters
    ----------
    i, j
        Blocks of the first and of the second end; -1 for an end that is held.
    entry
        Coupling of both; its rows belong to the block that is eliminated last.
    """
    if i >= 0:
        block = diagonal[i]
        block[0, 0] += k.xx
        block[1, 0] += k.xy
        block[1, 1] += k.yy
        block[2, 0] += k.xt
        block[2, 1] += k.yt
        block[2, 2] += k.own1
    if j >= 0:
        block = diagonal[j]
        block[0, 0] += k.xx
        block[1, 0] += k.xy
        block[1, 1] += k.yy
        block[2, 0] -= k.xo
        block[2, 1] -= k.yo
        block[2, 2] += k.own2
    if entry >= 0:
        block = entries[entry]
        block[0, 0] -= k.xx
        block[0, 1] -= k.xy
        block[1, 0] -= k.xy
        block[1, 1] -= k.yy
        block[2, 2] += k.other
        xt, yt, xo, yo = (k.xo, k.yo, -k.xt, -k.yt) if i < j else (-k.xt, -k.yt, k.xo, k.yo)
        # Rotation of the row's end by displacements of the column's, and the reverse.
        block[2, 0] += xt
        block[2, 1] += yt
        block[0, 2] += xo
        block[1, 2] += yo
