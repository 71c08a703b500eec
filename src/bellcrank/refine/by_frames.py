"""Refinement of a design until frames with eight elements in each strut meet its specification."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import VERIFICATION_INCREMENT, tightened
from bellcrank.model import CARRIED
from bellcrank.refine.active import ActiveRows
from bellcrank.refine.choice import ScenarioChoice
from bellcrank.refine.differences import NO_DIFFERENCE, difference
from bellcrank.refine.refinement import UNSTABLE, RefinementSettings, refine_rows
from bellcrank.refine.row_evaluator import STABLE, RowEvaluator
from bellcrank.refine.scenarios import KeptRows, ScenarioRows
from bellcrank.refine.state import State, is_better, latest_met, loses_payload, state_of
from bellcrank.refine.variables import variables_of
from bellcrank.search import SpecificationEvaluator

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Design, Item
    from bellcrank.refine.differences import Difference, Records
    from bellcrank.refine.refinement import Progress
    from bellcrank.tolerance import Scenario

    Values = NDArray[np.float64]
    Models = tuple[Difference, ...]

RESERVE = 0.05
"""Part of their size by which bounds are tightened, so that more elements and the sheet meet them
too."""
RESERVES = {"mass": 2e-3, **dict.fromkeys(CARRIED, 0.2)}
"""The same for the mass, that of all models (more than `MET`), and for the payload: near the
largest one that a part carries, its motion is lost at once."""
LOST_PAYLOAD = 3.0
"""Factor of the payload of one element in each strut where better models lose their path under
it."""
REPAIR_REGION = 0.25
"""Trust regions of refinements that are corrected by the sheet, over those of others."""
MET = 1e-3
"""Sum of violations at which they are."""
REDUCED_STEPS = 8
"""Number of steps towards scenarios that the geometry is not near meeting, before they are chosen
again."""
AMPLE = 0.25
"""Margin at which a specification without objectives is met: a part of the size of each bound.
Larger margins by frames are lost in the sheet, since geometries with large margins by frames have
large differences."""
ROUNDS = 3
"""Number of times a design is refined, each corrected by the result of the one before."""
SCENARIO_ROUNDS = 20
"""Number of further times over scenarios."""
GROWTH = 0.01
"""Part of the objective by which it has to grow in one of these times for the next."""


def stricter(stable: float) -> float:
    """Return a larger bound of the lowest stiffness, over its reference; less than 1."""
    return 0.5 * (1.0 + stable)


class FrameRefinement:
    """Refinements of one design, each corrected by the result of the one before.

    Attributes
    ----------
    before, best
        States of the given design, and of the best geometry.
    chosen : (n,)
        Variables of the best geometry.
    path
        Variables of the geometries that led to it.
    stable
        Bound of the lowest stiffness, over its reference, with which it was found.
    payload
        Factor of the payload that one element in each strut has to carry.
    latest
        The progress that was reported last.
    """

    def __init__(
        self,
        design: Design,
        settings: RefinementSettings,
        report: Callable[[Progress], None],
    ) -> None:
        self.design, self.settings, self.report = design, settings, report
        problem = design.problem
        assert problem.section is not None
        assert problem.specification is not None
        self.items = problem.specification.items
        width = problem.section.width
        bounds = (settings.narrowest * width, settings.widest * width)
        self.variables = variables_of(design, settings.largest_move, bounds)
        self.choice = ScenarioChoice(design, settings.prints)
        self.chosen = np.zeros(self.variables.count)
        self.is_reduced = False
        self.before = self.best = self.state_at(self.chosen)
        self.path = self.tried = [self.chosen]
        self.stable = STABLE
        self.payload = 1.0
        self.steps = self.evaluations = 0
        self.reason = "the response of the design is not stable"
        self.latest: Progress | None = None

    def run(self) -> None:
        """Refine until all items are met with eight elements."""
        vector, stable = self.chosen, STABLE if self.choice.is_empty else stricter(STABLE)
        path: list[Values] = []
        models: Models = (NO_DIFFERENCE,)
        rounds = scenario_rounds = 0
        while rounds < ROUNDS and scenario_rounds < SCENARIO_ROUNDS:
            least = self.settings.evaluations // 4
            found = self.refined(vector, models, stable, self.settings.steps, least)
            if found is None:
                return
            state, vector, is_last = found
            is_repeated = self._is_repeated(state)
            scenario_rounds += is_repeated
            rounds += not is_repeated
            path = [*path, *self.tried]
            if is_better(state, self.best):
                self.best, self.chosen = state, vector
                self.path, self.stable = path, stable
            is_spent = self.evaluations >= self.settings.evaluations
            is_edge = self.reason == UNSTABLE and not is_spent
            if not state.items or (is_repeated and is_spent):
                return
            if state.met and is_repeated:
                continue
            if state.met and (is_last or is_spent) and not is_edge:
                return
            if state.is_stable and not state.met:
                self.payload, models = 1.0, self.models(vector, state.records)
            elif loses_payload(state.items):
                self.payload *= LOST_PAYLOAD
            else:
                # Eight elements lose their stability, or touch, before one element does.
                stable = stricter(stable)

    def refined(
        self,
        vector: Values,
        models: Models,
        stable: float,
        steps: int,
        least: int,
        *,
        near: bool = False,
    ) -> tuple[State, Values, bool] | None:
        """Refine until all items are met in all given models.

        With `near`, by small steps, and only until they are met.

        Returns
        -------
        tuple of State, (n,) and bool, or None
            State and vector of the last geometry that meets all with eight elements, and whether
            it is the last one of all. None if the response is not stable.
        """
        items = [self._tightened(each) for each in self.items if each.quantity != "strut_loss"]
        evaluator = self._start(items, stable, models, vector)
        evaluations = max(least, self.settings.evaluations - self.evaluations)
        if self.is_reduced:
            steps = min(steps, REDUCED_STEPS)
        left = replace(self.settings, steps=steps, evaluations=evaluations)
        if near:
            # Differences of models hold near the geometry that they were computed for.
            left = replace(
                left,
                first_region=REPAIR_REGION * left.first_region,
                largest_region=REPAIR_REGION * left.largest_region,
            )
        last: Progress | None = None
        vectors: list[Values] = []
        for progress in refine_rows(evaluator, left, vector):
            # The rows of earlier steps would take gigabytes over tolerances.
            last = progress
            vectors.append(progress.vector)
            self.report_progress(progress)
            is_met = progress.rows.violation < MET
            if is_met and (near or self._is_ample(progress)):
                break
        if last is None:
            return None
        self.reason = last.reason or "all items are met"
        self.steps, self.evaluations = self.steps + last.step, self.evaluations + last.evaluations
        state, number = latest_met(
            lambda k: state_of(self.variables.problem_at(vectors[k]), self.design.mask),
            len(vectors),
        )
        self.tried = vectors[: number + 1]
        state = self._with_robustness(state, vectors[number])
        return state, vectors[number], number == len(vectors) - 1

    def report_progress(self, progress: Progress) -> None:
        """Report progress with the number of all geometries so far, and the design."""
        self.latest = replace(
            progress,
            evaluations=self.evaluations + progress.evaluations,
            design=self._design_at(progress.vector),
        )
        self.report(self.latest)

    def report_sheet(self, sheets: int) -> None:
        """Report that the sheet is being computed."""
        if self.latest is not None:
            self.report(replace(self.latest, sheets=sheets))

    def _start(
        self, items: Sequence[Item], stable: float, models: Models, vector: Values
    ) -> ScenarioRows:
        """Return rows as drawn and in the chosen scenarios.

        Scenarios that the geometry is far from meeting have a part of their deviations.
        """
        # A path that is stable under a larger payload may not be so under the given one.
        payloads = {each.name: each for each in self.items if each.quantity in CARRIED}
        in_scenarios = [payloads.get(each.name, each) for each in items]

        of_design = self.variables, self.design.mask
        drawn = RowEvaluator(*of_design, items, stable, models)

        def rows_of(scenario: Scenario) -> RowEvaluator | KeptRows:
            least = self.choice.least_kept(scenario)
            if least is not None:
                return KeptRows(*of_design, least, scenario)
            return RowEvaluator(*of_design, in_scenarios, stable, models, scenario)

        if self.choice.is_empty:
            return ScenarioRows(drawn, [])
        rows = ActiveRows(self.choice, drawn, rows_of, self._design_at, vector)
        self.is_reduced = rows.is_reduced
        return rows

    def _is_repeated(self, state: State) -> bool:
        """Whether, over scenarios, the design is to be refined again from a state."""
        if self.choice.is_empty:
            return False
        tolerances = self.choice.tolerances
        is_short = tolerances is not None and state.share < tolerances.least_yield
        if self.is_reduced or is_short:
            return len(self.tried) > 1
        # Steps get too small at kinks between scenarios; another time begins with large ones.
        return state.objective - self.best.objective > GROWTH * abs(state.objective)

    def state_at(self, vector: Values) -> State:
        """Return the state of a geometry."""
        state = state_of(self.variables.problem_at(vector), self.design.mask)
        return self._with_robustness(state, vector)

    def _with_robustness(self, state: State, vector: Values) -> State:
        """Return a state with its robustness."""
        if self.choice.tolerances is None or not state.is_stable:
            return state
        found = self.choice.robustness(self._design_at(vector))
        if self.choice.tolerances.keep:
            return replace(state, share=found.share)
        return replace(state, share=found.share, objective=found.objective)

    def _design_at(self, vector: Values) -> Design:
        """Return the design with the geometry of a vector."""
        return replace(self.design, problem=self.variables.problem_at(vector))

    def _tightened(self, item: Item) -> Item:
        """Return an item as the model of the refinement has to meet it."""
        tight = tightened(item, RESERVES.get(item.quantity, RESERVE))
        if item.quantity == "mass" and tight.at_most is not None:
            # The shape is that of the part as drawn alone; wider struts are heavier.
            return replace(tight, at_most=tight.at_most / self.choice.largest_area)
        if item.quantity not in CARRIED or tight.at_least is None:
            return tight
        return replace(tight, at_least=self.payload * tight.at_least)

    def _is_ample(self, progress: Progress) -> bool:
        """Whether there is no objective, and the smallest margin is large."""
        wanted = self.design.problem.specification
        assert wanted is not None
        return not wanted.maximise and progress.rows.objective > AMPLE

    def models(self, vector: Values, *better: Records) -> Models:
        """Return the differences of better models from one element in each strut."""
        evaluator = SpecificationEvaluator(self.variables.problem_at(vector))
        if not evaluator.evaluate(self.design.mask, VERIFICATION_INCREMENT).is_admissible:
            return (NO_DIFFERENCE,)
        gaps = {
            item.case: item.at_least or 0.0 for item in self.items if item.quantity == "clearance"
        }
        return tuple(difference(records, evaluator.records, gaps) for records in better)
