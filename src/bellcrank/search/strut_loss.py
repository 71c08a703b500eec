"""What the loss of a single strut costs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import FrameEvaluator, Status

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem

PATH_LOST = 2.0
"""Loss where the full stroke is not reached on a stable path; the largest one that is reported."""
FIRST = 6
"""Number of struts that cost most in earlier designs and are computed first."""


class StrutLosses:
    """Parts of the efficiency that the loss of each strut costs, by one element in each strut.

    The efficiency is that of the first load case and its first output. A loss of 1 is the whole
    motion, a larger one reverses it.

    Parameters
    ----------
    problem
        Problem of a frame.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> from bellcrank.part import PartSpec, frame_problem
    >>> design = human_design("crane")
    >>> losses = StrutLosses(frame_problem(design.problem, PartSpec()))
    >>> round(losses.largest(design.mask), 2)
    2.0
    """

    def __init__(self, problem: Problem) -> None:
        self.evaluator = FrameEvaluator(problem, "displacement")
        held = np.isin(problem.lattice.beams, problem.supports.fixed).all(axis=1)
        self._counts = ~held
        self._worst: list[int] = []

    def largest(self, mask: NDArray[np.bool_], bound: float = math.inf) -> float:
        """Return the largest loss, or one above a bound if there is any.

        Parameters
        ----------
        mask : (M,) bool
            A design.
        bound
            Loss above which the others are not computed.
        """
        return max(self.by_strut(mask, bound).values(), default=0.0)

    def by_strut(self, mask: NDArray[np.bool_], bound: float = math.inf) -> dict[int, float]:
        """Return the loss by beam; as `largest`, the others may be missing above the bound."""
        nominal = self.evaluator.evaluate(mask)
        struts = np.flatnonzero(mask & self._counts).tolist()
        if nominal.status is not Status.CONVERGED:
            return dict.fromkeys(struts, PATH_LOST)
        self.evaluator.set_reference()
        first = [beam for beam in self._worst if mask[beam]]
        found: dict[int, float] = {}
        for beam in dict.fromkeys([*first, *struts]):
            if len(found) >= len(first) and max(found.values(), default=0.0) > bound:
                break
            found[beam] = self._loss(mask, beam, nominal.efficiency)
        self._worst = sorted(found, key=lambda beam: -found[beam])[:FIRST]
        return found

    def _loss(self, mask: NDArray[np.bool_], beam: int, nominal: float) -> float:
        """Return the loss without a beam; 0 where the motion grows."""
        without = mask.copy()
        without[beam] = False
        response = self.evaluator.evaluate(without, warm_start=True)
        if response.status is not Status.CONVERGED or nominal == 0.0:
            return PATH_LOST
        return min(max(1.0 - response.efficiency / nominal, 0.0), PATH_LOST)
