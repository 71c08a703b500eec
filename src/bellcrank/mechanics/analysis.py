"""Quantities of a design besides its efficiency: loaded beams, strain energy, output stiffness."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bellcrank.mechanics.kernels.arrays import PRUNE_ALL, PRUNE_DEAD_ENDS
from bellcrank.mechanics.objectives import objective_of
from bellcrank.mechanics.system import allocate_structure, build_system

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics.kernels.arrays import Scratch, Structure, System
    from bellcrank.model import Problem


class ComputedResponse(Protocol):
    """A `bellcrank.mechanics.SpringEvaluator` with the response that it computed last."""

    system: System
    structure: Structure
    scratch: Scratch
    displacement: NDArray[np.float64]
    core: int

    def inverse_blocks(
        self, rows: NDArray[np.int64], columns: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Return blocks of the inverse stiffness of the last flip prediction."""


@dataclass(frozen=True, slots=True, eq=False)
class Strain:
    """Strain energy of the beams of a design at an equilibrium.

    Parameters
    ----------
    energy : (M,) float64
        Energy of each beam; in the spring model its own, and half of that of each angular spring
        it belongs to.
    input_forces : (i, d) float64
        External force on each input node.
    input_force
        Sum of the forces on the input nodes, each along its direction.
    """

    energy: NDArray[np.float64]
    input_forces: NDArray[np.float64]
    input_force: float


class Core:
    """Load-bearing core of designs, without their response.

    Parameters
    ----------
    evaluator
        Its response computed last does not change.
    core
        `PRUNE_DEAD_ENDS`, or `PRUNE_ALL` to leave out all unloaded beams. By default that of the
        evaluator; dead ends if that keeps them.

    Examples
    --------
    >>> from bellcrank.mechanics import SpringEvaluator
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> int(Core(SpringEvaluator(crane)).of(crane.initial).sum())
    352
    """

    def __init__(self, evaluator: ComputedResponse, core: int | None = None) -> None:
        self._system = evaluator.system
        chosen = evaluator.core if core is None else core
        self._kind = PRUNE_ALL if chosen == PRUNE_ALL else PRUNE_DEAD_ENDS
        self._structure = allocate_structure(evaluator.system)

    def of(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return (M,) the beams of a design that are neither loose nor dead ends."""
        from bellcrank.mechanics.kernels.structure import find_core

        core = np.zeros(len(mask), np.uint8)
        find_core(self._system, mask.astype(np.uint8), self._kind, self._structure, core)
        return core.astype(bool)


def loaded_beams(problem: Problem, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return (M,) the beams on a path between two nodes that are driven, watched or held.

    All fixed supports count as one node; beams between two of them are included. Dead ends, loose
    pieces and pieces that hang by a single node are left out.

    Parameters
    ----------
    mask : (M,) bool

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> bool(loaded_beams(crane, crane.initial).all())
    True
    """
    from bellcrank.mechanics.kernels.structure import find_loaded

    system = build_system(problem, objective_of(problem, "displacement"))
    structure = allocate_structure(system)
    find_loaded(system, np.asarray(mask).astype(np.uint8), structure)
    return structure.present.astype(bool)


def strain_of(evaluator: ComputedResponse) -> Strain:
    """Compute the strain energy of the beams in the response computed last.

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
    # Movable beams and springs are at the front of their lists, the others at the back.
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
    end_force = 2.0 * system.bond * stretch[:, None] * along + torque[:, None] * across
    force = np.zeros_like(u)
    np.add.at(force, second, end_force)
    np.add.at(force, first, -end_force)
    at_input = force[system.input_nodes]
    return Strain(energy, at_input, float((at_input * system.input_direction).sum()))


def output_stiffness(evaluator: ComputedResponse) -> float:
    """Return the stiffness of the output of the design evaluated last.

    ``1 / (t' K^-1 t)``, with K the tangent stiffness at full load and t the mean of the wanted
    directions over the output nodes that the structure holds: a small force F, shared
    equally by these nodes, moves their mean by F over this stiffness. The input is held
    if it is driven by a displacement, and free if it is driven by a force; the springs of the
    output are included.

    Returns
    -------
    float
        In units of bond stiffness; 0 if the structure does not hold the output, or not stably.

    Examples
    --------
    >>> from bellcrank.mechanics import SpringEvaluator
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> evaluator = SpringEvaluator(crane)
    >>> response = evaluator.evaluate(crane.initial)
    >>> round(output_stiffness(evaluator), 3)
    5.745
    """
    from bellcrank.mechanics.kernels.adjoint import output_compliance

    compliance = output_compliance(
        evaluator.system, evaluator.structure, evaluator.displacement, evaluator.scratch
    )
    return 1.0 / compliance if compliance > 0.0 else 0.0


def predict_output_stiffness(
    evaluator: ComputedResponse, beams: NDArray[np.int64], present: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Predict the stiffness of the output after each flip, for the last flip prediction.

    A beam is taken as a spring along itself, which changes the stiffness by a matrix of rank
    one (Sherman and Morrison, Ann. Math. Stat. 21, 124, 1950). The effect of its flip on the
    angular springs and on the motion is left out. The rank correlation with the computed
    stiffness is 0.82 to 0.97.

    Parameters
    ----------
    beams : (n,) int64
        Beams to flip, one at a time.
    present : (n,) bool
        Whether each is present.

    Returns
    -------
    (n,)
        As `output_stiffness`; 0 where the output is not held.
    """
    system, active = evaluator.system, evaluator.structure.active == 1
    out = active[system.output_nodes] & (system.block[system.output_nodes] >= 0)
    if not out.any():
        return np.zeros(len(beams))
    wanted = system.output_direction[out] / out.sum()
    outputs = system.block[system.output_nodes[out]]
    everything = np.arange(int(system.block.max()) + 1)
    inverse = evaluator.inverse_blocks(everything[:, None], outputs)
    motion = np.einsum("bokl,ol->bk", inverse, wanted)
    compliance = float((motion[outputs] * wanted).sum())
    ends = system.beams[beams]
    moves = active[ends] & (system.block[ends] >= 0)
    held = system.block[ends] < 0
    position = system.positions + evaluator.displacement
    along = position[ends[:, 1]] - position[ends[:, 0]]
    along /= np.hypot(*along.T)[:, None]
    # A unit force along the beam at its ends, zero at an end that is held.
    end_force = np.stack([-along, along], axis=1) * moves[:, :, None]
    both = np.maximum(system.block[ends], 0)
    stretch = np.einsum("nek,nek->n", end_force, motion[both])
    local = evaluator.inverse_blocks(both[:, :, None], both[:, None, :])
    flexibility = np.einsum("nek,nefkl,nfl->n", end_force, local, end_force)
    spring = 2.0 * system.bond
    after = np.where(
        present,
        compliance + spring * stretch**2 / np.maximum(1.0 - spring * flexibility, 1e-6),
        compliance - spring * stretch**2 / (1.0 + spring * flexibility),
    )
    loaded = (moves | held).all(axis=1)
    return 1.0 / np.where(loaded, np.maximum(after, 1e-12), compliance)
