"""Rows of the active scenarios: those that a geometry is near missing, chosen as it changes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.refine.scenarios import NEAR, ScenarioRows, Update, reduced_rows
from bellcrank.tolerance import Scenario

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.model import Design
    from bellcrank.refine.choice import Outcome, ScenarioChoice
    from bellcrank.refine.row_evaluator import RowEvaluator
    from bellcrank.refine.rows import Rows
    from bellcrank.refine.scenarios import Part

    Values = NDArray[np.float64]

FAR = 0.25
"""Violation of an item of a scenario that is far from being met."""
NEARLY = 0.02
"""Part of the smallest objective by which that of a scenario may be less before it becomes a
constraint."""
ROOM = 0.1
"""Margin of all constraints, and distance from the smallest objective, above which a scenario is no
longer a constraint."""
REDUCED = 6
"""Largest number of random prints that are constraints with parts of their deviations."""


class ActiveRows(ScenarioRows):
    """Rows as drawn and in those scenarios, of many, that a geometry is near missing.

    Scenarios that the first geometry is far from meeting have a part of their deviations. If there
    are any, the smallest margin is the objective.

    Parameters
    ----------
    choice
        The scenarios.
    drawn
        Rows of the design as drawn.
    rows_of
        Function to the rows of a scenario, such as a lost strut.
    design_at
        Function from variables to a design.
    vector : (n,)
        The first geometry.
    """

    def __init__(
        self,
        choice: ScenarioChoice,
        drawn: RowEvaluator,
        rows_of: Callable[[Scenario], Part],
        design_at: Callable[[Values], Design],
        vector: Values,
    ) -> None:
        self.choice, self.design_at = choice, design_at
        self._rows_of = rows_of
        self._scenarios: dict[int, Part] = {}
        self._losses: dict[int, Part] = {}
        self._accepted = vector
        outcomes = sorted(self._outcomes(vector), key=lambda each: each.margin)
        far = [each.scenario for each in outcomes if each.margin < -FAR]
        self._far = {id(each) for each in far}
        extreme = [each for each in far if each.kind != "print"]
        self.is_reduced = bool(extreme) or len(far) > choice.allowed
        if self.is_reduced:
            drawn.maximise_margins()
        super().__init__(drawn, [])
        self._reduced: list[Part] = []
        now = drawn.evaluate(vector)
        if self.is_reduced and now is not None and now.violation <= NEAR:
            prints = [each for each in far if each.kind == "print"][:REDUCED]
            found = [reduced_rows(self._new_rows, each, vector) for each in (*extreme, *prints)]
            self._reduced = [each for each in found if each is not None]
        choice.chosen = [
            each
            for each in choice.chosen
            if id(each) not in self._far and self._rows_in(each).evaluate(vector) is not None
        ]
        choice.lost = [
            beam for beam in choice.lost if self._loss_rows(beam).evaluate(vector) is not None
        ]
        self._choose_near(outcomes, vector)

    def update(self, vector: Values) -> Update:
        """Choose the scenarios again: those that the geometry misses, and those that bound it.

        Where it is far from meeting one that was near at the last call, the geometry of that call
        is `Update.back`.
        """
        before = self.share
        outcomes = self._outcomes(vector)
        far = {id(each.scenario) for each in outcomes if each.margin < -FAR}
        is_back = not far <= self._far and len(far) > self.choice.allowed
        if is_back:
            self.share = before
        else:
            self._far, self._accepted = far, vector
        is_changed = self._choose_near(outcomes, vector)
        return Update(is_changed=is_changed, back=self._accepted if is_back else None)

    def _outcomes(self, vector: Values) -> list[Outcome]:
        """Return what a geometry does in each candidate."""
        outcomes = self.choice.outcomes(self.design_at(vector), self.choice.candidates)
        prints = [each.met for each in outcomes if each.scenario.kind == "print"]
        if prints:
            assert self.choice.tolerances is not None
            self.share = min(sum(prints) / len(prints), self.choice.tolerances.least_yield)
        return outcomes

    def _choose_near(self, outcomes: Sequence[Outcome], vector: Values) -> bool:
        """Choose the scenarios that are near, and lost struts; whether others than before."""
        choice = self.choice
        before = [*choice.chosen], [*choice.lost]
        choice.chosen = self._without_room(vector)
        chosen = {id(each) for each in choice.chosen}
        bounds = [each.objective for each in outcomes if id(each.scenario) in chosen]
        smallest = min(bounds, default=math.inf)
        room = {id(each): _room(each, smallest) for each in outcomes}
        near = [
            each for each in outcomes if id(each.scenario) not in self._far and room[id(each)] < 0.0
        ]
        choice.add(sorted(near, key=lambda each: room[id(each)]))
        choice.add_losses(self.design_at(vector))
        # A scenario whose path is lost, by increments of another size, cannot be a constraint.
        choice.chosen = [
            each
            for each in choice.chosen
            if id(each) in chosen or self._rows_in(each).evaluate(self._accepted) is not None
        ]
        choice.lost = [
            beam
            for beam in choice.lost
            if beam in before[1] or self._loss_rows(beam).evaluate(self._accepted) is not None
        ]
        self.replace_others(
            [
                *self._reduced,
                *(self._rows_in(each) for each in choice.chosen),
                *(self._loss_rows(beam) for beam in choice.lost),
            ]
        )
        return before != (choice.chosen, choice.lost)

    def _without_room(self, vector: Values) -> list[Scenario]:
        """Return the chosen scenarios without those that the geometry meets with room.

        Those remain whose objectives are near the smallest.
        """
        rows = [(each, self._rows_in(each).evaluate(vector)) for each in self.choice.chosen]
        least = min((_objective(found) for _, found in rows if found is not None), default=0.0)
        bound = least + ROOM * max(abs(least), 0.1) if math.isfinite(least) else -math.inf
        return [
            each
            for each, found in rows
            if found is None
            or found.constraints.max(initial=-math.inf) > -ROOM
            or _objective(found) < bound
        ]

    def _new_rows(self, scenario: Scenario) -> Part:
        """Return new rows of a scenario."""
        rows = self._rows_of(scenario)
        if self.is_reduced:
            rows.maximise_margins()
        return rows

    def _rows_in(self, scenario: Scenario) -> Part:
        """Return the rows of a scenario."""
        if id(scenario) not in self._scenarios:
            self._scenarios[id(scenario)] = self._new_rows(scenario)
        return self._scenarios[id(scenario)]

    def _loss_rows(self, beam: int) -> Part:
        """Return the constraint on a lost strut."""
        if beam not in self._losses:
            self._losses[beam] = self._rows_of(Scenario(name="", kind="strut", missing=beam))
        return self._losses[beam]


def _objective(rows: Rows) -> float:
    """Return the smallest objective; infinity without any."""
    return rows.objective if len(rows.objectives) else math.inf


def _room(outcome: Outcome, smallest: float) -> float:
    """Return the margin of a scenario, or how far its objective is above the smallest one."""
    above = (outcome.objective - smallest) / max(abs(smallest), 0.1) + NEARLY
    return min(outcome.margin, above if math.isfinite(smallest) else math.inf)
