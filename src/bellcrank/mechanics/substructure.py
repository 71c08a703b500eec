"""A design cut free at some of its nodes: what those who move these nodes feel of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, get_args

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics.evaluator import UnloadedBeams
from bellcrank.mechanics.kernels.arrays import HELD
from bellcrank.mechanics.objectives import objective_of
from bellcrank.mechanics.status import Status
from bellcrank.mechanics.system import allocate_scratch, allocate_structure, build_system

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from bellcrank.model import Design

ACTIVE = 1


@dataclass(frozen=True, slots=True, eq=False)
class Condensed:
    """What the gripped nodes feel, to first order around one state.

    Parameters
    ----------
    stiffness : (m, m)
        By the motions asked for; the interior follows them.
    force : (m,)
        Work per motion of whoever holds the gripped nodes; the interior is in equilibrium
        after `settling`.
    responses : (m, N, 2)
        Displacement of all nodes per motion.
    settling : (N, 2)
        Newton step of the interior with the gripped nodes held; zero in equilibrium.
    nodal_force : (N, 2)
        Gradient of the energy.
    lowest
        Stiffness of the interior's softest motion while the gripped nodes are held, estimated;
        infinite if there is no interior.
    """

    stiffness: NDArray[np.float64]
    force: NDArray[np.float64]
    responses: NDArray[np.float64]
    settling: NDArray[np.float64]
    nodal_force: NDArray[np.float64]
    lowest: float


class Substructure:
    """A design whose gripped nodes are moved from outside, and its tangent stiffness anywhere.

    What the input of the problem cannot reach stays at rest, as in a response. Supports hold;
    the drive of the problem does not, and its output springs do not count unless asked for.

    Parameters
    ----------
    design
    gripped : (p,) int64
        Nodes that are moved; no supports among them.
    unloaded_beams
        As for an `SpringEvaluator`.
    springs
        Whether the springs on the output nodes belong to it.

    Raises
    ------
    InvalidSettings
        If a gripped node is no free node of the lattice, or a piece that the input reaches
        could move as a rigid body even while the gripped nodes are held. (A piece that hangs
        from a single one follows it without stress, and counts as not `active`.)

    Examples
    --------
    The input of the full crane, moved as a whole along its direction:

    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> nodes = crane.input.nodes
    >>> cut = Substructure(crane.full_design(), nodes)
    >>> motion = np.zeros((1, crane.lattice.node_count, 2))
    >>> motion[0, nodes] = crane.input.direction
    >>> found = cut.condense(np.zeros((crane.lattice.node_count, 2)), motion)
    >>> print(f"{found.stiffness[0, 0]:.4f}")
    9.6861
    """

    def __init__(
        self,
        design: Design,
        gripped: ArrayLike,
        unloaded_beams: UnloadedBeams = "keep",
        *,
        springs: bool = False,
    ) -> None:
        if unloaded_beams not in get_args(UnloadedBeams):
            raise InvalidSettings(
                f"unloaded_beams must be one of {', '.join(get_args(UnloadedBeams))}; "
                f"got {unloaded_beams!r}"
            )
        problem = design.problem
        self.design = design
        self.gripped = _checked(np.asarray(gripped), design)
        undriven = replace(problem, input=replace(problem.input, drive="force"))
        system = build_system(undriven, objective_of(undriven, "displacement"))
        ground = system.ground if springs else np.zeros_like(system.ground)
        self.system = system._replace(load=np.zeros_like(system.load), ground=ground)
        self.structure = allocate_structure(self.system)
        self.scratch = allocate_scratch(self.system, self.structure)
        self._held = self.system.held.copy()
        self._held[self.gripped] = HELD
        self._free = np.flatnonzero(self.system.block >= 0)
        self._order = self.system.block[self._free]
        blocks = np.arange(len(self.scratch.step))
        self._mode = np.cos(1.0 + np.stack([3.0 * blocks, 3.0 * blocks + 1.0], axis=1))
        self._find_structure(get_args(UnloadedBeams).index(unloaded_beams))

    def _find_structure(self, core: int) -> None:
        from bellcrank.mechanics.kernels.structure import find_structure

        # Pieces are judged with the gripped nodes held, and beams between them still move.
        judged = self.system._replace(held=self._held)
        mask = self.design.mask.astype(np.uint8)
        status = Status(find_structure(judged, mask, core, self.structure))
        if status is not Status.CONVERGED:
            raise InvalidSettings(
                f"{self.design.problem.name}: {status.message}, even while its ports are held"
            )
        self.active: NDArray[np.bool_] = self.structure.active == ACTIVE

    def energy(self, displacement: NDArray[np.float64]) -> float:
        """Return the elastic energy at displacements (N, 2) of the nodes."""
        from bellcrank.mechanics.kernels.condensation import energy_at

        found: float = energy_at(self.system, self.structure, displacement, self.scratch)
        return found

    def condense(
        self,
        displacement: NDArray[np.float64],
        motions: NDArray[np.float64],
        *,
        softened: bool = True,
        predicted: bool = False,
    ) -> Condensed | None:
        """Condense the tangent stiffness to motions of the gripped nodes.

        Parameters
        ----------
        displacement : (N, 2)
            Where; any state, an equilibrium or not.
        motions : (m, N, 2)
            Zero on all nodes that are not gripped, and on those that are not `active`.
        softened
            False leaves out what can make the stiffness indefinite: a safe slope far from
            equilibrium.
        predicted
            Use the tension of `predict_tension` instead of that at the displacement.

        Returns
        -------
        Condensed or None
            None if the interior is not stable while the gripped nodes are held.
        """
        from bellcrank.mechanics.kernels.condensation import condense

        count, blocks = len(motions), len(self.scratch.step)
        ordered = np.zeros((count, blocks, 2))
        ordered[:, self._order] = motions[:, self._free]
        forcing, responses = np.zeros_like(ordered), np.zeros_like(ordered)
        lowest = condense(
            self.system, self.structure, self._held, displacement, 1.0 if softened else 0.0,
            predicted, ordered, forcing, responses, self._mode, self.scratch,
        )  # fmt: skip
        if lowest < 0.0:
            return None
        whole = np.zeros((count, *displacement.shape))
        whole[:, self._free] = responses[:, self._order]
        settling = np.zeros_like(displacement)
        settling[self._free] = self.scratch.step[self._order]
        gradient = self.scratch.gradient.copy()
        stiffness = forcing.reshape(count, -1) @ responses.reshape(count, -1).T
        force = whole.reshape(count, -1) @ gradient.ravel()
        return Condensed(stiffness, force, whole, settling, gradient, lowest)

    def predict_tension(self, step: NDArray[np.float64]) -> None:
        """Compute the tension to first order after a step (N, 2) from the last condensation.

        See `bellcrank.mechanics.kernels.newton.predict_tension`.
        """
        from bellcrank.mechanics.kernels.condensation import tension_after

        ordered = np.zeros_like(self.scratch.step)
        ordered[self._order] = step[self._free]
        tension_after(self.system, self.structure, ordered, self.scratch)


def _checked(gripped: NDArray[np.int64], design: Design) -> NDArray[np.int64]:
    """Return the gripped nodes, if they can be gripped."""
    problem = design.problem
    known = np.isin(gripped, np.arange(problem.lattice.node_count))
    bad = np.flatnonzero(~known | np.isin(gripped, problem.supports.nodes))
    if len(bad):
        raise InvalidSettings(
            f"gripped: expected free nodes of {problem.name}, got {gripped[bad[0]]}, which is "
            f"{'held by a support' if known[bad[0]] else 'no node of it'}"
        )
    if len(np.unique(gripped)) != len(gripped):
        raise InvalidSettings("gripped: expected each node once")
    return gripped.astype(np.int64)
