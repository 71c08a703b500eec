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

from bellcrank.mechanics.kernels._compile import kernel

if TYPE_CHECKING:
    from bellcrank.mechanics.kernels.arrays import Floats

CHORD, FIRST, SECOND = 0, 3, 6
"""Places of the chord and of the spins of both ends among the nine coordinates of a beam."""
SMALL = 0.02
"""(q / x)^2 below which series are used."""
TERMS = 9
"""Number of their terms."""


@kernel
def dot(a: Floats, b: Floats) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def add_cross(a: Floats, b: Floats, scale: float, out: Floats, offset: int) -> None:
    """Add the vector product times a factor to three entries."""
    out[offset] += scale * (a[1] * b[2] - a[2] * b[1])
    out[offset + 1] += scale * (a[2] * b[0] - a[0] * b[2])
    out[offset + 2] += scale * (a[0] * b[1] - a[1] * b[0])


@kernel
def add_spin(a: Floats, b: Floats, scale: float, out: Floats, offset: int) -> None:
    """Add the symmetric product of two vectors times half a factor."""
    for i in range(3):
        for j in range(3):
            out[offset + i, offset + j] += 0.5 * scale * (a[i] * b[j] + a[j] * b[i])


@kernel
def angle_over_sine(x: float, p: float, h: Floats) -> None:
    """Compute h = atan2(q, x) / q with p = q^2, and its derivatives.

    Parameters
    ----------
    h
        (6,) result: h and its derivatives by x, p, xx, xp, pp.
    """
    square = x * x + p
    ratio = p / (x * x) if x > 0.0 else math.inf
    if ratio < SMALL:
        h0, h1, h2 = 0.0, 0.0, 0.0
        for k in range(TERMS, -1, -1):
            sign = 1.0 - 2.0 * (k % 2)
            h0 = h0 * ratio + sign / (2 * k + 1)
            if k >= 1:
                h1 = h1 * ratio + sign * k / (2 * k + 1)
            if k >= 2:
                h2 = h2 * ratio + sign * k * (k - 1) / (2 * k + 1)
        h[0], h[2], h[5] = h0 / x, h1 / x**3, h2 / x**5
    else:
        q = math.sqrt(p)
        h[0] = math.atan2(q, x) / q
        h[2] = 0.5 * (x / square - h[0]) / p
        h[5] = -0.5 * (x / square**2 + 3.0 * h[2]) / p
    h[1], h[3], h[4] = -1.0 / square, 2.0 * x / square**2, 1.0 / square**2


@kernel
def end_rotations(chord: Floats, axes: Floats, h: Floats, out: Floats) -> None:
    """Compute the rotations of an end about t3 and t2, and `angle_over_sine`."""
    x, y, z = dot(chord, axes[0]), dot(chord, axes[1]), dot(chord, axes[2])
    angle_over_sine(x, y * y + z * z, h)
    out[0], out[1] = -y * h[0], z * h[0]
    h[6], h[7], h[8] = x, y, z


@kernel
def rotation_gradients(h: Floats, out: Floats) -> None:
    """Compute (2, 3) derivatives of both end rotations by x, y, z."""
    y, z = h[7], h[8]
    out[0, 0], out[0, 1], out[0, 2] = -y * h[1], -h[0] - 2.0 * y * y * h[2], -2.0 * y * z * h[2]
    out[1, 0], out[1, 1], out[1, 2] = z * h[1], 2.0 * y * z * h[2], h[0] + 2.0 * z * z * h[2]


@kernel
def rotation_hessian(h: Floats, about3: float, about2: float, out: Floats) -> None:
    """Compute (3, 3) second derivatives of moments times end rotations by x, y, z."""
    y, z = h[7], h[8]
    m, k = -about3, about2
    bend = m * y + k * z
    out[0, 0] = bend * h[3]
    out[0, 1] = m * h[1] + 2.0 * y * bend * h[4]
    out[0, 2] = k * h[1] + 2.0 * z * bend * h[4]
    out[1, 1] = (4.0 * m * y + 2.0 * bend) * h[2] + 4.0 * y * y * bend * h[5]
    out[2, 2] = (4.0 * k * z + 2.0 * bend) * h[2] + 4.0 * z * z * bend * h[5]
    out[1, 2] = 2.0 * (m * z + k * y) * h[2] + 4.0 * y * z * bend * h[5]
    out[1, 0], out[2, 0], out[2, 1] = out[0, 1], out[0, 2], out[1, 2]


@kernel
def twist(first: Floats, second: Floats, work: Floats) -> float:
    """Return the twist, and store N = x grad y - y grad x and D = x grad x + y grad y."""
    y = dot(first[2], second[1]) - dot(first[1], second[2])
    x = dot(first[1], second[1]) + dot(first[2], second[2])
    n, d, p, s = work[0], work[1], work[2], work[3]
    for i in range(9):
        n[i], d[i] = 0.0, 0.0
    for i in range(3):
        p[i] = x * first[2, i] - y * first[1, i]
        s[i] = -x * first[1, i] - y * first[2, i]
    add_cross(p, second[1], 1.0, n, FIRST)
    add_cross(s, second[2], 1.0, n, FIRST)
    add_cross(s, second[1], -1.0, d, FIRST)
    add_cross(p, second[2], 1.0, d, FIRST)
    for i in range(3):
        n[SECOND + i], d[SECOND + i] = -n[FIRST + i], -d[FIRST + i]
    p[3] = 1.0 / (x * x + y * y)
    return math.atan2(y, x)


@kernel
def add_twist_hessian(second: Floats, moment: float, work: Floats, out: Floats) -> None:
    """Add a moment times the Hessian of the twist.

    That of the angle atan2(y, x) is (x Hess y - y Hess x) / r^2 - (N D' + D N') / r^4.
    """
    n, d, p, s = work[0], work[1], work[2], work[3]
    scale = moment * p[3]
    for k in range(2):
        a = p if k == 0 else s
        b = second[1 + k]
        value = scale * dot(a, b)
        add_spin(a, b, scale, out, FIRST)
        add_spin(a, b, scale, out, SECOND)
        for i in range(3):
            out[FIRST + i, FIRST + i] -= value
            out[SECOND + i, SECOND + i] -= value
            out[FIRST + i, SECOND + i] += value
            out[SECOND + i, FIRST + i] += value
            for j in range(3):
                out[FIRST + i, SECOND + j] -= scale * b[i] * a[j]
                out[SECOND + j, FIRST + i] -= scale * b[i] * a[j]
    factor = scale * p[3]
    for i in range(3, 9):
        for j in range(3, 9):
            out[i, j] -= factor * (n[i] * d[j] + d[i] * n[j])


@kernel
def add_end_hessian(
    chord: Floats,
    axes: Floats,
    spin: int,
    slopes: Floats,
    moments: Floats,
    work: Floats,
    out: Floats,
) -> None:
    """Add moments times the Hessians of both rotations of an end.

    Parameters
    ----------
    slopes
        (2, 3) result of `rotation_gradients`.
    moments
        (2,) moments about t3 and t2.
    work
        Memory: rows 0 to 2 are the gradients of x, y, z; 5 to 7 the result of `rotation_hessian`.
    """
    w = work[3]
    for i in range(3):
        w[i] = 0.0
        for a in range(3):
            w[i] += (moments[0] * slopes[0, a] + moments[1] * slopes[1, a]) * axes[a, i]
    add_spin(chord, w, 1.0, out, spin)
    for i in range(3):
        following, last = (i + 1) % 3, (i + 2) % 3
        out[CHORD + i, spin + following] += w[last]
        out[CHORD + i, spin + last] -= w[following]
        out[spin + following, CHORD + i] += w[last]
        out[spin + last, CHORD + i] -= w[following]
    for a in range(3):
        for b in range(3):
            value = work[5 + a, b]
            for i in range(6):
                row = i if i < 3 else spin + i - 3
                for j in range(6):
                    column = j if j < 3 else spin + j - 3
                    out[row, column] += value * work[a, row] * work[b, column]


@kernel
def coordinate_gradients(chord: Floats, axes: Floats, spin: int, out: Floats) -> None:
    """Compute (3, 9) derivatives of x, y, z by the coordinates of the beam."""
    for a in range(3):
        for i in range(9):
            out[a, i] = axes[a, i] if i < 3 else 0.0
        add_cross(axes[a], chord, 1.0, out[a], spin)


@kernel
def triad(rest: Floats, rotation: Floats, out: Floats) -> None:
    """Rotate the rest triad, whose vectors are the rows, with a node."""
    for k in range(3):
        for i in range(3):
            out[k, i] = dot(rotation[i], rest[k])


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
    bow: float,
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
        (6,) stiffness: axial EA/L, torsion GJ/L, bending about t3 of an end by its own and by the
        other rotation, the same about t2.
    bow
        L / 30, or 0 to leave out the shortening of a bent beam.
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
        stretched += bow * (2.0 * (a * a + b * b) - a * b)
        slope[k], slope[k + 2] = bow * (4.0 * a - b), bow * (4.0 * b - a)
    q[0], q[1] = section[0] * stretched, section[1] * d[1]
    for k in range(2):
        own, other = section[2 + 2 * k], section[3 + 2 * k]
        q[2 + k] = own * d[2 + k] + other * d[4 + k] + q[0] * slope[2 + k]
        q[4 + k] = other * d[2 + k] + own * d[4 + k] + q[0] * slope[4 + k]
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
    section: Floats, bow: float, tension: float, softening: float, work: Floats, tangent: Floats
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
    add_stiffness(section, bow * softening * tension, gradient, matrix)
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
def add_stiffness(section: Floats, bowing: float, gradient: Floats, matrix: Floats) -> None:
    """Add the stiffness of the deformations to the matrix; `bowing` is bow times the tension."""
    for i in range(9):
        for j in range(9):
            value = section[0] * gradient[6, i] * gradient[6, j]
            value += section[1] * gradient[1, i] * gradient[1, j]
            for k in range(2):
                a, b = gradient[2 + k], gradient[4 + k]
                own, other = section[2 + 2 * k] + 4.0 * bowing, section[3 + 2 * k] - bowing
                value += own * (a[i] * a[j] + b[i] * b[j]) + other * (a[i] * b[j] + b[i] * a[j])
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
