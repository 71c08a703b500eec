"""Forces and stiffness: input force, output stiffness, blocked force, sag under own weight."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics.frames.analysis import input_forces
from bellcrank.mechanics.frames.quantities.definition import (
    Measures,
    Quantity,
    Slopes,
    Weights,
    linear,
    quantities,
)
from bellcrank.mechanics.frames.quantities.motion import along_weights
from bellcrank.model.stroke_ranges import share_at

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics.frames.equilibria import Equilibrium
    from bellcrank.mechanics.kernels.arrays import Floats
    from bellcrank.model import Problem

    Values = NDArray[np.float64]

STEP = 1e-5
"""Largest motion of a node in the central difference of the stiffness."""


def _input_force(equilibrium: Equilibrium) -> Measures:
    along = (input_forces(equilibrium) * equilibrium.problem.input.direction).sum()
    return Measures(np.array([along]))


def _input_force_slopes(equilibrium: Equilibrium, _measures: Measures) -> Slopes:
    """Return the stiffness times the unit motion of the input; a given force is constant."""
    given, unit = equilibrium.problem.input, equilibrium.fields(1)
    if given.drive == "force":
        return Slopes(unit)
    unit[0, given.nodes, : given.direction.shape[1]] = given.direction
    return Slopes(equilibrium.forces_of(unit[0])[None], on_held=-unit)


quantities.register("input_force")(Quantity(_input_force, _input_force_slopes))


def _unit_force(equilibrium: Equilibrium) -> Floats:
    """Return (N, b) a unit force on the output along the wanted direction.

    It is shared equally by the output nodes that the structure holds.
    """
    output, force = equilibrium.problem.output, np.asarray(equilibrium.fields(1)[0])
    held = equilibrium.structure.active[output.nodes] != 0
    if held.any():
        force[output.nodes[held], : output.direction.shape[1]] = output.direction[held] / held.sum()
    return force


def _compliance(equilibrium: Equilibrium) -> Measures:
    """Measure the motion of the output by a unit force; infinite where nothing holds it."""
    force = _unit_force(equilibrium)
    motion = equilibrium.solve(force) if force.any() else None
    if motion is None:
        return Measures(np.array([math.inf]))
    return Measures(np.array([(motion * force).sum()]), motion)


def _compliance_slopes(equilibrium: Equilibrium, measures: Measures) -> Slopes:
    """Return the derivatives of w.z, where K z = w is the unit force.

    By the unknowns, -z.K'z with K' the derivative of the stiffness: the central difference of K z
    along z. Its error is of the order of 1e-10.
    """
    motion = measures.motion
    if motion is None:
        return Slopes(equilibrium.fields(1))
    step = STEP / np.abs(motion).max()
    ahead, behind = (
        equilibrium.moved(sign * step * motion).forces_of(motion) for sign in (1.0, -1.0)
    )
    slope = (behind - ahead) / (2.0 * step)
    return Slopes(slope[None], by_motion=_unit_force(equilibrium)[None])


SWEEPS = 12
"""Number of steps of inverse iteration for the softest mode."""


def _lowest_stiffness(equilibrium: Equilibrium) -> Measures:
    """Measure the lowest eigenvalue of the stiffness; its mode has the size 1."""
    from bellcrank.mechanics.frames.kernels.response import find_softest_mode

    mode = np.array(np.random.default_rng(0).normal(size=equilibrium.fields(1)[0].shape))
    lowest = find_softest_mode(
        equilibrium.frame, equilibrium.structure, equilibrium.fraction, equilibrium.state, SWEEPS,
        mode, equilibrium.memory,
    )  # fmt: skip
    if lowest <= 0.0:
        return Measures(np.array([0.0]))
    return Measures(np.array([lowest]), mode / np.linalg.norm(mode))


def _lowest_stiffness_slopes(equilibrium: Equilibrium, measures: Measures) -> Slopes:
    """Return the derivatives of z.K z at a fixed mode z, by central differences as above."""
    mode = measures.motion
    if mode is None:
        return Slopes(equilibrium.fields(1))
    step = STEP / np.abs(mode).max()
    ahead, behind = (equilibrium.moved(sign * step * mode).forces_of(mode) for sign in (1.0, -1.0))
    free = equilibrium.forces_of(mode) * (equilibrium.frame.held == 0)
    return Slopes(((ahead - behind) / (2.0 * step))[None], by_motion=-free[None])


LOWEST_STIFFNESS = Quantity(_lowest_stiffness, _lowest_stiffness_slopes)
"""Lowest eigenvalue of the stiffness: how far an equilibrium is from a loss of stability."""


def _inverse(compliance: Values) -> Values:
    """Return the stiffness; 0 where nothing holds the output, or not stably."""
    (value,) = np.moveaxis(compliance, -1, 0)
    return np.asarray(np.divide(1.0, value, out=np.zeros(value.shape), where=value > 0.0))


def _inverse_gradient(compliance: Floats) -> Floats:
    return -1.0 / compliance**2


quantities.register("output_stiffness")(
    Quantity(_compliance, _compliance_slopes, combine=_inverse, gradient=_inverse_gradient)
)


def _stop_weights(problem: Problem) -> Weights:
    """Return the weights of the forces of the output on the springs that hold it."""
    output, along = problem.output, along_weights(problem)
    assert output.spring is not None
    return Weights(along.nodes, output.spring * len(output.nodes) * along.values)


quantities.register("blocked_force")(Quantity(*linear(_stop_weights), load="held output"))


def mean_weights(problem: Problem) -> Weights:
    """Return the weights of the mean displacement of the output nodes, d rows."""
    nodes, dimension = problem.output.nodes, problem.lattice.dimension
    rows = np.eye(dimension)[:, None] / len(nodes)
    return Weights(nodes, np.broadcast_to(rows, (dimension, len(nodes), dimension)))


def _sag(equilibrium: Equilibrium) -> Measures:
    """Measure the linear motion of the output by the own weight alone."""
    frame = equilibrium.frame
    load = np.tensordot(share_at(frame.load_range, equilibrium.fraction), frame.load, axes=1)
    motion = equilibrium.solve(-equilibrium.residual() - load)
    if motion is None:
        return Measures(np.full(equilibrium.problem.lattice.dimension, math.nan))
    return Measures(mean_weights(equilibrium.problem).sums(motion), motion)


def _sag_slopes(equilibrium: Equilibrium, measures: Measures) -> Slopes:
    fields = mean_weights(equilibrium.problem).fields(equilibrium)
    return Slopes(fields, by_motion=None if measures.motion is None else fields)


def _size(vectors: Values) -> Values:
    size: Values = np.linalg.norm(vectors, axis=-1)
    return size


def _size_gradient(vector: Floats) -> Floats:
    return vector / max(float(np.linalg.norm(vector)), 1e-300)


quantities.register("sag")(
    Quantity(_sag, _sag_slopes, combine=_size, gradient=_size_gradient, load="weight")
)
