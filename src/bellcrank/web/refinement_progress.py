"""Progress of refinements, and the design that the page draws."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from bellcrank.refine.reached import Reached

if TYPE_CHECKING:
    from bellcrank.mechanics import Response
    from bellcrank.model import Design, Problem
    from bellcrank.part import PartSpec
    from bellcrank.refine.refinement import Progress as RefinementProgress
    from bellcrank.search import SpecificationEvaluator
    from bellcrank.workflows.refiners import GeometryCount

MOVED_INTERVAL = 0.4
"""Seconds between two evaluations of the displayed design."""


class RefinementReporter:
    """The latest and the best geometries of refinements.

    Parameters
    ----------
    part
        Part of the designs.
    count
        Count of their geometries.
    only_met
        Whether a geometry is shown only if it meets all items, as the design before does.

    Attributes
    ----------
    design
        The design that is shown; None if there is none yet.
    """

    def __init__(self, part: PartSpec, count: GeometryCount, *, only_met: bool = True) -> None:
        self.design: Design | None = None
        self.only_met = only_met
        self._part, self._count = part, count
        self._reached = Reached()
        self._before = 0
        self._sent: Design | None = None
        self._sent_at = 0.0
        self._began: float | None = None

    def add(self, number: int, progress: RefinementProgress) -> None:
        """Record a geometry of the refinement of a design."""
        if self._began is None:
            self._began = time.monotonic()
            self._before = progress.evaluations
        self._count.add(number, progress.evaluations)
        self._reached.add(number, progress)
        shown = self.designs() if self._reached.met or not self.only_met else []
        if shown:
            self.design = shown[0]

    def designs(self) -> list[Design]:
        """Return the best design of each refinement, the best first."""
        return self._reached.designs()

    def summary(self) -> dict[str, Any] | None:
        """Return the numbers of designs, geometries and sheets, and the best objective.

        ``seconds`` is the mean time of a geometry since the first one was reported, None before
        the second. The objective is the largest of geometries that meet all items, and ``share``
        the part of random prints that the displayed one meets, None without prints.
        None before the first geometry.
        """
        latest, met = self._reached.latest.values(), self._reached.met
        if not latest:
            return None
        done = self._count.done - self._before
        assert self._began is not None
        passed = time.monotonic() - self._began
        objectives = [float(each.rows.objective) for each in met if each.has_objective]
        return {
            "designs": len(latest),
            "geometries": self._count.done,
            "sheets": sum(each.sheets for each in latest),
            "most": self._count.most,
            "seconds": round(passed / done, 3) if done > 0 else None,
            "objective": max(objectives, default=None),
            "share": self._reached.best[0].share,
        }

    def message(self, design: Design) -> dict[str, Any]:
        """Return the response of a design for the page; empty if it was sent, or too soon."""
        from bellcrank.model import problem_to_dict
        from bellcrank.web.quick_calls import specification_of

        if design is self._sent or time.monotonic() - self._sent_at < MOVED_INTERVAL:
            return {}
        evaluator = specification_of(design.problem)
        assert evaluator is not None
        shown = displayed(design.problem, self._part, evaluator.evaluate(design.mask), evaluator)
        self._sent, self._sent_at = design, time.monotonic()
        problem = problem_to_dict(design.problem)
        return {"moved": {"mask": design.mask_hex, "problem": problem, **shown}}


def displayed(
    problem: Problem,
    part: PartSpec,
    response: Response,
    specification: SpecificationEvaluator | None,
) -> dict[str, Any]:
    """Return motion, items and objectives of the design evaluated last for the page."""
    from bellcrank.fem.results import finite
    from bellcrank.web.items import item_states, objective_states
    from bellcrank.web.quick_calls import flat

    shown, items, objectives = response.is_admissible, None, []
    if shown and specification is not None:
        items = item_states(problem, part, specification.results())
        objectives = objective_states(problem, part, specification)
    return {
        "efficiency": finite(response.efficiency),
        "displacement": flat(response.displacement) if shown else None,
        "items": items,
        "objectives": objectives,
    }
