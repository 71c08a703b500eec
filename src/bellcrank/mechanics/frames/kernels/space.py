"""Forces and tangent stiffness of a co-rotational beam in space.

The orientation of a node is a rotation matrix. Each end of a beam carries a triad t1, t2, t3: the
axis of the beam and the principal axes of its section at rest, rotated with the node. With c the
vector between the ends and x, y, z = c.t1, c.t2, c.t3 of an end, the six deformations of a beam
are

    elongation        |c| - L
    twist             atan2(t3.T2 - t2.T3, t2.T2 + t3.T3), the part about t1 of the rotation from
                      the triad t of the first end to T of the second
    end rotations     about t3: -y b / q, about t2: z b / q, with q^2 = y^2 + z^2 and
                      b = atan2(q, x) the angle between the axis and the chord

and the beam is linear in them. They depend on scalar products alone, so a rotation of the whole
model changes nothing; on the current orientations alone, so results do not depend on the path;
and not on the choice of t2 and t3 for a round section. In the plane they are those of `plane`.

Forces and stiffness are derivatives of the energy by the displacements and by spins w of the
nodes, R -> exp(w) R. A scalar product a.b of two vectors, of which b rotates with a node, has the
derivative b x a by the spin and the second derivative (a b' + b a') / 2 - (a.b) 1. Deformations
do not change when c is multiplied by a factor, so the sums of the last terms vanish at each end.

As in the plane, the elongation may include the shortening of a bent beam.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.mechanics.frames.kernels.space_angles import (
    FIRST,
    SECOND,
    add_end_hessian,
    add_twist_hessian,
    coordinate_gradients,
    dot,
    end_rotations,
    rotation_gradients,
    rotation_hessian,
    triad,
    twist,
)
from bellcrank.mechanics.kernels._compile import kernel

if TYPE_CHECKING:
    from bellcrank.mechanics.kernels.arrays import Floats


@kernel
def space_deformations(
    rest: Floats, shift: Floats, rotation1: Floats, rotation2: Floats, work: Floats, out: Floats
) -> None:
    """Compute the deformations of a beam, and the memory that `space_beam` needs.

    Parameters
    ----------
    rest
        (4, 3) vector along the beam at rest, then its triad, one vector a row.
    shift
        (3,) displacement of the second end relative to the first.
    rotation1, rotation2
        (3, 3) orientations of the ends.
    work
        (9, 9, 9) memory.
    out
        (6,) elongation, twist, rotations of the first end about t3 and t2, those of the second.
    """
    chord, first, second = work[7, 0], work[7, 1:4], work[7, 4:7]
    for i in range(3):
        chord[i] = rest[0, i] + shift[i]
    triad(rest[1:], rotation1, first)
    triad(rest[1:], rotation2, second)
    length = math.sqrt(dot(chord, chord))
    rest_length = math.sqrt(dot(rest[0], rest[0]))
    # From the difference of squares: that of the lengths loses digits.
    out[0] = (dot(rest[0], shift) + dot(chord, shift)) / (length + rest_length)
    out[1] = twist(first, second, work[1])
    end_rotations(chord, first, work[4, 0], out[2:4])
    end_rotations(chord, second, work[5, 0], out[4:6])


@kernel
def space_force(
    rest: Floats,
    section: Floats,
    bow: Floats,
    shift: Floats,
    rotation1: Floats,
    rotation2: Floats,
    work: Floats,
    force: Floats,
) -> None:
    """Compute the end forces of a beam, and the memory that `space_tangent` needs.

    Parameters
    ----------
    rest
        (4, 3) vector along the beam at rest, then its triad, one vector a row.
    section
        (8,) stiffness: axial, torsion, bending about t3 of the first end by its own and by the
        other rotation and of the second end by its own, the same three about t2.
    bow
        (3,) coefficients of the shortening of a bent beam, as in the plane, or zeros.
    shift
        (3,) displacement of the second end relative to the first.
    rotation1, rotation2
        (3, 3) orientations of the ends.
    work
        (9, 9, 9) memory. Rows left in work[0] are the gradients of the deformations; row 6 is that
        of the elongation with the shortening, by the chord and the spins of the ends.
    force
        (12,) result: force and moment on the first and on the second end.
    """
    d, q, inner, gradient = work[8, 0], work[8, 1], work[8, 2], work[0]
    chord, twisted, slope = work[7, 0], work[1], work[8, 5]
    space_deformations(rest, shift, rotation1, rotation2, work, d)
    stretched = d[0]
    for k in range(2, 4):
        a, b = d[k], d[k + 2]
        stretched += bow[0] * a * a + bow[1] * a * b + bow[2] * b * b
        slope[k], slope[k + 2] = 2.0 * bow[0] * a + bow[1] * b, 2.0 * bow[2] * b + bow[1] * a
    q[0], q[1] = section[0] * stretched, section[1] * d[1]
    for k in range(2):
        own1, other, own2 = section[2 + 3 * k], section[3 + 3 * k], section[4 + 3 * k]
        q[2 + k] = own1 * d[2 + k] + other * d[4 + k] + q[0] * slope[2 + k]
        q[4 + k] = other * d[2 + k] + own2 * d[4 + k] + q[0] * slope[4 + k]
    length = math.sqrt(dot(chord, chord))
    for i in range(9):
        gradient[0, i] = chord[i] / length if i < 3 else 0.0
        gradient[1, i] = twisted[0, i] * twisted[2, 3]
    end_gradients(chord, work[7, 1:4], FIRST, work[4], work[2], gradient[2:4])
    end_gradients(chord, work[7, 4:7], SECOND, work[5], work[2], gradient[4:6])
    for i in range(9):
        total, along = 0.0, gradient[0, i]
        for k in range(6):
            total += q[k] * gradient[k, i]
        for k in range(2, 6):
            along += slope[k] * gradient[k, i]
        inner[i], gradient[6, i] = total, along
    for end in range(2):
        sign = 1.0 if end else -1.0
        for i in range(3):
            force[6 * end + i] = sign * inner[i]
            force[6 * end + 3 + i] = inner[3 + 3 * end + i]


@kernel
def end_gradients(
    chord: Floats, axes: Floats, spin: int, known: Floats, work: Floats, gradient: Floats
) -> None:
    """Compute the (2, 9) gradients of the rotations of an end."""
    h, slopes = known[0], known[1:3]
    rotation_gradients(h, slopes)
    coordinate_gradients(chord, axes, spin, work)
    for k in range(2):
        for i in range(9):
            total = 0.0
            for a in range(3):
                total += slopes[k, a] * work[a, i]
            gradient[k, i] = total


@kernel
def space_tangent(
    section: Floats, bow: Floats, tension: float, softening: float, work: Floats, tangent: Floats
) -> None:
    """Compute the tangent stiffness of a beam after `space_force`.

    Parameters
    ----------
    tension
        Axial force in the tangent stiffness; that of the beam itself gives the exact derivative.
    softening
        Factor of the part of the tangent that depends on the forces: 1, or 0 to leave it out.
    tangent
        (12, 12) result: derivative of the forces by displacements and spins of the ends.
    """
    q, moments, matrix, gradient = work[8, 1], work[8, 3], work[6], work[0]
    chord = work[7, 0]
    for k in range(1, 6):
        moments[k] = softening * q[k]
    begin_matrix(chord, softening * tension, gradient, matrix)
    add_twist_hessian(work[7, 4:7], moments[1], work[1], matrix)
    add_end(chord, work[7, 1:4], FIRST, moments[2:4], work[4], work[2], matrix)
    add_end(chord, work[7, 4:7], SECOND, moments[4:6], work[5], work[2], matrix)
    add_stiffness(section, bow, softening * tension, gradient, matrix)
    spread(matrix, tangent)


@kernel
def begin_matrix(chord: Floats, axial: float, gradient: Floats, matrix: Floats) -> None:
    """Set the matrix to an axial force times the Hessian of the elongation."""
    ratio = axial / math.sqrt(dot(chord, chord))
    for i in range(9):
        for j in range(9):
            matrix[i, j] = 0.0
    for i in range(3):
        for j in range(3):
            matrix[i, j] = -gradient[0, i] * gradient[0, j] * ratio
        matrix[i, i] += ratio


@kernel
def add_end(
    chord: Floats,
    axes: Floats,
    spin: int,
    moments: Floats,
    known: Floats,
    work: Floats,
    matrix: Floats,
) -> None:
    """Add moments times the Hessians of the rotations of an end."""
    h, slopes = known[0], known[1:3]
    coordinate_gradients(chord, axes, spin, work)
    rotation_hessian(h, moments[0], moments[1], work[5:8])
    add_end_hessian(chord, axes, spin, slopes, moments, work, matrix)


@kernel
def add_stiffness(
    section: Floats, bow: Floats, tension: float, gradient: Floats, matrix: Floats
) -> None:
    """Add the stiffness of the deformations to the matrix."""
    bowing1, bowing2 = 2.0 * bow[0] * tension, 2.0 * bow[2] * tension
    for i in range(9):
        for j in range(9):
            value = section[0] * gradient[6, i] * gradient[6, j]
            value += section[1] * gradient[1, i] * gradient[1, j]
            for k in range(2):
                a, b = gradient[2 + k], gradient[4 + k]
                own1, own2 = section[2 + 3 * k] + bowing1, section[4 + 3 * k] + bowing2
                other = section[3 + 3 * k] + bow[1] * tension
                value += own1 * a[i] * a[j] + own2 * b[i] * b[j]
                value += other * (a[i] * b[j] + b[i] * a[j])
            matrix[i, j] += value


@kernel
def spread(matrix: Floats, tangent: Floats) -> None:
    """Convert from chord and spins to displacements and spins of both ends."""
    for end in range(2):
        sign = 1.0 if end else -1.0
        for other in range(2):
            across = 1.0 if other else -1.0
            for i in range(3):
                for j in range(3):
                    row, column = 6 * end + i, 6 * other + j
                    tangent[row, column] = sign * across * matrix[i, j]
                    tangent[row, column + 3] = sign * matrix[i, 3 + 3 * other + j]
                    tangent[row + 3, column] = across * matrix[3 + 3 * end + i, j]
                    tangent[row + 3, column + 3] = matrix[3 + 3 * end + i, 3 + 3 * other + j]
