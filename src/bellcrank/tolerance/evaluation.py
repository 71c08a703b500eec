"""Evaluation of scenarios by frames."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from bellcrank.errors import InvalidProblem, InvalidSettings
from bellcrank.search.clearance import gap_of_frame, smallest_gap
from bellcrank.search.default_specification import specified
from bellcrank.search.specification import SpecificationEvaluator

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from bellcrank.mechanics import ItemResult
    from bellcrank.model import Design, Problem
    from bellcrank.tolerance.scenarios import Scenario


class ScenarioResult(NamedTuple):
    """What a design does in a scenario.

    Parameters
    ----------
    status
        Label of the status of the response.
    efficiency
        Of the first load case and its first output; nan without a stable path to full stroke.
    items
        Results of the items of the specification; empty without a stable path.
    objectives
        Values of the objectives, in the units of the problem; nan without a stable path.
    reserve
        Efficiency over the smallest one that is tolerated (`Tolerances.keep`), less 1; None if all
        items are to be met in place of it.
    """

    status: str
    efficiency: float
    items: list[ItemResult]
    objectives: list[float]
    reserve: float | None = None

    @property
    def is_stable(self) -> bool:
        """Whether a stable path leads to the full stroke."""
        return math.isfinite(self.efficiency)

    @property
    def met(self) -> bool:
        """Whether a stable path leads to the full stroke, and what is tolerated is met."""
        if self.reserve is not None:
            return self.is_stable and self.reserve >= 0.0
        return self.is_stable and all(each.met for each in self.items)

    @property
    def margin(self) -> float:
        """The smallest margin of what is tolerated; minus infinity without a stable path."""
        if not self.is_stable:
            return -math.inf
        if self.reserve is not None:
            return self.reserve
        return min((each.margin for each in self.items), default=math.inf)


class ScenarioEvaluator:
    """Evaluates scenarios of one design.

    A design without a specification gets that of `bellcrank.search.specified`. What the loss of a
    strut costs is an item of the design as drawn only.

    Parameters
    ----------
    design
        Design of a frame.
    elements : int, optional
        As in `bellcrank.mechanics.FrameEvaluator`.

    Raises
    ------
    InvalidSettings
        If the design has no stable path to its full stroke.
    """

    def __init__(self, design: Design, elements: int | None = None) -> None:
        problem = specified(design.problem)
        assert problem.specification is not None
        items = [item for item in problem.specification.items if item.quantity != "strut_loss"]
        # Deviations are not symmetric.
        wanted = replace(problem.specification, items=tuple(items), symmetry=())
        self.problem = replace(problem, specification=wanted)
        self.mask, self.elements = design.mask, elements
        self._nominal = self._evaluator(self.problem)
        response = self._nominal.evaluate(self.mask)
        if not response.is_admissible:
            raise InvalidSettings(
                f"the design has no tolerance to compute: {response.status.message}"
            )
        self._nominal.set_reference()
        tolerances = wanted.tolerances
        keep = 0.0 if tolerances is None else tolerances.keep
        self._least = keep * response.efficiency

    def _evaluator(self, problem: Problem) -> SpecificationEvaluator:
        gap = gap_of_frame if self.elements is None else smallest_gap
        return SpecificationEvaluator(problem, self.elements, gap=gap)

    def evaluate(self, scenario: Scenario) -> ScenarioResult:
        """Return the result of a scenario.

        Without a strut, the path is compared with that of the design, and followed from rest where
        both are not next to each other; else it is followed from rest.
        """
        mask, warm = self.mask, scenario.missing is not None
        if warm:
            mask = mask.copy()
            mask[scenario.missing] = False
            evaluator = self._nominal
        else:
            try:
                evaluator = self._evaluator(scenario.of(self.problem))
            except InvalidProblem:
                return self._lost("strut shorter than wide")
        response = evaluator.evaluate(mask, warm_start=warm)
        if warm and not response.is_admissible:
            # A search refuses designs whose states it does not find at once.
            response = evaluator.evaluate(mask)
        if not response.is_admissible:
            return self._lost(response.status.label)
        reserve = response.efficiency / self._least - 1.0 if self._least > 0.0 else None
        return ScenarioResult(
            response.status.label, response.efficiency, evaluator.results(),
            evaluator.objective_values(), reserve,
        )  # fmt: skip

    def _lost(self, status: str) -> ScenarioResult:
        """Return the result of a scenario without a stable path."""
        return ScenarioResult(status, math.nan, [], [math.nan] * len(self._nominal.objectives))


def evaluate_scenarios(design: Design, scenarios: Sequence[Scenario]) -> Iterator[ScenarioResult]:
    """Yield the results of scenarios in their order, with one element in each strut."""
    evaluator = ScenarioEvaluator(design)
    for scenario in scenarios:
        yield evaluator.evaluate(scenario)
