"""Refinement of a design that is in a file."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import TYPE_CHECKING

from bellcrank.provenance import provenance
from bellcrank.refine import Refinement, RefinementSettings
from bellcrank.refine.by_frames import MET
from bellcrank.refine.design import with_geometry_of
from bellcrank.refine.reached import share_of
from bellcrank.refine.state import State, is_better, latest_met, state_of
from bellcrank.search import specified
from bellcrank.workflows.refinement import refinement_data
from bellcrank.workflows.refiners import refine_designs
from bellcrank.workflows.validation import spec_for

if TYPE_CHECKING:
    from collections.abc import Callable

    from bellcrank.model import Design
    from bellcrank.refine.refinement import Progress


HALVINGS = 2
"""Number of times the path of a stopped refinement is halved to find a geometry that meets all
items with eight elements."""


class FileRefinement:
    """The refinement of a design for the part that its file names, in a process of its own.

    Parameters
    ----------
    design
        A design of a frame.
    settings
        Settings of the refinement.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> from bellcrank.part import PartSpec, frame_problem
    >>> design = human_design("crane")
    >>> design = replace(design, problem=frame_problem(design.problem, PartSpec()))
    >>> refinement = FileRefinement(design, RefinementSettings(steps=2))
    >>> found = refinement.run()
    >>> found.improved, "refinement" in found.design.provenance
    (True, True)
    """

    def __init__(self, design: Design, settings: RefinementSettings) -> None:
        self.design, self.settings = design, settings
        self._spec = spec_for(design)
        self._path: list[Progress] = []

    def run(
        self,
        report: Callable[[Progress], None] = lambda _progress: None,
        stop: threading.Event | None = None,
    ) -> Refinement | None:
        """Refine the design; None if it is stopped.

        Parameters
        ----------
        report
            Called with each accepted step, from a thread.
        stop
            Event that stops the refinement at once.

        Raises
        ------
        InvalidSettings
            As `bellcrank.refine.refine_design`.
        """

        def receive(_number: int, progress: Progress) -> None:
            self._path.append(progress)
            report(progress)

        stop = stop or threading.Event()
        found = refine_designs([self.design], self._spec, receive, 1, stop, self.settings)
        return self._recorded(found[0]) if found else None

    def reached(self) -> Refinement:
        """Return what a refinement that was stopped has reached, verified with eight elements.

        Random prints are not computed again: their part is that of the steps.
        """
        limit = self._spec.registered_material.strain_limit
        problem = specified(self.design.problem, limit)
        before = state_of(problem, self.design.mask)
        result = Refinement(
            design=self.design, before=before, after=before, steps=0, evaluations=0, sheets=0,
            reason="stopped", improved=False,
        )  # fmt: skip
        if not self._path:
            return result
        first, last = self._path[0], self._path[-1]
        result = replace(
            result,
            before=_with_share(before, first),
            steps=last.step,
            evaluations=last.evaluations,
            sheets=last.sheets,
        )
        best = max(range(len(self._path)), key=lambda number: _rank(self._path[number], number))
        is_met = self._path[best].rows.violation <= MET
        halvings = HALVINGS if is_met else 0
        after, number = latest_met(lambda k: self._state(self._path[k]), best + 1, halvings)
        if not is_better(after, result.before):
            return replace(result, after=result.before)
        other = self._path[number].design
        assert other is not None
        design = with_geometry_of(self.design, other.problem)
        return self._recorded(replace(result, design=design, after=after, improved=True))

    def _state(self, progress: Progress) -> State:
        assert progress.design is not None
        return _with_share(state_of(progress.design.problem, progress.design.mask), progress)

    def _recorded(self, result: Refinement) -> Refinement:
        """Return a result whose design has its efficiency, and how it was refined."""
        if not result.improved:
            return result
        notes = {**self.design.provenance, "refinement": refinement_data(result)}
        own = provenance(**{key: value for key, value in notes.items() if key not in provenance()})
        efficiency = result.after.efficiency
        return replace(result, design=replace(result.design, efficiency=efficiency, provenance=own))


def _with_share(state: State, progress: Progress) -> State:
    """Return a state with the part of prints of a step, and with its objective over them."""
    if progress.share is None or not state.is_stable:
        return state
    objective = progress.rows.objective if progress.has_objective else state.objective
    return replace(state, share=progress.share, objective=objective)


def _rank(progress: Progress, number: int) -> tuple[bool, float, int]:
    """Return how good a step is; of equal ones the latest is the best."""
    return progress.rows.violation <= MET, share_of(progress), number
