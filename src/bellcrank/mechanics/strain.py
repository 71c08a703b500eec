"""Which beams of a design do the work: the elastic energy of each, and the force of the input."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics.evaluator import SpringEvaluator


@dataclass(frozen=True, slots=True, eq=False)
class Strain:
    """What the beams of a design bear at an equilibrium.

    Parameters
    ----------
    energy : (M,) float64
        Of each beam: its own, and half of that of each angular spring it belongs to.
    input_force
        Of the whole input along its direction: the derivative of the energy by its motion.
    """

    energy: NDArray[np.float64]
    input_force: float


def strain_of(evaluator: SpringEvaluator) -> Strain:
    """Measure what the beams bear in the response computed last.

    Examples
    --------
    >>> from bellcrank.mechanics import SpringEvaluator
    >>> from bellcrank.model import find_problem
    >>> evaluator = SpringEvaluator(find_problem("crane"))
    >>> response = evaluator.evaluate(evaluator.problem.initial)
    >>> bool(np.isclose(strain_of(evaluator).energy.sum(), response.energy))
    True
    """
    system, structure, u = evaluator.system, evaluator.structure, evaluator.displacement
    first, second = system.beams.T
    vector = system.rest_vector + (u[second] - u[first])
    length, rest = np.hypot(*vector.T), system.rest_vector
    rotation = np.arctan2(
        rest[:, 0] * vector[:, 1] - rest[:, 1] * vector[:, 0], (rest * vector).sum(axis=1)
    )
    # Beams and springs that can move stand at the front of their lists, others at the back.
    _, front, back, springs, still = structure.sizes
    loaded = np.zeros(len(length), dtype=bool)
    loaded[structure.beam[:front]] = True
    loaded[structure.beam[back:]] = True
    stretch = np.where(loaded, length - system.rest_length, 0.0)
    energy = system.bond * stretch**2
    torque = np.zeros(len(length))
    for part in (slice(0, springs), slice(still, None)):
        a, b = structure.spring_beams[part].T
        bend, weight = rotation[b] - rotation[a], structure.spring_weight[part]
        for beam, sign in ((a, -1.0), (b, 1.0)):
            np.add.at(energy, beam, 0.5 * weight * bend**2)
            np.add.at(torque, beam, sign * 2.0 * weight * bend)
    along = vector / length[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1) / length[:, None]
    pull = 2.0 * system.bond * stretch[:, None] * along + torque[:, None] * across
    force = np.zeros_like(u)
    np.add.at(force, second, pull)
    np.add.at(force, first, -pull)
    pushed = force[system.input_nodes] * system.input_direction
    return Strain(energy, float(pushed.sum()))
