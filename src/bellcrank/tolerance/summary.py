"""Summary of scenarios: worst values, percentiles, yield, and what each strut is worth."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bellcrank.mechanics.items import Bounds, relative_distance

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from bellcrank.model import Item, ObjectiveTerm
    from bellcrank.tolerance.evaluation import ScenarioResult
    from bellcrank.tolerance.scenarios import Kind, Scenario

PERCENTILE = 0.05
"""Part of the random prints that may be worse than the percentile of a value."""


class Worst(NamedTuple):
    """The worst value of a quantity, its scenario, and whether the item is met there.

    The value is nan if the full stroke is not reached. An objective is met where it is reached.
    """

    value: float
    scenario: Scenario
    met: bool


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """An item or an objective over the scenarios.

    Parameters
    ----------
    quantity
        The item or the objective.
    nominal
        Its value as drawn.
    worst
        Its worst value among the scenarios of each kind.
    percentile
        The value than which 5 % of the random prints are worse; nan if more lose their path.
    share
        Fraction of the random prints that meet the item; nan for an objective.
    """

    quantity: Item | ObjectiveTerm
    nominal: float
    worst: dict[Kind, Worst]
    percentile: float
    share: float


class Tolerance:
    """Scenarios of a design and their results, the nominal one first.

    Parameters
    ----------
    scenarios, results
        Both in the same order.
    objectives
        Objectives of the specification.
    """

    def __init__(
        self,
        scenarios: Sequence[Scenario],
        results: Sequence[ScenarioResult],
        objectives: Sequence[ObjectiveTerm],
    ) -> None:
        self.scenarios, self.results = list(scenarios), list(results)
        self.objectives = list(objectives)

    @property
    def nominal(self) -> ScenarioResult:
        """The result as drawn."""
        return self.results[0]

    def of_kind(self, kind: Kind) -> list[int]:
        """Return the numbers of the scenarios of a kind."""
        return [k for k, scenario in enumerate(self.scenarios) if scenario.kind == kind]

    @property
    def kinds(self) -> list[Kind]:
        """Kinds of the scenarios without the nominal one, in their order."""
        return list(dict.fromkeys(each.kind for each in self.scenarios[1:]))

    @property
    def print_yield(self) -> float:
        """Fraction of the random prints that meet all items; nan without prints."""
        prints = self.of_kind("print")
        return float(np.mean([self.results[k].met for k in prints])) if prints else math.nan

    def rows(self) -> list[Row]:
        """Return the items, then the objectives."""
        items = [self._row_of_item(index) for index in range(len(self.nominal.items))]
        return items + [
            self._row(
                objective,
                [result.objectives[index] for result in self.results],
                lambda value: -value,
                None,
            )
            for index, objective in enumerate(self.objectives)
        ]

    def _row_of_item(self, index: int) -> Row:
        item = self.nominal.items[index].item
        values = [
            result.items[index].value if result.is_stable else math.nan for result in self.results
        ]

        def distance(value: float) -> float:
            return float(relative_distance(Bounds.of(item), np.asarray(value), np.asarray(value)))

        met = [result.is_stable and result.items[index].met for result in self.results]
        return self._row(item, values, distance, met)

    def _row(
        self,
        quantity: Item | ObjectiveTerm,
        values: list[float],
        distance: Callable[[float], float],
        met: list[bool] | None,
    ) -> Row:
        """Return the row of a quantity; the larger the distance, the worse a value."""
        ranks = [math.inf if math.isnan(value) else distance(value) for value in values]
        worst: dict[Kind, Worst] = {}
        for kind in self.kinds:
            chosen = max(self.of_kind(kind), key=lambda k: ranks[k])
            is_met = not math.isnan(values[chosen]) if met is None else met[chosen]
            worst[kind] = Worst(values[chosen], self.scenarios[chosen], is_met)
        prints = sorted(self.of_kind("print"), key=lambda k: -ranks[k])
        percentile = share = math.nan
        if prints:
            percentile = values[prints[math.floor(PERCENTILE * len(prints))]]
            if met is not None:
                share = float(np.mean([met[k] for k in prints]))
        return Row(quantity, values[0], worst, percentile, share)

    @property
    def measure(self) -> str:
        """Quantity that the loss of a strut reduces: a rotation to be maximised, or efficiency."""
        first = self.objectives[0].quantity if self.objectives else ""
        return "rotation" if first == "rotation" else "efficiency"

    def strut_losses(self) -> dict[int, float]:
        """Return the part of `measure` that the loss of each strut costs.

        Infinite where the full stroke is not reached; above 1 where the motion is reversed.
        """
        nominal = self._measured(self.nominal)
        losses = {}
        for k in self.of_kind("strut"):
            scenario, result = self.scenarios[k], self.results[k]
            assert scenario.missing is not None
            ratio = self._measured(result) / nominal
            losses[scenario.missing] = 1.0 - ratio if result.is_stable else math.inf
        return losses

    def _measured(self, result: ScenarioResult) -> float:
        return result.objectives[0] if self.measure == "rotation" else result.efficiency
