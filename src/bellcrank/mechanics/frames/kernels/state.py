"""Configurations of the nodes, and motions from one to another.

A motion is a field (N, b): the displacement of each node and its rotation, in space the rotation
vector w of R -> exp(w) R. Since rotations are composed and not added, no result depends on the
orientation of the model.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.mechanics.kernels._compile import kernel

if TYPE_CHECKING:
    from bellcrank.mechanics.frames.kernels.arrays import Frame, State
    from bellcrank.mechanics.kernels.arrays import Floats


@kernel
def set_to_rest(state: State) -> None:
    """Set all nodes to their state at rest."""
    u, q = state.u, state.q
    for node in range(len(u)):
        for axis in range(3):
            u[node, axis] = 0.0
    for node in range(len(q)):
        q[node, 0] = 1.0
        for axis in range(1, 4):
            q[node, axis] = 0.0


@kernel
def copy_state(source: State, target: State) -> None:
    """Copy one state onto another."""
    for node in range(len(source.u)):
        for axis in range(3):
            target.u[node, axis] = source.u[node, axis]
    for node in range(len(source.q)):
        for axis in range(4):
            target.q[node, axis] = source.q[node, axis]


@kernel
def point_state(frame: Frame, points: State, index: int) -> tuple[Floats, Floats]:
    """Return the arrays of one of several states that lie one after the other."""
    nodes, turned = len(frame.positions), len(points.q) // (len(points.u) // len(frame.positions))
    return (
        points.u[index * nodes : (index + 1) * nodes],
        points.q[index * turned : (index + 1) * turned],
    )


@kernel
def rotate(q: Floats, node: int, x: float, y: float, z: float) -> None:
    """Rotate the orientation of a node by the rotation vector (x, y, z), and normalise it."""
    square = 0.25 * (x * x + y * y + z * z)
    if square < 1e-4:
        # sin(a) / (2 a) and cos(a) of the half angle a, to order 8.
        factor = 0.5 * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0)))
        w = 1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0))
    else:
        half = math.sqrt(square)
        factor = 0.5 * math.sin(half) / half
        w = math.cos(half)
    x, y, z = factor * x, factor * y, factor * z
    a, b, c, d = q[node, 0], q[node, 1], q[node, 2], q[node, 3]
    e = w * a - x * b - y * c - z * d
    f = w * b + x * a + y * d - z * c
    g = w * c + y * a + z * b - x * d
    h = w * d + z * a + x * c - y * b
    size = 1.0 / math.sqrt(e * e + f * f + g * g + h * h)
    q[node, 0], q[node, 1], q[node, 2], q[node, 3] = e * size, f * size, g * size, h * size


@kernel
def matrix_of(q: Floats, node: int, out: Floats) -> None:
    """Compute the (3, 3) rotation matrix of a node."""
    a, b, c, d = q[node, 0], q[node, 1], q[node, 2], q[node, 3]
    out[0, 0] = 1.0 - 2.0 * (c * c + d * d)
    out[0, 1] = 2.0 * (b * c - a * d)
    out[0, 2] = 2.0 * (b * d + a * c)
    out[1, 0] = 2.0 * (b * c + a * d)
    out[1, 1] = 1.0 - 2.0 * (b * b + d * d)
    out[1, 2] = 2.0 * (c * d - a * b)
    out[2, 0] = 2.0 * (b * d - a * c)
    out[2, 1] = 2.0 * (c * d + a * b)
    out[2, 2] = 1.0 - 2.0 * (b * b + c * c)


@kernel
def move_node(state: State, node: int, scale: float, motion: Floats) -> None:
    """Move one node by `scale` times its row (b,) of a field."""
    for axis in range(3):
        state.u[node, axis] += scale * motion[axis]
    if len(state.q):
        rotate(state.q, node, scale * motion[3], scale * motion[4], scale * motion[5])


@kernel
def move(state: State, scale: float, motion: Floats) -> None:
    """Move all nodes by `scale` times a field."""
    for node in range(len(state.u)):
        move_node(state, node, scale, motion[node])


@kernel
def node_difference(start: State, end: State, node: int, out: Floats) -> None:
    """Compute the motion (b,) that leads one node from a state to another."""
    for axis in range(3):
        out[axis] = end.u[node, axis] - start.u[node, axis]
    if len(start.q):
        p, q = start.q[node], end.q[node]
        w = p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3]
        x = -q[0] * p[1] + q[1] * p[0] - q[2] * p[3] + q[3] * p[2]
        y = -q[0] * p[2] + q[2] * p[0] - q[3] * p[1] + q[1] * p[3]
        z = -q[0] * p[3] + q[3] * p[0] - q[1] * p[2] + q[2] * p[1]
        if w < 0.0:
            w, x, y, z = -w, -x, -y, -z
        sine = math.sqrt(x * x + y * y + z * z)
        factor = 2.0 if sine < 1e-9 else 2.0 * math.atan2(sine, w) / sine
        out[3], out[4], out[5] = factor * x, factor * y, factor * z


@kernel
def difference(start: State, end: State, out: Floats) -> None:
    """Compute the motion (N, b) that leads from one state to another."""
    for node in range(len(start.u)):
        node_difference(start, end, node, out[node])


@kernel
def force_share(frame: Frame, group: int, fraction: float) -> float:
    """Return the part of the full forces of a group that acts at a load."""
    begin, end = frame.load_range[group, 0], frame.load_range[group, 1]
    return min(1.0, max(0.0, (fraction - begin) / (end - begin)))


@kernel
def force_rate(frame: Frame, group: int, within: float) -> float:
    """Return the derivative of `force_share` by the load; `within` is between two kinks."""
    begin, end = frame.load_range[group, 0], frame.load_range[group, 1]
    return 1.0 / (end - begin) if begin < within < end else 0.0


@kernel
def drive_share(frame: Frame, node: int, fraction: float) -> float:
    """Return the part of its full motion that a node of the drive has at a load."""
    if not frame.has_ramps:
        return fraction
    begin, end = frame.ramp[node, 0], frame.ramp[node, 1]
    return min(1.0, max(0.0, (fraction - begin) / (end - begin)))


@kernel
def drive_rate(frame: Frame, node: int, within: float) -> float:
    """Return the derivative of `drive_share` by the load; `within` is between two kinks."""
    if not frame.has_ramps:
        return 1.0
    begin, end = frame.ramp[node, 0], frame.ramp[node, 1]
    return 1.0 / (end - begin) if begin < within < end else 0.0


@kernel
def is_kink(frame: Frame, load: float) -> bool:
    """Whether a range of the drive or of forces begins or ends at a load."""
    found = False
    for kink in frame.kinks:
        found |= kink == load
    return found


@kernel
def move_held_nodes(frame: Frame, fraction: float, state: State) -> None:
    """Set held unknowns to the values that supports and drive prescribe at a load.

    The rotation of a node in space is prescribed as a whole.
    """
    held, drive = frame.held, frame.drive
    for node in range(len(held)):
        share = drive_share(frame, node, fraction)
        for axis in range(3):
            if held[node, axis]:
                state.u[node, axis] = share * drive[node, axis]
        if len(state.q) and held[node, 3]:
            state.q[node, 0] = 1.0
            for axis in range(1, 4):
                state.q[node, axis] = 0.0
            rotate(
                state.q, node, share * drive[node, 3], share * drive[node, 4],
                share * drive[node, 5],
            )  # fmt: skip
