"""Static condensation of a structure to motions of its boundary nodes.

With K the tangent stiffness, g the gradient of the energy, and the free nodes split into boundary
nodes (p) and the interior (i), a motion m of the boundary moves the interior by

    w = -K_ii^-1 K_ip m,    and the interior relaxes by    d = -K_ii^-1 g_i.

For responses r = (m, w) the condensed stiffness is r_a.K m_b and the condensed force r_a.g
(Guyan, AIAA J. 3, 380, 1965), the latter to first order off equilibrium.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.mechanics.kernels._compile import entry, kernel
from bellcrank.mechanics.kernels.arrays import (
    ACTIVE,
    HELD_X,
    HELD_Y,
    Bytes,
    Floats,
    Scratch,
    Structure,
    System,
)
from bellcrank.mechanics.kernels.cholesky import factorise, solve
from bellcrank.mechanics.kernels.energy import (
    elastic_energy,
    find_gradient,
    find_stiffness,
    hold_coordinates,
    measure_held_beams,
)
from bellcrank.mechanics.kernels.fields import copy, dot
from bellcrank.mechanics.kernels.newton import find_tension, predict_tension
from bellcrank.mechanics.kernels.tangents import SWEEPS

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@entry
def energy_at(system: System, structure: Structure, u: Floats, scratch: Scratch) -> float:
    """As `elastic_energy`, for calls from Python."""
    return elastic_energy(system, structure, u, scratch)


@entry
def tension_after(system: System, structure: Structure, step: Floats, scratch: Scratch) -> None:
    """As `predict_tension`, for a step (n, 2) by elimination index."""
    for block in range(len(step)):
        scratch.step[block, 0] = step[block, 0]
        scratch.step[block, 1] = step[block, 1]
    predict_tension(system, structure, 1.0, scratch)


@kernel
def multiply(structure: Structure, motion: Floats, product: Floats, scratch: Scratch) -> None:
    """Fill `product` (n, 2) with the assembled stiffness times `motion`."""
    diagonal, off_diagonal = scratch.diagonal, scratch.off_diagonal
    for column in range(len(diagonal)):
        x, y = motion[column, 0], motion[column, 1]
        product[column, 0] = diagonal[column, 0] * x + diagonal[column, 1] * y
        product[column, 1] = diagonal[column, 1] * x + diagonal[column, 3] * y
    for column in range(len(diagonal)):
        x, y = motion[column, 0], motion[column, 1]
        for t in range(structure.column_start[column], structure.column_start[column + 1]):
            row = structure.row[t]
            xx, xy, yx, yy = (
                off_diagonal[t, 0],
                off_diagonal[t, 1],
                off_diagonal[t, 2],
                off_diagonal[t, 3],
            )
            product[row, 0] += xx * x + xy * y
            product[row, 1] += yx * x + yy * y
            product[column, 0] += xx * motion[row, 0] + yx * motion[row, 1]
            product[column, 1] += xy * motion[row, 0] + yy * motion[row, 1]


@kernel
def interior_step(system: System, structure: Structure, boundary: Bytes, scratch: Scratch) -> None:
    """Solve for the interior under the forces in `scratch.step`; others are cleared."""
    step = scratch.step
    for node in range(len(boundary)):
        block = system.block[node]
        if block >= 0:
            moves = structure.active[node] == ACTIVE
            if not moves or boundary[node] & HELD_X:
                step[block, 0] = 0.0
            if not moves or boundary[node] & HELD_Y:
                step[block, 1] = 0.0
    solve(structure, scratch)


@kernel
def interior_stiffness(
    system: System, structure: Structure, boundary: Bytes, mode: Floats, scratch: Scratch
) -> float:
    """Estimate the lowest eigenvalue of the interior's factorised stiffness.

    By inverse iteration; `mode` (n, 2) holds the current approximation of the eigenvector.
    """
    step = scratch.step
    lowest = math.inf
    for _ in range(SWEEPS):
        size = math.sqrt(dot(mode, mode))
        for block in range(len(step)):
            step[block, 0] = mode[block, 0] / size
            step[block, 1] = mode[block, 1] / size
        interior_step(system, structure, boundary, scratch)
        copy(step, mode)
        size = math.sqrt(dot(mode, mode))
        if size == 0.0:
            for block in range(len(step)):
                mode[block, 0] = mode[block, 1] = 1.0
            return math.inf
        lowest = 1.0 / size
    return lowest


@entry
def condense(
    system: System,
    structure: Structure,
    boundary: Bytes,
    u: Floats,
    softening: float,
    predicted: bool,
    motions: NDArray[np.float64],
    forcing: NDArray[np.float64],
    responses: NDArray[np.float64],
    mode: Floats,
    scratch: Scratch,
) -> float:
    """Condense the stiffness at `u` to motions of the boundary nodes.

    Leaves the gradient by node in `scratch.gradient` and the step d of the interior in
    `scratch.step`. Returns the lowest stiffness of the interior while the boundary nodes are held,
    infinite if there is no interior; -1 if it is not stable.

    Parameters
    ----------
    system
        With free boundary nodes.
    boundary
        (N,) bits HELD_X, HELD_Y of supports and boundary nodes.
    softening
        As in `find_stiffness`.
    predicted
        Use the tension predicted by `tension_after` instead of that at `u`.
    motions
        (m, n, 2) motions of the boundary nodes, by elimination index.
    forcing, responses
        (m, n, 2) filled: the stiffness times each motion, and the motion with the interior's.
    mode
        (n, 2) approximate softest motion of the interior; improved.
    """
    measure_held_beams(system, structure, u, scratch)
    find_gradient(system, structure, 0.0, u, scratch)
    if not predicted:
        find_tension(system, structure, scratch)
    find_stiffness(system, structure, softening, scratch)
    for number in range(len(motions)):
        multiply(structure, motions[number], forcing[number], scratch)
    hold_coordinates(system, boundary, structure, scratch)
    if not factorise(structure, scratch):
        return -1.0
    lowest = interior_stiffness(system, structure, boundary, mode, scratch)
    step = scratch.step
    for number in range(len(motions)):
        for block in range(len(step)):
            step[block, 0] = -forcing[number, block, 0]
            step[block, 1] = -forcing[number, block, 1]
        interior_step(system, structure, boundary, scratch)
        for block in range(len(step)):
            responses[number, block, 0] = motions[number, block, 0] + step[block, 0]
            responses[number, block, 1] = motions[number, block, 1] + step[block, 1]
    for node in range(len(boundary)):
        block = system.block[node]
        if block >= 0:
            step[block, 0] = -scratch.gradient[node, 0]
            step[block, 1] = -scratch.gradient[node, 1]
    interior_step(system, structure, boundary, scratch)
    return lowest
