"""Networks and mechanics as judges of designs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.surrogate.predictor import Prediction, Predictor


class NetworkScorer:
    """Networks as what a search asks: their mean, less what they dispute.

    Parameters
    ----------
    predictor
        One network or several.
    caution
        How many standard deviations between the networks to take off; 0 trusts their mean.

    Raises
    ------
    InvalidSettings
        If caution is asked of a single network, which disputes nothing.
    """

    def __init__(self, predictor: Predictor, caution: float = 0.0) -> None:
        if not 0.0 <= caution < math.inf:
            raise InvalidSettings(f"caution: expected at least 0, got {caution!r}")
        if caution and len(predictor.members) < 2:
            raise InvalidSettings(
                "caution: takes off what several networks dispute, and there is only one; name "
                "more (--model FILE --model FILE), or leave it at 0"
            )
        self.predictor = predictor
        self.caution = caution

    def score(self, masks: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Return what to take for the efficiencies (n,) of designs (n, M)."""
        return self.judged(self.predictor.predict(masks))

    def judged(self, said: Prediction) -> NDArray[np.float64]:
        """Return what to take for the efficiencies (n,) after what the networks said."""
        if said.spread is None or not self.caution:
            return said.efficiency
        return said.efficiency - self.caution * said.spread


@dataclass(frozen=True, slots=True)
class Truth:
    """What the mechanics says of a design, loaded from rest in small steps.

    Parameters
    ----------
    status
        A label of `bellcrank.mechanics.Status`.
    efficiency
        None unless the status is ``converged``: one that snaps has no unique efficiency.
    """

    status: str
    efficiency: float | None

    @property
    def rank(self) -> float:
        """The efficiency, -inf where there is none: for comparing and for medians."""
        return -math.inf if self.efficiency is None else self.efficiency


class Judge:
    """The mechanics, asked carefully and not twice about the same design.

    Parameters
    ----------
    problem
        With its own objective, in the literal model.
    tell
        Called with the number of designs judged so far, asked for again or not.
    """

    def __init__(self, problem: Problem, tell: Callable[[int], None] = lambda _done: None) -> None:
        self._evaluator = SpringEvaluator(problem)
        self._beams = problem.lattice.beam_count
        self._known: dict[bytes, Truth] = {}
        self._tell = tell
        self._asked = 0

    def truth(self, packed: NDArray[np.uint8]) -> Truth:
        """Return what a design really does.

        Parameters
        ----------
        packed : (bytes,) uint8
        """
        key = packed.tobytes()
        if key not in self._known:
            mask = np.unpackbits(packed, count=self._beams).astype(bool)
            response = self._evaluator.evaluate(mask, largest_increment=VERIFICATION_INCREMENT)
            sound = response.status is Status.CONVERGED
            efficiency = response.efficiency if sound else None
            self._known[key] = Truth(response.status.label, efficiency)
        self._asked += 1
        self._tell(self._asked)
        return self._known[key]
