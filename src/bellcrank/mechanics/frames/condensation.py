"""Condensation of frames; see `bellcrank.mechanics.superelement`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics.frames.kernels.arrays import State
from bellcrank.mechanics.frames.system import allocate_memory, allocate_structure, build_frame
from bellcrank.mechanics.objectives import objective_of
from bellcrank.mechanics.ordering import elimination_order
from bellcrank.mechanics.status import Status
from bellcrank.model.stroke_ranges import WHOLE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics.frames.kernels.arrays import Frame
    from bellcrank.mechanics.kernels.arrays import Floats
    from bellcrank.model import Design, Problem


class FrameCondensation:
    """A design of a problem with a section, condensed to held unknowns of its boundary nodes.

    One element for each beam, with the shortening of bent beams. A configuration is (N, 3) in the
    plane, the displacement and the rotation of the nodes; in space (N, 7), the displacement and a
    unit quaternion.

    Parameters
    ----------
    design
        Design of a problem without a displacement drive.
    held : (N, b) bool
        Unknowns of boundary nodes.
    """

    def __init__(self, design: Design, held: NDArray[np.bool_]) -> None:
        from bellcrank.mechanics.frames.kernels.condensation import find_structure

        self.frame = _bounded(design.problem, held)
        self.structure = allocate_structure(self.frame)
        self.memory = allocate_memory(self.frame, self.structure)
        mask = design.mask.astype(np.uint8)
        self.status = Status(find_structure(self.frame, mask, self.structure, self.memory))
        carrying = np.zeros(len(held), dtype=bool)
        carrying[self.frame.beams[self.structure.beam[: self.structure.sizes[1]]]] = True
        self.active: NDArray[np.bool_] = carrying & (self.structure.active != 0)
        nodes, size = held.shape
        self._mode = np.cos(1.0 + 3.0 * np.arange(nodes)[:, None] + np.arange(size))

    def rest(self) -> Floats:
        """Return the configuration at rest."""
        nodes, size = self._mode.shape
        configuration = np.zeros((nodes, 3 if size == 3 else 7))
        configuration[:, 3:4] = 1.0
        return configuration

    def energy(self, configuration: Floats) -> float:
        """Return the elastic energy."""
        from bellcrank.mechanics.frames.kernels.condensation import energy_at

        found: float = energy_at(self.frame, self.structure, _state(configuration), self.memory)
        return found

    def condense(
        self, configuration: Floats, motions: NDArray[np.float64], softening: float, predicted: bool
    ) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """Condense to motions; see `bellcrank.mechanics.superelement.Condensation`."""
        from bellcrank.mechanics.frames.kernels.condensation import condense

        forcing, responses = np.zeros_like(motions), np.zeros_like(motions)
        self.interior_step = np.zeros_like(self._mode)
        lowest = condense(
            self.frame, self.structure, _state(configuration), softening, predicted, motions,
            forcing, responses, self.interior_step, self._mode, self.memory,
        )  # fmt: skip
        return lowest, forcing, responses

    @property
    def gradient(self) -> Floats:
        """(N, b) derivative of the energy at the configuration condensed last."""
        found: Floats = self.memory.gradient
        return found

    def predict_tension(self, motion: Floats) -> None:
        """Compute the tensions to first order after a motion."""
        from bellcrank.mechanics.frames.kernels.condensation import tension_after

        tension_after(self.frame, self.structure, motion, self.memory)

    def moved(self, configuration: Floats, motion: Floats) -> Floats:
        """Return the configuration after a motion (N, b)."""
        from bellcrank.mechanics.frames.kernels.condensation import move_by

        state = _state(configuration)
        move_by(state, motion)
        return _configuration(state)

    def motion(self, start: Floats, end: Floats) -> Floats:
        """Return the motion (N, b) from one configuration to another."""
        from bellcrank.mechanics.frames.kernels.condensation import motion_between

        out: Floats = np.zeros_like(self._mode)
        motion_between(_state(start), _state(end), out)
        return out


def _state(configuration: Floats) -> State:
    """Return a copy of a configuration for the kernels."""
    if configuration.shape[1] == 3:
        return State(configuration.copy(), np.zeros((0, 4)))
    return State(configuration[:, :3].copy(), configuration[:, 3:].copy())


def _configuration(state: State) -> Floats:
    """Return a state of the kernels as a configuration."""
    parts = (state.u, state.q) if len(state.q) else (state.u,)
    whole: Floats = np.concatenate(parts, axis=1)
    return whole


def _bounded(problem: Problem, held: NDArray[np.bool_]) -> Frame:
    """Return the unloaded frame of a problem with held and driven boundary nodes."""
    frame = build_frame(problem, objective_of(problem, "displacement"))
    boundary: NDArray[np.bool_] = np.asarray(held.any(axis=1))
    every: NDArray[np.bool_] = held | (frame.held != 0)
    fully: NDArray[np.bool_] = np.asarray(every.all(axis=1))
    partly: NDArray[np.bool_] = np.asarray(every.any(axis=1)) & ~fully
    protected = frame.protected.copy()
    protected[boundary] = 1
    return replace(
        frame,
        held=every.astype(np.uint8),
        protected=protected,
        prescribed=boundary.astype(np.uint8),
        partly=partly.astype(np.uint8),
        block=elimination_order(frame.beams, fully, springs=False),
        drive=np.zeros_like(frame.drive),
        ramp=np.tile(WHOLE, (len(frame.ramp), 1)),
        has_ramps=False,
        kinks=np.zeros(0),
        load=np.zeros_like(frame.load),
        load_range=np.tile(WHOLE, (len(frame.load), 1)),
        ground=np.zeros_like(frame.ground),
    )
