"""Motion of the output: travel, gain, off-axis motion, rotation, efficiency."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics.frames.analysis import orientation
from bellcrank.mechanics.frames.quantities.definition import (
    Measures,
    Quantity,
    Slopes,
    Weights,
    linear,
    quantities,
    ratio,
)
from bellcrank.mechanics.output import motion_weights, off_axis_of, rotation_of, turned_positions
from bellcrank.model.stroke_ranges import share_at

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics.frames.equilibria import Equilibrium
    from bellcrank.mechanics.kernels.arrays import Floats
    from bellcrank.model import Problem

    Values = NDArray[np.float64]


def output_weights(problem: Problem) -> Weights:
    """Return the weights of `bellcrank.mechanics.output.motion_weights`, 1 + d rows."""
    return Weights(problem.output.nodes, motion_weights(problem))


def along_weights(problem: Problem) -> Weights:
    """Return the weights of the mean displacement of the output along the wanted direction."""
    return Weights(problem.output.nodes, motion_weights(problem)[:1])


def input_weights(problem: Problem) -> Weights:
    """Return the weights of the mean displacement of the input along its direction."""
    given = problem.input
    return Weights(given.nodes, given.direction[None] / len(given.nodes))


def _along_and_input(problem: Problem) -> Weights:
    """Return the weights of the mean displacements of output and input, two rows."""
    both = along_weights(problem), input_weights(problem)
    first, second = (len(each.nodes) for each in both)
    values = np.zeros((2, first + second, problem.lattice.dimension))
    values[0, :first], values[1, first:] = both[0].values[0], both[1].values[0]
    return Weights(np.concatenate([each.nodes for each in both]), values)


def _gain(means: Values) -> Values:
    return ratio(means[..., 0], means[..., 1])


def _gain_gradient(means: Floats) -> Floats:
    return np.array([1.0 / means[1], -means[0] / means[1] ** 2])


def _off_axis_gradient(means: Floats) -> Floats:
    """Return the derivative of the size of the normal motion over that along the direction."""
    along, size = means[0], np.linalg.norm(means[1:])
    slope = np.zeros_like(means)
    slope[0] = -size / (along * abs(along))
    if size > 0.0:
        slope[1:] = means[1:] / (size * abs(along))
    return slope


quantities.register("travel")(Quantity(*linear(along_weights)))
quantities.register("gain")(
    Quantity(*linear(_along_and_input), combine=_gain, gradient=_gain_gradient)
)
quantities.register("off_axis")(
    Quantity(*linear(output_weights), combine=off_axis_of, gradient=_off_axis_gradient)
)


BASES: dict[int, Values] = {
    2: np.array([[[1.0, 0.0], [0.0, 1.0]], [[0.0, -1.0], [1.0, 0.0]]]),
    3: np.eye(9).reshape(9, 3, 3),
}
"""Matrices (k, d, d) by dimension; products of a rotation with them are its measures: in the plane
cosine and sine, in space the components of the matrix."""


def _generators(dimension: int) -> Values:
    """Return (s, d, d) the derivatives of a rotation by spins about the axes."""
    if dimension == 2:
        return BASES[2][1:]
    axes = np.eye(3)
    crossed: Values = np.cross(axes[:, None], axes).transpose(0, 2, 1)
    return crossed


def _rotation_measures(equilibrium: Equilibrium) -> Measures:
    """Measure the sum of products of the positions of output nodes after and before.

    For a single output node, its orientation.
    """
    lattice, nodes = equilibrium.problem.lattice, equilibrium.problem.output.nodes
    if len(nodes) == 1:
        matrix = orientation(equilibrium.state, nodes[0])
    else:
        displacement = equilibrium.state.u[nodes, : lattice.dimension]
        matrix = turned_positions(lattice.positions[nodes], displacement)
    basis = BASES[lattice.dimension]
    return Measures(basis.reshape(len(basis), -1) @ matrix.ravel())


def _rotation_slopes(equilibrium: Equilibrium, _measures: Measures) -> Slopes:
    lattice, nodes = equilibrium.problem.lattice, equilibrium.problem.output.nodes
    dimension = lattice.dimension
    basis = BASES[dimension]
    fields = equilibrium.fields(len(basis))
    if len(nodes) == 1:
        turned = _generators(dimension) @ orientation(equilibrium.state, nodes[0])
        fields[:, nodes[0], dimension:] = np.einsum("kij,sij->ks", basis, turned)
    else:
        before = lattice.positions[nodes] - lattice.positions[nodes].mean(axis=0)
        fields[:, nodes, :dimension] = np.einsum("kij,nj->kni", basis, before)
    return Slopes(fields)


def _angle(measures: Values) -> Values:
    """Return the angle in the plane, the size of the rotation vector in space, degrees."""
    if measures.shape[-1] == 2:
        return np.asarray(np.degrees(np.arctan2(measures[..., 1], measures[..., 0])))
    turn = rotation_of(measures.reshape(*measures.shape[:-1], 3, 3))
    return np.asarray(np.linalg.norm(turn, axis=-1))


def rotation_vector(equilibrium: Equilibrium) -> Values:
    """Return (3,) the rotation vector of the output in space, degrees."""
    return rotation_of(_rotation_measures(equilibrium).value.reshape(3, 3))


def _angle_gradient(measures: Floats) -> Floats:
    """Return the derivative of the angle.

    In space, with H = P R the sum of products, R the rotation and n its axis, it is that of n.w
    for a spin w with (tr P - P) w = v, where v is the vector of dH R' - R dH'.
    """
    if len(measures) == 2:
        return np.degrees(np.array([-measures[1], measures[0]]) / (measures @ measures))
    from scipy.spatial.transform import Rotation

    matrix = measures.reshape(3, 3)
    turn = Rotation.from_rotvec(rotation_of(matrix), degrees=True)
    angle = turn.magnitude()
    if angle == 0.0:
        return np.zeros(9)
    stretch = matrix @ turn.as_matrix().T
    resistance = np.trace(stretch) * np.eye(3) - 0.5 * (stretch + stretch.T)
    spin = np.linalg.pinv(resistance, hermitian=True) @ (turn.as_rotvec() / angle)
    slope = np.einsum("s,sij->ij", spin, _generators(3)) @ turn.as_matrix()
    return np.asarray(np.degrees(slope).ravel())


quantities.register("rotation")(
    Quantity(_rotation_measures, _rotation_slopes, combine=_angle, gradient=_angle_gradient)
)


def _load_share(equilibrium: Equilibrium) -> float:
    """Return the part of the input, by which a constant denominator is multiplied.

    nan before the input begins to grow.
    """
    share = float(share_at(equilibrium.problem.input.ranges, equilibrium.fraction).mean())
    if share == 0.0:
        return math.nan
    return 1.0 if math.isnan(equilibrium.frame.denominator) else share


def _efficiency(equilibrium: Equilibrium) -> Measures:
    from bellcrank.mechanics.frames.kernels.flips import efficiency_at

    efficiency = efficiency_at(equilibrium.frame, equilibrium.state.u)
    return Measures(np.array([efficiency / _load_share(equilibrium)]))


def _efficiency_slopes(equilibrium: Equilibrium, _measures: Measures) -> Slopes:
    from bellcrank.mechanics.frames.kernels.flips import efficiency_gradient

    fields = equilibrium.fields(1)
    efficiency_gradient(equilibrium.frame, equilibrium.state.u, fields[0])
    return Slopes(fields / _load_share(equilibrium))


quantities.register("efficiency")(Quantity(_efficiency, _efficiency_slopes))
