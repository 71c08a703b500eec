"""Refinement of designs, corrected by frames with more elements."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import VERIFICATION_INCREMENT, item_results, tightened
from bellcrank.mechanics.frames.joints import with_joints
from bellcrank.model import Item
from bellcrank.refine.default_specification import specified
from bellcrank.refine.differences import NO_DIFFERENCE, difference
from bellcrank.refine.refinement import UNSTABLE, RefinementSettings, refine_rows
from bellcrank.refine.rows import STABLE, RowEvaluator
from bellcrank.refine.shape import volume_of
from bellcrank.refine.state import (
    State,
    is_better,
    latest_met,
    loses_payload,
    state_of,
    total_violation,
)
from bellcrank.refine.variables import variables_of
from bellcrank.search import SpecificationEvaluator

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.model import Design, Problem
    from bellcrank.refine.differences import Difference, Records
    from bellcrank.refine.refinement import Progress

    Sheet = Callable[[Design], Records | None]
    Models = tuple[Difference, ...]

RESERVE = 0.05
"""Part of their size by which bounds are tightened, so that more elements and the sheet meet them
too."""
RESERVES = {"mass": 2e-3, "payload": 0.2}
"""The same for the mass, that of all models (more than `MET`), and for the payload: near the
largest one that a part carries, its motion is lost at once."""
LOST_PAYLOAD = 3.0
"""Factor of the payload of one element in each strut where better models lose their path under
it."""
SHEETS = 6
"""Largest number of geometries that are computed in the sheet: each load case takes up to a
minute."""
SHEET_CASES = 8
"""Largest number of load cases of these geometries, of which there are at least two."""
REPAIR_REGION = 0.25
"""Trust regions of refinements that are corrected by the sheet, over those of others."""
SHEET_STEPS = 40
"""Largest number of steps after the sheet misses items; fewer if the corrected items are met."""
PROGRESS = 0.9
"""Ratio of the violations by frames of two geometries above which the sheet is given up."""
HALVINGS = 2
"""Number of times the path of a refinement that is not near the sheet is halved."""
MET = 1e-3
"""Sum of violations at which they are."""
AMPLE = 0.25
"""Margin at which a specification without objectives is met: a part of the size of each bound.
Larger margins by frames are lost in the sheet, since geometries with large margins by frames have
large differences."""
ROUNDS = 3
"""Number of times a design is refined, each corrected by the result of the one before."""


@dataclass(frozen=True, slots=True, eq=False)
class Refinement:
    """A refined design.

    Parameters
    ----------
    design
        The design, whose problem has the positions and widths.
    before, after
        States of the given design and of this one.
    steps, evaluations
        Number of accepted steps and of evaluated geometries.
    sheets
        Number of geometries made for the sheet; those that miss items by frames are not computed
        there.
    reason
        Why the refinement ended.
    improved
        Whether a better geometry was found; else `design` is the given one.
    """

    design: Design
    before: State
    after: State
    steps: int
    evaluations: int
    sheets: int
    reason: str
    improved: bool


def refine_design(
    design: Design,
    settings: RefinementSettings | None = None,
    report: Callable[[Progress], bool] = lambda _progress: True,
    strain_limit: float = math.nan,
    sheet: Sheet | None = None,
) -> Refinement:
    """Move the nodes of a design, and change the widths of its struts, to meet its specification.

    The result is verified by frames with eight elements in each strut, and in the sheet if it is
    given. Where it misses items there that the model of the refinement meets, its channels are
    corrected by the difference and the design is refined again. A result that is no better than
    the given design is discarded.

    Parameters
    ----------
    design
        A design of a frame.
    settings
        Settings of the refinement.
    report
        Called with each accepted step; the refinement stops if it returns False.
    strain_limit
        Largest strain for a problem without a specification.
    sheet
        Function from a design to its channels in the sheet by load case, None where it is not
        stable; in space to those of another model, such as one with imperfections.

    Raises
    ------
    InvalidSettings
        If the design has no section.
    """
    settings = settings or RefinementSettings()
    problem = design.problem
    if problem.section is None:
        raise InvalidSettings(
            f"problem {problem.name!r}: expected a frame; designs of springs are not refined"
        )
    wanted = with_joints(specified(problem, strain_limit), design.mask)
    given = replace(
        design, problem=_with_mass(wanted, design.mask) if settings.same_mass else wanted
    )
    job = _Job(given, settings, report)
    job.by_frames()
    if sheet is not None and job.goes_on:
        job.by_sheet(sheet)
    refined = design
    improved = bool(job.chosen.any())
    if improved:
        at = job.variables.problem_at(job.chosen)
        moved_problem = problem.with_geometry(at.lattice.positions, at.widths)
        refined = replace(design, problem=with_joints(moved_problem, design.mask))
    return Refinement(
        design=refined,
        before=job.before,
        after=job.best,
        steps=job.steps,
        evaluations=job.evaluations,
        sheets=job.sheets,
        reason=job.reason,
        improved=improved,
    )


def _with_mass(problem: Problem, mask: NDArray[np.bool_]) -> Problem:
    """Return a problem whose specification limits the mass to that of a design."""
    wanted = problem.specification
    assert wanted is not None
    item = Item(
        quantity="mass", case=next(iter(problem.cases)), at_most=volume_of(problem, mask)[0]
    )
    return replace(problem, specification=replace(wanted, items=(*wanted.items, item)))


def _stricter(stable: float) -> float:
    """Return a larger bound of the lowest stiffness, over its reference; less than 1."""
    return 0.5 * (1.0 + stable)


class _Job:
    """Refinements of one design, each corrected by the result of the one before."""

    def __init__(
        self,
        design: Design,
        settings: RefinementSettings,
        report: Callable[[Progress], bool],
    ) -> None:
        self.design, self.settings, self.report = design, settings, report
        problem = design.problem
        assert problem.section is not None
        assert problem.specification is not None
        self.items = problem.specification.items
        width = problem.section.width
        bounds = (settings.narrowest * width, settings.widest * width)
        self.variables = variables_of(design, settings.largest_move, bounds)
        self.before = self.best = state_of(problem, design.mask)
        self.chosen = np.zeros(self.variables.count)
        self.path = self.tried = [self.chosen]
        self.stable = STABLE
        self.payload = 1.0
        self.steps = self.evaluations = self.sheets = 0
        self.reason = "the response of the design is not stable"
        self.goes_on = True

    def by_frames(self) -> None:
        """Refine until all items are met with eight elements."""
        vector, stable = self.chosen, STABLE
        path: list[NDArray[np.float64]] = []
        models: Models = (NO_DIFFERENCE,)
        for _ in range(ROUNDS):
            least = self.settings.evaluations // 4
            found = self._refined(vector, models, stable, self.settings.steps, least)
            if found is None:
                return
            state, vector, is_last = found
            path = [*path, *self.tried]
            if is_better(state, self.best):
                self.best, self.chosen = state, vector
                self.path, self.stable = path, stable
            is_last = is_last or self.evaluations >= self.settings.evaluations
            is_edge = self.reason == UNSTABLE and self.evaluations < self.settings.evaluations
            if not state.items or not self.goes_on or (state.met and is_last and not is_edge):
                return
            if state.is_stable and not state.met:
                self.payload, models = 1.0, self._models(vector, state.records)
            elif loses_payload(state.items):
                self.payload *= LOST_PAYLOAD
            else:
                # Eight elements lose their stability, or touch, before one element does.
                stable = _stricter(stable)

    def by_sheet(self, sheet: Sheet) -> None:
        """Refine until all items are met in the sheet too; keeps the best in the sheet.

        If no refined geometry is near the sheet, the given design is kept if it is.
        """
        if not self.best.met:
            return
        self.best = self._in_sheet(sheet, self.chosen, self.best)
        if not self.best.is_near_sheet:
            self.chosen, self.best = self._earlier(sheet, self.chosen, self.best)
        self._repair(sheet)
        if self.goes_on and self.before.met and not self.best.is_near_sheet and self.chosen.any():
            start = np.zeros_like(self.chosen)
            given = self._in_sheet(sheet, start, self.before)
            if given.is_near_sheet:
                self.best, self.chosen = given, start
                self.reason = "in the sheet, all better geometries are on other paths"

    def _repair(self, sheet: Sheet) -> None:
        """Refine with the differences from the sheet until all items are met in it."""
        vector, state = self.chosen, self.best
        models: Models = (NO_DIFFERENCE,)
        stable, missed, earlier = self.stable, math.inf, False
        most = min(SHEETS, max(2, SHEET_CASES // len(self.design.problem.cases)))
        while self.goes_on and self.sheets < most and state.missed_in_sheet > 0.0:
            if state.is_on_path_of_sheet:
                self.payload = 1.0
                models = self._models(vector, state.records, state.sheet_records)
            elif state.is_stable and not state.met:
                models = (*self._models(vector, state.records), *models[1:])
            elif loses_payload(state.items) or loses_payload(state.sheet):
                self.payload *= LOST_PAYLOAD
            else:
                stable = _stricter(stable)
            found = self._refined(
                vector, models, stable, SHEET_STEPS, 4 * SHEET_STEPS, by_sheet=True
            )
            if found is None or not found[0].items:
                return
            state, refined, _ = found
            is_same, vector = np.array_equal(refined, vector), refined
            if is_same and not earlier:
                # No step helps from here.
                earlier = True
                vector, state = self._earlier(sheet, vector, state)
                self._keep_better(vector, state)
                continue
            if not state.met:
                # Frames and the sheet differ by more than both bounds of an item allow.
                if total_violation(state.items) > PROGRESS * missed:
                    return
                self.sheets, missed = self.sheets + 1, total_violation(state.items)
            elif is_same:
                return
            elif self.goes_on:
                state = self._in_sheet(sheet, vector, state)
                self._keep_better(vector, state)

    def _keep_better(self, vector: NDArray[np.float64], state: State) -> None:
        """Make a geometry the best one if it is nearer to meeting all items in the sheet."""
        if state.met and state.rank_in_sheet < self.best.rank_in_sheet:
            self.best, self.chosen = state, vector

    def _earlier(
        self, sheet: Sheet, vector: NDArray[np.float64], state: State
    ) -> tuple[NDArray[np.float64], State]:
        """Return a geometry on the path of the refinement that is near the sheet, by halving.

        The given one if there is none among a few.
        """
        low, high = 0, len(self.path) - 1
        for _ in range(HALVINGS):
            middle = (low + high) // 2
            if not self.goes_on or middle == low:
                break
            found = state_of(self.variables.problem_at(self.path[middle]), self.design.mask)
            if not found.met:
                low = middle
                continue
            found = self._in_sheet(sheet, self.path[middle], found)
            if found.is_near_sheet:
                return self.path[middle], found
            high = middle
        return vector, state

    def _refined(
        self,
        vector: NDArray[np.float64],
        models: Models,
        stable: float,
        steps: int,
        least: int,
        *,
        by_sheet: bool = False,
    ) -> tuple[State, NDArray[np.float64], bool] | None:
        """Refine until all items are met in all given models; ends there if one is the sheet.

        Returns
        -------
        tuple of State, (n,) and bool, or None
            State and vector of the last geometry that meets all with eight elements, and whether
            it is the last one of all. None if the response is not stable.
        """
        items = [self._tightened(item) for item in self.items]
        rows = RowEvaluator(self.variables, self.design.mask, items, stable, models)
        left = replace(
            self.settings,
            steps=steps,
            evaluations=max(least, self.settings.evaluations - self.evaluations),
        )
        if by_sheet:
            # Differences of models hold near the geometry that they were computed for.
            left = replace(
                left,
                first_region=REPAIR_REGION * left.first_region,
                largest_region=REPAIR_REGION * left.largest_region,
            )
        path = []
        for progress in refine_rows(rows, left, vector):
            path.append(progress)
            self.goes_on = self.report(progress)
            is_met = progress.rows.violation < MET
            if not self.goes_on or (is_met and (by_sheet or self._is_ample(progress))):
                break
        if not path:
            return None
        last = path[-1]
        self.reason = last.reason or ("stopped" if not self.goes_on else "all items are met")
        self.steps, self.evaluations = self.steps + last.step, self.evaluations + last.evaluations
        vectors = [each.vector for each in path]
        state, number = latest_met(self.variables, self.design.mask, vectors)
        self.tried = vectors[: number + 1]
        return state, vectors[number], number == len(vectors) - 1

    def _tightened(self, item: Item) -> Item:
        """Return an item as the model of the refinement has to meet it."""
        tight = tightened(item, RESERVES.get(item.quantity, RESERVE))
        if item.quantity != "payload" or tight.at_least is None:
            return tight
        return replace(tight, at_least=self.payload * tight.at_least)

    def _is_ample(self, progress: Progress) -> bool:
        """Whether there is no objective, and the smallest margin is large."""
        wanted = self.design.problem.specification
        assert wanted is not None
        return not wanted.maximise and progress.rows.objective > AMPLE

    def _models(self, vector: NDArray[np.float64], *better: Records) -> Models:
        """Return the differences of better models from one element in each strut."""
        evaluator = SpecificationEvaluator(self.variables.problem_at(vector))
        if not evaluator.evaluate(self.design.mask, VERIFICATION_INCREMENT).is_admissible:
            return (NO_DIFFERENCE,)
        gaps = {
            item.case: item.at_least or 0.0 for item in self.items if item.quantity == "clearance"
        }
        return tuple(difference(records, evaluator.records, gaps) for records in better)

    def _in_sheet(self, sheet: Sheet, vector: NDArray[np.float64], state: State) -> State:
        self.sheets += 1
        problem = self.variables.problem_at(vector)
        records = sheet(replace(self.design, problem=problem))
        if records is None:
            return state
        items = tuple(item_results(self.items, records))
        return replace(state, sheet=items, sheet_records=records)
