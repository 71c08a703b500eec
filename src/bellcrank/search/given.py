"""Quantities of a specification that do not follow from channels along the stroke."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bellcrank.mechanics import VERIFICATION_INCREMENT, FrameEvaluator, Status
from bellcrank.search.clearance import smallest_gap
from bellcrank.search.strut_loss import StrutLosses

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.mechanics import CaseEvaluator
    from bellcrank.model import Item, Problem

    Gap = Callable[[CaseEvaluator, NDArray[np.bool_], float], float]


class GivenQuantities:
    """Clearance, stable stroke and strut loss of designs, as far as items ask for them.

    Parameters
    ----------
    problem
        Problem with a specification.
    items
        Its items.
    cases
        Evaluators of its load cases.
    elements
        Number of elements of each beam, for the stable stroke; None as in
        `bellcrank.mechanics.FrameEvaluator`.
    gap
        Function to the clearance of designs that are not verified.
    """

    def __init__(
        self,
        problem: Problem,
        items: Sequence[Item],
        cases: Mapping[str, CaseEvaluator],
        elements: int | None,
        gap: Gap,
    ) -> None:
        self.cases, self.elements, self.gap = cases, elements, gap
        self.wanted = {
            name: {item.quantity: item.at_least or 0.0 for item in items if item.case == name}
            for name in cases
        }
        bounds = [item.at_most or 0.0 for item in items if item.quantity == "strut_loss"]
        self._largest_loss = min(bounds, default=None)
        self._losses = None if self._largest_loss is None else StrutLosses(problem)
        self._extended: dict[str, FrameEvaluator] = {}

    def of_case(self, name: str, design: NDArray[np.bool_], *, verified: bool) -> dict[str, float]:
        """Return those of a load case for the design evaluated last."""
        wanted, found = self.wanted[name], {}
        if (bound := wanted.get("clearance")) is not None:
            clearance = smallest_gap if verified else self.gap
            found["clearance"] = clearance(self.cases[name], design, bound)
        if (bound := wanted.get("stable_stroke")) is not None:
            found["stable_stroke"] = self._stable_stroke(name, design, bound) if verified else bound
        return found

    def of_design(self, design: NDArray[np.bool_], *, verified: bool) -> dict[str, float]:
        """Return those that belong to no load case.

        Where they are not verified, the strut loss is a lower bound if it exceeds its limit.
        """
        if self._losses is None or self._largest_loss is None:
            return {}
        bound = {} if verified else {"bound": self._largest_loss}
        return {"strut_loss": self._losses.largest(design, **bound)}

    def _stable_stroke(self, name: str, design: NDArray[np.bool_], bound: float) -> float:
        """Return the part of the stroke up to which a design is stable, at most a bound."""
        if name not in self._extended:
            problem = self.cases[name].problem
            given = replace(problem.input, amount=bound * problem.input.amount)
            self._extended[name] = FrameEvaluator(
                replace(problem, input=given), "displacement", self.elements
            )
        response = self._extended[name].evaluate(design, VERIFICATION_INCREMENT)
        return bound * response.reached if response.status is not Status.MECHANISM else 0.0
