"""Largest strain of the beams."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics.frames.analysis import deformations, fibre_strain, stress_resultants
from bellcrank.mechanics.frames.beams import reshaped
from bellcrank.mechanics.frames.equilibria import moved_state
from bellcrank.mechanics.frames.quantities.definition import (
    Measures,
    Quantity,
    Slopes,
    quantities,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics.frames.equilibria import Equilibrium
    from bellcrank.mechanics.kernels.arrays import Floats, Ints

    Values = NDArray[np.float64]

MOST_STRAINED = 8
"""Number of most strained beams whose strains are predicted; flips may strain another one most."""
MOTION_STEP = 1e-5
"""Motion of an end in the central difference of the deformations of a beam."""
RELATIVE_STEP = 1e-6
"""Change in the central difference of a strain, as a part of the deformations."""
SHAPE_STEP = 1e-5
"""Change of a width or a length in the central difference of a strain, as a part of the width."""


def strain_of(equilibrium: Equilibrium, beams: Ints, deformation: Floats) -> Floats:
    """Return (m,) the largest principal strain in beams with given deformations."""
    resultants = stress_resultants(equilibrium.frame, beams, deformation)
    return fibre_strain(equilibrium.frame, equilibrium.problem, beams, resultants)


def _most_strained(equilibrium: Equilibrium) -> Measures:
    """Measure the strains of the most strained beams, in descending order."""
    beams = np.flatnonzero(equilibrium.structure.present)
    deformation = deformations(equilibrium.frame, beams, *equilibrium.ends(beams))
    strain = strain_of(equilibrium, beams, deformation)
    chosen = np.argsort(-strain, kind="stable")[:MOST_STRAINED]
    return Measures(strain[chosen], beams=beams[chosen])


def _strain_slopes(equilibrium: Equilibrium, measures: Measures) -> Slopes:
    """Return derivatives by central differences, first by the deformations of each beam."""
    frame, beams = equilibrium.frame, measures.beams
    assert beams is not None
    count, size = len(beams), len(frame.unit)
    fields = equilibrium.fields(count)
    # Each unknown of the two ends in turn, moved forward and back.
    moves = MOTION_STEP * np.eye(2 * size).reshape(2 * size, 2, size)
    moves = np.repeat(np.concatenate([moves, -moves]), count, axis=0)
    ends = equilibrium.ends(np.tile(beams, 4 * size))
    moved = [moved_state(state, moves[:, end]) for end, state in enumerate(ends)]
    found = deformations(frame, np.tile(beams, 4 * size), *moved)
    ahead, behind = found.reshape(2, 2 * size, count, found.shape[1])
    rates = (ahead - behind) / (2.0 * MOTION_STEP)
    deformation = deformations(frame, beams, *equilibrium.ends(beams))
    slope = _slope_by_deformation(equilibrium, beams, deformation)
    by_ends = np.einsum("akd,kd->ka", rates, slope).reshape(count, 2, size)
    fields[np.arange(count)[:, None], frame.beams[beams]] = by_ends
    return Slopes(fields)


def _slope_by_deformation(equilibrium: Equilibrium, beams: Ints, deformation: Floats) -> Floats:
    """Return (m, 3) or (m, 6) the derivatives of strains by the deformations."""
    count, width = deformation.shape
    step = RELATIVE_STEP * np.abs(deformation).max(axis=1, initial=1e-300)
    changes = np.eye(width)[:, None] * step[:, None]
    varied = deformation + np.concatenate([changes, -changes])
    strains = strain_of(equilibrium, np.tile(beams, 2 * width), varied.reshape(-1, width))
    ahead, behind = strains.reshape(2, width, count)
    slope: Floats = ((ahead - behind) / (2.0 * step)).T
    return slope


def strain_by_geometry(equilibrium: Equilibrium, beams: Ints) -> tuple[Floats, Floats, Floats]:
    """Return the derivatives of the strains of beams by their shape, at fixed motions of the ends.

    By central differences.

    Returns
    -------
    by_chord : (m, d)
        By the vector from the first to the second end at rest.
    by_width : (m,)
    by_joint : (m, 2)
    """
    frame, dimension = equilibrium.frame, equilibrium.problem.lattice.dimension
    count = len(beams)
    parameters = [0, *range(1, 1 + dimension), 4, 5]
    changes = np.zeros((len(parameters), 2, count, 6))
    for row, column in enumerate(parameters):
        changes[row, 0, :, column] = SHAPE_STEP * frame.width[beams]
        changes[row, 1] = -changes[row, 0]
    flat = changes.reshape(-1, 6)
    many = np.tile(beams, 2 * len(parameters))
    chord = frame.rest[many, 0].copy()
    chord[:, :dimension] += flat[:, 1 : 1 + dimension]
    varied = reshaped(
        equilibrium.problem, frame, many, chord, frame.width[many] + flat[:, 0],
        frame.rigid[many] + flat[:, 4:],
    )  # fmt: skip
    local = np.arange(len(many))
    deformation = deformations(varied, local, *equilibrium.ends(many))
    resultants = stress_resultants(varied, local, deformation)
    strains = fibre_strain(varied, equilibrium.problem, local, resultants)
    ahead, behind = np.moveaxis(strains.reshape(len(parameters), 2, count), 1, 0)
    slope = (ahead - behind) / (2.0 * SHAPE_STEP * frame.width[beams])
    return np.ascontiguousarray(slope[1:-2].T), slope[0], np.ascontiguousarray(slope[-2:].T)


def _largest(strains: Values) -> Values:
    largest: Values = strains.max(axis=-1, initial=0.0)
    return largest


def _largest_gradient(strains: Floats) -> Floats:
    """Return 1 for the most strained beam: the first one."""
    slope = np.zeros_like(strains)
    slope[:1] = 1.0
    return slope


def _after_flips(
    equilibrium: Equilibrium, measures: Measures, beams: Ints, forces: Values, predicted: Values
) -> Values:
    """Leave out removed beams, and add the strain of added ones, from the forces on their ends."""
    remaining = np.where(beams[:, None] == measures.beams, 0.0, predicted)
    added = (equilibrium.structure.present[beams] == 0) & forces.any(axis=1)
    own = np.zeros(len(beams))
    own[added] = _strain_by_forces(equilibrium, beams[added], forces[added])
    return np.column_stack([remaining, own])


def _strain_by_forces(equilibrium: Equilibrium, beams: Ints, forces: Values) -> Floats:
    """Return (m,) the strain of beams with given forces (m, 2 b) on their ends."""
    frame, dimension = equilibrium.frame, equilibrium.problem.lattice.dimension
    size = len(frame.unit)
    start, end = equilibrium.ends(beams)
    chord = (frame.rest[beams, 0] + end.u - start.u)[:, :dimension]
    along = chord / np.linalg.norm(chord, axis=1)[:, None]
    axial = (forces[:, size : size + dimension] * along).sum(axis=1)
    moments = forces[:, dimension:size], forces[:, size + dimension :]
    if dimension == 2:
        resultants = np.column_stack([axial, *moments])
    else:
        torque = (moments[1] * along).sum(axis=1)
        # A round section: only the size of the bending moment of each end matters.
        bending = [np.linalg.norm(np.cross(moment, along), axis=1) for moment in moments]
        nothing = np.zeros_like(axial)
        resultants = np.column_stack([axial, torque, bending[0], nothing, bending[1], nothing])
    return fibre_strain(frame, equilibrium.problem, beams, resultants)


quantities.register("strain")(
    Quantity(
        _most_strained, _strain_slopes, combine=_largest, gradient=_largest_gradient,
        after_flips=_after_flips,
    )
)  # fmt: skip
