"""Local search by predicted flips: flips that improve a design, until several in succession fail.

One Newton step predicts the effect of every flip (`SpringEvaluator.predict_flips`). Flips are
evaluated in the order of their predicted gain; the first that improves the design is accepted,
and all flips are predicted again. The search also ends when no flip left is predicted to help.

On large lattices the most promising flips that are distant from one another are made together. If
they gain nothing, the best quarter of them is tried, down to a single flip. If they gain much less
than was predicted, half as many are made next. Several gains use the same prediction, and flips
that failed alone are not tried again in the same block of the search.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.search.hopping.variation import designable_midpoints

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from bellcrank.mechanics import Response
    from bellcrank.search.evaluator import Evaluator
    from bellcrank.search.hopping.settings import Limits

MIN_GAIN = 1e-6
"""Smallest gain of efficiency that is accepted; responses are converged to 1e-9."""
MAX_STRAIN = 0.1
"""Strain of an absent beam placed between its displaced nodes, up to which a predicted gain is
used. Of 38 predicted gains beyond it on the crane none was real, of 79 on the pliers two."""
LEAST_SHARE = 0.25
"""Fraction of the sum of their predicted gains below which fewer flips are made together next."""
SMALLER_BATCH = 4
"""Divisor of the number of flips made together after they fail."""
SEPARATION = 2.0
"""Least distance of the midpoints of two beams flipped together, in mean beam lengths."""
BEAMS_PER_GAIN = 1000
"""Designable beams for each further gain that uses the same prediction."""


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
    limits
        Consecutive failed single flips that end the local search, and the largest number of flips
        made together.
    max_predicted_loss
        Largest predicted loss, as a fraction of the efficiency, with which a flip is evaluated.
    failed
        Beams whose single flips failed since the last gain.
    batch
        Largest number of flips made together next.
    """

    evaluator: Evaluator
    mask: NDArray[np.bool_]
    efficiency: float
    limits: Limits
    max_predicted_loss: float
    failed: list[int]
    batch: int
    _beams: NDArray[np.int64] | None = None
    """Beams to flip, the most promising first; None if they must be predicted."""
    _gains: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    """Their predicted gains."""
    _midpoints: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    """Their midpoints, in units of `SEPARATION`."""
    _gains_of_prediction: int = 0
    """Gains since the last prediction."""
    _left_out: list[int] = field(init=False)
    """Beams that are not flipped."""
    _is_evaluated: bool = True
    """Whether the current design was evaluated last."""

    def __post_init__(self) -> None:
        self._left_out = list(self.failed)

    def next_flips(self) -> NDArray[np.int64] | None:
        """Return the beams to flip next, together; None if the local search has ended."""
        if self._beams is None:
            self._predict()
        ended = len(self.failed) >= self.limits.max_failures
        if self._beams is None or not len(self._beams) or ended:
            return None
        return self._beams[self._distant()]

    def _predict(self) -> None:
        if not self._is_evaluated:
            self.evaluator.evaluate(self.mask, warm_start=True)  # the reference
            self._is_evaluated = True
        prediction = self.evaluator.predict_flips(self.mask)
        self._gains_of_prediction = 0
        if prediction is None:
            return
        reliable = self.mask[prediction.beams] | (np.abs(prediction.strain) <= MAX_STRAIN)
        bound = -self.max_predicted_loss * abs(self.efficiency)
        promising = reliable & (prediction.change != 0.0) & (prediction.change > bound)
        promising &= ~np.isin(prediction.beams, self._left_out)
        order = np.flatnonzero(promising)
        # Of equal gains the last beam comes first.
        order = order[np.argsort(prediction.change[order], kind="stable")][::-1]
        problem = self.evaluator.problem
        unit = SEPARATION * float(np.mean(problem.lattice.rest_length))
        self._beams, self._gains = prediction.beams[order], prediction.change[order]
        self._midpoints = designable_midpoints(problem)[order] / unit

    def _distant(self) -> list[int]:
        """Return the indices of the most promising flips that are distant from one another."""
        # A flip that is not predicted to help is made alone.
        candidates = np.arange(max(1, int(np.count_nonzero(self._gains > 0.0))))
        chosen: list[int] = []
        while len(chosen) < self.batch and len(candidates):
            chosen.append(int(candidates[0]))
            distance = np.linalg.norm(
                self._midpoints[candidates] - self._midpoints[chosen[-1]], axis=1
            )
            candidates = candidates[distance >= 1.0]
        return chosen

    def try_flips(self, beams: NDArray[np.int64]) -> tuple[NDArray[np.bool_], Response, bool]:
        """Evaluate the next flips together and accept them if they improve the design.

        Parameters
        ----------
        beams : (n,) int64
            The result of `next_flips`.

        Returns
        -------
        mask, response
            Design with the beams flipped, and its response.
        accepted
        """
        assert self._beams is not None
        mask = self.mask.copy()
        mask[beams] ^= True
        tried = np.isin(self._beams, beams)
        several = len(beams) > 1
        required = self.efficiency + MIN_GAIN
        response = self.evaluator.evaluate(mask, warm_start=True, lower_bound=required)
        accepted = response.is_admissible and response.score > required
        self._is_evaluated = accepted
        if accepted:
            self.evaluator.set_reference()
            gain, predicted = response.score - self.efficiency, float(self._gains[tried].sum())
            self.mask, self.efficiency, self.failed = mask, response.score, []
            agrees = not several or gain >= LEAST_SHARE * predicted
            wanted = 2 * len(beams) if agrees else len(beams) // 2
            self.batch = min(wanted, self.limits.largest_batch)
            if self.limits.largest_batch == 1:
                self._left_out = []
        elif several:
            self.batch = max(1, len(beams) // SMALLER_BATCH)
        else:
            self.failed.append(int(beams[0]))
            self._left_out.append(int(beams[0]))
        self._drop(tried, accepted=accepted, several=several)
        return mask, response, accepted

    def _drop(self, tried: NDArray[np.bool_], *, accepted: bool, several: bool) -> None:
        """Drop flips that have been tried, or all predictions where they are too old."""
        assert self._beams is not None
        self._gains_of_prediction += accepted
        designable = len(self.evaluator.problem.designable)
        last = 1 + designable // BEAMS_PER_GAIN
        failed_later = not accepted and self._gains_of_prediction > 0
        if self._gains_of_prediction >= last or failed_later:
            self._beams = None
        elif accepted or not several:
            self._beams, self._gains = self._beams[~tried], self._gains[~tried]
            self._midpoints = self._midpoints[~tried]


def start_local_search(
    evaluator: Evaluator,
    mask: NDArray[np.bool_],
    limits: Limits,
    max_predicted_loss: float,
    failed: Iterable[int] = (),
    batch: int | None = None,
) -> LocalSearch | None:
    """Start or resume a local search; None from a design without a stable response."""
    response = evaluator.evaluate(mask)
    if not response.is_admissible:
        return None
    evaluator.set_reference()
    return LocalSearch(
        evaluator, mask, response.score, limits, max_predicted_loss, list(failed),
        batch or limits.largest_batch,
    )  # fmt: skip
