"""The scenarios of a refinement: which are constraints, and what a geometry does in all."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from bellcrank.errors import InvalidSettings
from bellcrank.search.strut_loss import StrutLosses
from bellcrank.tolerance import Deviations, ScenarioEvaluator, scenarios_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bellcrank.model import Design, Specification, Tolerances
    from bellcrank.tolerance import Scenario, ScenarioResult

SEED = 1
"""Seed of the random prints with which the robustness of geometries is computed; they are not those
of `bellcrank tolerance`."""
LARGER = 1.15
"""Factor of the deviations of prints as constraints, so that other prints meet all items too."""
ADDED = 4
"""Largest number of scenarios, and of lost struts, that become constraints at a time."""
NEAR_LOSS = 0.7
"""Loss of a strut, over the largest one, from which it is a constraint."""
LOST_STRUTS = 8
"""Number of struts whose losses are constraints from the beginning."""


class Outcome(NamedTuple):
    """What a geometry does in a scenario, by frames with one element in each strut.

    Parameters
    ----------
    scenario
        The scenario.
    margin
        The smallest margin of its items; minus infinity without a stable path.
    objective
        The smallest objective, the smallest margin without any; minus infinity without a stable
        path.
    met
        Whether all items are met.
    """

    scenario: Scenario
    margin: float
    objective: float
    met: bool


class Robustness(NamedTuple):
    """What a geometry does over all scenarios.

    Parameters
    ----------
    share
        Part of them that meets all items, at most the wanted yield.
    objective
        The smallest objective that the wanted yield of them keeps; without objectives, the smallest
        margin.
    """

    share: float
    objective: float


class ScenarioChoice:
    """The scenarios of a refinement, and which of them are constraints.

    Those in which all widths or the direction of the input deviate as far as is tolerated are
    constraints from the beginning. So are struts whose loss costs much.

    Parameters
    ----------
    design
        The design to refine, with a specification.
    prints
        Number of random prints.

    Attributes
    ----------
    all
        All scenarios besides the drawn part.
    candidates
        The same with larger deviations of the prints; from them constraints are chosen.
    chosen, lost
        Scenarios, and lost struts, that are constraints.
    """

    def __init__(self, design: Design, prints: int) -> None:
        wanted = design.problem.specification
        assert wanted is not None
        section = design.problem.section
        self._power = 2 if section is not None and section.shape == "round" else 1
        self.tolerances = wanted.tolerances
        self.all = [] if self.tolerances is None else _scenarios(design, self.tolerances, prints)
        if not self.all:
            self.tolerances = None
        self.candidates = [
            each.scaled(LARGER) if each.kind == "print" else each for each in self.all
        ]
        self.chosen = [each for each in self.candidates if each.kind != "print"]
        self.largest_loss = _largest_loss(wanted)
        self.lost: list[int] = []
        if self.largest_loss is not None:
            self.lost = self._near_losses(design)[:LOST_STRUTS]

    @property
    def is_empty(self) -> bool:
        """Whether only the design as drawn counts."""
        return self.tolerances is None and self.largest_loss is None

    def least_kept(self, scenario: Scenario) -> float | None:
        """Return the smallest efficiency in a scenario over that as drawn.

        None if items are to be met there in place of it.
        """
        if scenario.missing is not None:
            assert self.largest_loss is not None
            return 1.0 - self.largest_loss
        return (self.tolerances.keep if self.tolerances is not None else 0.0) or None

    @property
    def allowed(self) -> int:
        """Number of scenarios that may be far from being met: other prints miss items too."""
        if self.tolerances is None:
            return 0
        return int(0.5 * (1.0 - self.tolerances.least_yield) * len(self.all))

    @property
    def largest_area(self) -> float:
        """Largest area of the section of a strut over that as drawn, of all struts together."""
        if self.tolerances is None or self.tolerances.keep:
            return 1.0
        return float((1.0 + self.tolerances.width) ** self._power)

    def _near_losses(self, design: Design) -> list[int]:
        """Return the struts whose loss costs about as much as it may, or more, worst first."""
        assert self.largest_loss is not None
        least = NEAR_LOSS * self.largest_loss
        losses = StrutLosses(design.problem).by_strut(design.mask)
        return sorted((b for b in losses if losses[b] > least), key=lambda beam: -losses[beam])

    def outcomes(self, design: Design, scenarios: Sequence[Scenario]) -> list[Outcome]:
        """Return what a geometry does in scenarios."""
        try:
            evaluator = ScenarioEvaluator(design)
        except InvalidSettings:
            return [Outcome(each, -math.inf, -math.inf, met=False) for each in scenarios]
        wanted = design.problem.specification
        assert wanted is not None
        scales = [each.scale for each in wanted.maximise]
        results = ((each, evaluator.evaluate(each)) for each in scenarios)
        return [
            Outcome(each, result.margin, _objective(result, scales), result.met)
            for each, result in results
        ]

    def robustness(self, design: Design) -> Robustness:
        """Return what a geometry does over all scenarios, for a specification with tolerances."""
        assert self.tolerances is not None
        found = self.outcomes(design, self.all)
        values = sorted(each.objective for each in found)
        index = math.floor((1.0 - self.tolerances.least_yield) * len(values) + 1e-9)
        share = sum(each.met for each in found) / len(found)
        return Robustness(min(share, self.tolerances.least_yield), values[index])

    def add(self, outcomes: Sequence[Outcome]) -> None:
        """Make the first scenarios of some outcomes constraints."""
        known = {id(each) for each in self.chosen}
        self.chosen += [each.scenario for each in outcomes if id(each.scenario) not in known][
            :ADDED
        ]

    def add_losses(self, design: Design) -> None:
        """Make the struts whose loss costs most constraints."""
        if self.largest_loss is not None:
            near = self._near_losses(design)
            self.lost += [beam for beam in near if beam not in self.lost][:ADDED]


def _scenarios(design: Design, tolerances: Tolerances, prints: int) -> list[Scenario]:
    """Return the scenarios of tolerances, without the nominal one."""
    deviations = Deviations(
        tolerances=tolerances, width=0.0, thin=0.0, shortest=1.0, longest=1.0, prints=prints,
        struts=False, seed=SEED,
    )  # fmt: skip
    return scenarios_of(design.problem, design.mask, deviations)[1:]


def _largest_loss(wanted: Specification) -> float | None:
    """Return the largest part of the efficiency that the loss of a strut may cost."""
    bounds = [item.at_most for item in wanted.items if item.quantity == "strut_loss"]
    return min((bound for bound in bounds if bound is not None), default=None)


def _objective(result: ScenarioResult, scales: Sequence[float]) -> float:
    """Return the smallest objective, or margin without any; minus infinity if the path is lost."""
    if not result.is_stable:
        return -math.inf
    if result.reserve is not None:
        return math.inf  # that of the design as drawn counts
    if not scales:
        return result.margin
    return min(value / scale for value, scale in zip(result.objectives, scales, strict=True))
