"""Local search by predicted flips: flips that improve a design, until several in succession fail.

One Newton step predicts the effect of every flip (`SpringEvaluator.predict_flips`). Flips are
evaluated in the order of their predicted gain; the first that improves the design is accepted,
and all flips are predicted again. The search also ends when no flip left is predicted to help.
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

MIN_GAIN = 1e-6
"""Smallest gain of efficiency that is accepted; responses are converged to 1e-9."""
MAX_STRAIN = 0.1
"""Strain of an absent beam placed between its displaced nodes, up to which a predicted gain is
used. Of 38 predicted gains beyond it on the crane none was real, of 79 on the pliers two."""


@dataclass(slots=True, eq=False)
class LocalSearch:
    """A local search in progress.

    Parameters
    ----------
    evaluator
        Evaluator whose reference is the current design.
    mask : (M,) bool
        The current design.
    efficiency
        Its score: the efficiency less the penalty for violated goals.
    max_failures
        Consecutive failed flips that end the local search.
    max_predicted_loss
        Largest predicted loss, as a fraction of the efficiency, with which a flip is evaluated.
    failed
        Beams whose flips failed since the last gain.
    """

    evaluator: Evaluator
    mask: NDArray[np.bool_]
    efficiency: float
    max_failures: int
    max_predicted_loss: float
    failed: list[int]
    _queue: list[int] | None = None
    """Beams to flip, the most promising last."""

    def next_beam(self) -> int | None:
        """Return the beam to flip next; None if the local search has ended."""
        if self._queue is None:
            self._queue = self._promising_beams()
        if len(self.failed) >= self.max_failures or not self._queue:
            return None
        return self._queue.pop()

    def _promising_beams(self) -> list[int]:
        prediction = self.evaluator.predict_flips(self.mask)
        if prediction is None:
            return []
        reliable = self.mask[prediction.beams] | (np.abs(prediction.strain) <= MAX_STRAIN)
        bound = -self.max_predicted_loss * abs(self.efficiency)
        promising = reliable & (prediction.change != 0.0) & (prediction.change > bound)
        promising &= ~np.isin(prediction.beams, self.failed)
        order = np.argsort(prediction.change[promising], kind="stable")
        beams: list[int] = prediction.beams[promising][order].tolist()
        return beams

    def try_flip(self, beam: int) -> tuple[NDArray[np.bool_], Response, bool]:
        """Evaluate a flip and accept it if it improves the design.

        Returns
        -------
        mask, response
            Design with the beam flipped, and its response.
        accepted
        """
        mask = self.mask.copy()
        mask[beam] ^= True
        required = self.efficiency + MIN_GAIN
        response = self.evaluator.evaluate(mask, warm_start=True, lower_bound=required)
        accepted = response.is_admissible and response.score > required
        if accepted:
            self.evaluator.set_reference()
            self.mask, self.efficiency = mask, response.score
            self.failed, self._queue = [], None
        else:
            self.failed.append(beam)
        return mask, response, accepted


def start_local_search(
    evaluator: Evaluator,
    mask: NDArray[np.bool_],
    max_failures: int,
    max_predicted_loss: float,
    failed: Iterable[int] = (),
) -> LocalSearch | None:
    """Start or resume a local search; None from a design without a stable response."""
    response = evaluator.evaluate(mask)
    if not response.is_admissible:
        return None
    evaluator.set_reference()
    return LocalSearch(
        evaluator, mask, response.score, max_failures, max_predicted_loss, list(failed)
    )
