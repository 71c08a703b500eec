"""Climbing: from a design to one that no flip of a beam improves, in few responses.

One Newton step predicts what each flip would do (`SpringEvaluator.screen`). They are tried from
the most promising on; the first that really improves is taken, and all are predicted anew.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from bellcrank.mechanics import Response
    from bellcrank.search.evaluator import Evaluator

LEAST_GAIN = 1e-6
"""Gain of efficiency that counts as one; responses are settled to 1e-9."""
LARGEST_STRAIN = 0.1
"""Of an absent beam put between its ends as they are, up to which a predicted gain is
believed. Of 38 predicted gains beyond it on the crane none was one, of 79 on the pliers two."""


@dataclass(slots=True, eq=False)
class Climb:
    """A climb under way.

    Parameters
    ----------
    evaluator
        Must have the design remembered.
    mask : (M,) bool
        The design reached.
    efficiency
        Of it, less the penalty for broken goals.
    depth
        Flips that are tried in vain before the climb ends.
    largest_loss
        Predicted loss, as a part of the efficiency, up to which a flip is tried.
    tried
        Beams tried in vain since the last gain.
    """

    evaluator: Evaluator
    mask: NDArray[np.bool_]
    efficiency: float
    depth: int
    largest_loss: float
    tried: list[int]
    _waiting: list[int] | None = None
    """Beams to try, the most promising last."""

    def next_beam(self) -> int | None:
        """Return the beam whose flip to try next; None if the climb has ended."""
        if self._waiting is None:
            self._waiting = self._candidates()
        if len(self.tried) >= self.depth or not self._waiting:
            return None
        return self._waiting.pop()

    def _candidates(self) -> list[int]:
        screening = self.evaluator.predict_flips(self.mask)
        if screening is None:
            return []
        believed = self.mask[screening.beams] | (np.abs(screening.strain) <= LARGEST_STRAIN)
        floor = -self.largest_loss * abs(self.efficiency)
        worth = believed & (screening.change != 0.0) & (screening.change > floor)
        worth &= ~np.isin(screening.beams, self.tried)
        order = np.argsort(screening.change[worth], kind="stable")
        beams: list[int] = screening.beams[worth][order].tolist()
        return beams

    def try_flip(self, beam: int) -> tuple[NDArray[np.bool_], Response, bool]:
        """Evaluate a flip, and take it if it improves.

        Returns
        -------
        mask, response
            Of the flipped design.
        taken
        """
        mask = self.mask.copy()
        mask[beam] ^= True
        response = self.evaluator.evaluate(
            mask, warm_start=True, lower_bound=self.efficiency + LEAST_GAIN
        )
        taken = response.is_admissible and response.score > self.efficiency + LEAST_GAIN
        if taken:
            self.evaluator.set_reference()
            self.mask, self.efficiency = mask, response.score
            self.tried, self._waiting = [], None
        else:
            self.tried.append(beam)
        return mask, response, taken


def resume_climb(
    evaluator: Evaluator,
    mask: NDArray[np.bool_],
    depth: int,
    largest_loss: float,
    tried: Iterable[int] = (),
) -> Climb | None:
    """Start a climb, or go on with it; None from a design without a stable response."""
    response = evaluator.evaluate(mask)
    if not response.is_admissible:
        return None
    evaluator.set_reference()
    return Climb(evaluator, mask, response.score, depth, largest_loss, list(tried))
