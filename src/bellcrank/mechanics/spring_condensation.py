"""Condensation of the spring model; see `bellcrank.mechanics.superelement`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics.kernels.arrays import ACTIVE, HELD
from bellcrank.mechanics.objectives import objective_of
from bellcrank.mechanics.status import Status
from bellcrank.mechanics.system import allocate_scratch, allocate_structure, build_system

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics.kernels.arrays import Floats
    from bellcrank.model import Design


class SpringCondensation:
    """A design in the spring model, condensed to held displacements of its boundary nodes.

    A configuration is the displacement (N, 2) of the nodes.

    Parameters
    ----------
    design
        Design of a problem without a displacement drive.
    held : (N, 2) bool
        Displacements of boundary nodes.
    core
        Code of the treatment of unloaded beams.
    """

    def __init__(self, design: Design, held: NDArray[np.bool_], core: int) -> None:
        from bellcrank.mechanics.kernels.structure import find_structure

        problem = design.problem
        system = build_system(problem, objective_of(problem, "displacement"))
        self.system = replace(
            system, load=np.zeros_like(system.load), ground=np.zeros_like(system.ground)
        )
        self.structure = allocate_structure(self.system)
        self.scratch = allocate_scratch(self.system, self.structure)
        self._held = self.system.held.copy()
        self._held[held.any(axis=1)] = HELD
        self._free = np.flatnonzero(self.system.block >= 0)
        self._order = self.system.block[self._free]
        blocks = np.arange(len(self.scratch.step))
        self._mode = np.cos(1.0 + np.stack([3.0 * blocks, 3.0 * blocks + 1.0], axis=1))
        # Pieces are classified with held boundary nodes, and beams between these still move.
        classified = replace(self.system, held=self._held)
        mask = design.mask.astype(np.uint8)
        self.status = Status(find_structure(classified, mask, core, self.structure))
        self.active: NDArray[np.bool_] = self.structure.active == ACTIVE

    def rest(self) -> Floats:
        """Return the configuration at rest."""
        return np.zeros_like(self.system.positions)

    def energy(self, configuration: Floats) -> float:
        """Return the elastic energy."""
        from bellcrank.mechanics.kernels.condensation import energy_at

        found: float = energy_at(self.system, self.structure, configuration, self.scratch)
        return found

    def condense(
        self, configuration: Floats, motions: NDArray[np.float64], softening: float, predicted: bool
    ) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """Condense to motions; see `bellcrank.mechanics.superelement.Condensation`."""
        from bellcrank.mechanics.kernels.condensation import condense

        ordered = np.zeros((len(motions), *self._mode.shape))
        ordered[:, self._order] = motions[:, self._free]
        forcing, responses = np.zeros_like(ordered), np.zeros_like(ordered)
        lowest = condense(
            self.system, self.structure, self._held, configuration, softening, predicted, ordered,
            forcing, responses, self._mode, self.scratch,
        )  # fmt: skip
        self.interior_step = np.zeros_like(configuration)
        self.interior_step[self._free] = self.scratch.step[self._order]
        whole = np.zeros((2, *motions.shape))
        whole[0][:, self._free] = forcing[:, self._order]
        whole[1][:, self._free] = responses[:, self._order]
        return lowest, whole[0], whole[1]

    @property
    def gradient(self) -> Floats:
        """(N, 2) derivative of the energy at the configuration condensed last."""
        return self.scratch.gradient

    def predict_tension(self, motion: Floats) -> None:
        """Compute the tensions to first order after a motion from the last condensation."""
        from bellcrank.mechanics.kernels.condensation import tension_after

        ordered = np.zeros_like(self.scratch.step)
        ordered[self._order] = motion[self._free]
        tension_after(self.system, self.structure, ordered, self.scratch)

    def moved(self, configuration: Floats, motion: Floats) -> Floats:
        """Return the configuration after a motion (N, 2)."""
        return configuration + motion

    def motion(self, start: Floats, end: Floats) -> Floats:
        """Return the motion (N, 2) from one configuration to another."""
        return end - start
