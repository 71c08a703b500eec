"""Refinement of a design until the sheet meets its specification too."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import item_results
from bellcrank.mechanics.items import tightened
from bellcrank.refine.by_frames import LOST_PAYLOAD, stricter
from bellcrank.refine.differences import NO_DIFFERENCE
from bellcrank.refine.state import State, loses_payload, total_violation

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.model import Design, Item
    from bellcrank.refine.by_frames import FrameRefinement, Models
    from bellcrank.refine.differences import Records

    Sheet = Callable[[Design], Records | None]
    Values = NDArray[np.float64]

SHEETS = 6
"""Largest number of geometries that are computed in the sheet: each load case takes up to a
minute."""
SHEET_CASES = 8
"""Largest number of load cases of these geometries, of which there are at least two."""
SHEET_STEPS = 40
"""Largest number of steps after the sheet misses items; fewer if the corrected items are met."""
PROGRESS = 0.9
"""Ratio of the violations by frames of two geometries above which the sheet is given up."""
SHEET_RESERVE = 0.04
"""Part by which items with two bounds are tightened, so that finer meshes of the sheet meet them
too; less than the reserve of the frames, at which a refinement aims."""
HALVINGS = 2
"""Number of times the path of a refinement that is not near the sheet is halved."""


class SheetRefinement:
    """The continuation of a refinement by frames, with the sheet.

    Parameters
    ----------
    job
        The refinement by frames, whose best geometry is replaced.
    sheet
        Function from a design to its channels in the sheet by load case, None where it is not
        stable.
    """

    def __init__(self, job: FrameRefinement, sheet: Sheet) -> None:
        self.job, self.sheet, self.sheets = job, sheet, 0

    def run(self) -> None:
        """Refine until all items are met in the sheet too; keeps the best in the sheet.

        If no refined geometry is near the sheet, or those that are have a lower yield, the given
        design is kept if it is near the sheet.
        """
        job = self.job
        if not job.best.met:
            return
        job.best = self._in_sheet(job.chosen, job.best)
        if not job.best.is_near_sheet:
            job.chosen, job.best = self._earlier(job.chosen, job.best)
        self._repair()
        is_worse = not job.best.is_near_sheet or job.best.share < job.before.share
        if job.before.met and is_worse and job.chosen.any():
            start = np.zeros_like(job.chosen)
            given = self._in_sheet(start, job.before)
            if given.is_near_sheet:
                others = "have a lower yield" if job.best.is_near_sheet else "are on other paths"
                job.best, job.chosen = given, start
                job.reason = f"in the sheet, all better geometries {others}"

    def _repair(self) -> None:
        """Refine with the differences from the sheet until all items are met in it."""
        job = self.job
        vector, state = job.chosen, job.best
        models: Models = (NO_DIFFERENCE,)
        stable, missed, earlier = job.stable, math.inf, False
        most = min(SHEETS, max(2, SHEET_CASES // len(job.design.problem.cases)))
        while self.sheets < most and state.missed_in_sheet > 0.0:
            if state.is_on_path_of_sheet:
                job.payload = 1.0
                models = job.models(vector, state.records, state.sheet_records)
            elif state.is_stable and not state.met:
                models = (*job.models(vector, state.records), *models[1:])
            elif loses_payload(state.items) or loses_payload(state.sheet):
                job.payload *= LOST_PAYLOAD
            else:
                stable = stricter(stable)
            found = job.refined(vector, models, stable, SHEET_STEPS, 4 * SHEET_STEPS, near=True)
            if found is None or not found[0].items:
                return
            state, refined, _ = found
            is_same, vector = np.array_equal(refined, vector), refined
            if is_same and not earlier:
                # No step helps from here.
                earlier = True
                vector, state = self._earlier(vector, state)
                self._keep_better(vector, state)
                continue
            if not state.met:
                # Frames and the sheet differ by more than both bounds of an item allow.
                if total_violation(state.items) > PROGRESS * missed:
                    return
                self.sheets, missed = self.sheets + 1, total_violation(state.items)
            elif is_same:
                return
            else:
                state = self._in_sheet(vector, state)
                self._keep_better(vector, state)

    def _keep_better(self, vector: Values, state: State) -> None:
        """Make a geometry the best one if it is nearer to meeting all items in the sheet."""
        job = self.job
        if state.met and state.rank_in_sheet < job.best.rank_in_sheet:
            job.best, job.chosen = state, vector

    def _earlier(self, vector: Values, state: State) -> tuple[Values, State]:
        """Return a geometry on the path of the refinement that is near the sheet, by halving.

        The given one if there is none among a few.
        """
        job = self.job
        low, high = 0, len(job.path) - 1
        for _ in range(HALVINGS):
            middle = (low + high) // 2
            if middle == low:
                break
            found = job.state_at(job.path[middle])
            if not found.met:
                low = middle
                continue
            found = self._in_sheet(job.path[middle], found)
            if found.is_near_sheet:
                return job.path[middle], found
            high = middle
        return vector, state

    def _in_sheet(self, vector: Values, state: State) -> State:
        """Return the state of a geometry with its items in the sheet, if it is stable there."""
        job = self.job
        self.sheets += 1
        job.report_sheet(self.sheets)
        problem = job.variables.problem_at(vector)
        records = self.sheet(replace(job.design, problem=problem))
        if records is None:
            return state
        items = tuple(item_results(job.items, records))
        strict = item_results([_with_reserve(each) for each in job.items], records)
        violation = total_violation(tuple(strict))
        return replace(state, sheet=items, sheet_records=records, sheet_violation=violation)


def _with_reserve(item: Item) -> Item:
    """Return an item with two bounds as a coarse mesh has to meet it; others as they are."""
    is_two_sided = item.at_least is not None and item.at_most is not None
    return tightened(item, SHEET_RESERVE) if is_two_sided else item
