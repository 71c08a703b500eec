"""Angles of a beam in space and their derivatives; see `space` for the notation."""

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
