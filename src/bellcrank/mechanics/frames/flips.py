"""Changes of the measures of quantities by flips of beams."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bellcrank.mechanics.frames.kernels.arrays import Flips
from bellcrank.mechanics.frames.system import allocate_structure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.mechanics.frames.equilibria import Equilibrium
    from bellcrank.mechanics.frames.kernels.arrays import Frame, Structure
    from bellcrank.mechanics.frames.quantities import Measures, Quantity
    from bellcrank.mechanics.kernels.arrays import Bytes, Floats

OWN = ("column_bits", "word_start", "column_start", "row", "beam_entry")
"""Arrays of the structure that depend on the pattern of the stiffness."""


class FlipChanges(NamedTuple):
    """Changes by the flips of n beams, by one Newton step or to first order."""

    measures: list[NDArray[np.float64]]
    """(n, k) change of the measures of each quantity."""
    forces: NDArray[np.float64]
    """(n, 2 b) change of the forces on the ends of each beam."""
    strain: NDArray[np.float64]
    """(n,) as in `bellcrank.mechanics.FlipPrediction`."""


class FlipPredictor:
    """Predictions of flips for the equilibria of one evaluator, with memory of their own.

    Parameters
    ----------
    frame, structure
        Those of the evaluator.
    """

    def __init__(self, frame: Frame, structure: Structure) -> None:
        pattern = allocate_structure(frame)
        self.count = 2 * len(frame.unit)
        self.structure = replace(structure, **{name: getattr(pattern, name) for name in OWN})
        self._spaces: dict[int, Flips] = {}

    def changes(
        self,
        equilibrium: Equilibrium,
        measured: Sequence[tuple[Quantity, Measures]],
        beams: NDArray[np.int64],
        design: Bytes,
        *,
        first_order: bool,
    ) -> FlipChanges | None:
        """Return the changes of measures by flips; None if the equilibrium is unstable.

        Parameters
        ----------
        measured
            Quantities and their measures at the equilibrium.
        beams : (n,) int64
            Beams to flip, one at a time.
        design : (M,) uint8
            The beams that are present.
        first_order
            Compute derivatives by the presence of the beams instead.
        """
        from bellcrank.mechanics.frames.kernels.flips import predict_flips

        frame = equilibrium.frame
        motions: list[Floats] = []
        blocks: list[tuple[int, int, NDArray[np.float64], NDArray[np.float64]]] = []
        for index, (quantity, found) in enumerate(measured):
            slopes = quantity.slopes(equilibrium, found)
            zeros = np.zeros_like(slopes.fields)
            on_held = zeros if slopes.on_held is None else slopes.on_held
            blocks.append((index, 0, slopes.fields, on_held))
            if slopes.by_motion is not None and found.motion is not None:
                motions.append(found.motion)
                blocks.append((index, len(motions), slopes.by_motion, zeros))
        fields = np.concatenate([block[2] for block in blocks])
        forces = np.zeros((len(beams), 1 + len(motions), self.count))
        strain = np.zeros(len(beams))
        stable = predict_flips(
            frame, beams, first_order, equilibrium.fraction, self.structure,
            equilibrium.state, equilibrium.memory, self._space(len(motions)), fields,
            np.concatenate([block[3] for block in blocks]),
            np.array(motions).reshape(-1, *fields.shape[1:]), forces, strain,
        )  # fmt: skip
        if not stable:
            return None
        forces[(design[beams] != 0) & (self.structure.present[beams] == 0)] = 0.0
        adjoints = fields[:, frame.beams[beams]].reshape(len(fields), len(beams), -1)
        products = adjoints.transpose(1, 0, 2) @ forces.transpose(0, 2, 1)
        changes = [np.zeros((len(beams), len(found.value))) for _, found in measured]
        begin = 0
        for index, right_side, own, _ in blocks:
            changes[index] -= products[:, begin : begin + len(own), right_side]
            begin += len(own)
        return FlipChanges(changes, forces[:, 0], strain)

    def _space(self, motions: int) -> Flips:
        """Return memory for a number of linear motions."""
        if motions not in self._spaces:
            coupling = np.zeros((self.count, self.count))
            matrix = np.zeros((self.count, self.count + 1 + motions))
            self._spaces[motions] = Flips(coupling, matrix)
        return self._spaces[motions]
