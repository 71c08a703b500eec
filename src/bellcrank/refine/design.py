"""Refinement of designs, corrected by frames with more elements."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics.frames.joints import with_joints
from bellcrank.model import Item
from bellcrank.refine.by_frames import FrameRefinement
from bellcrank.refine.by_sheet import SheetRefinement
from bellcrank.refine.refinement import RefinementSettings
from bellcrank.refine.shape import volume_of
from bellcrank.search.default_specification import specified

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.model import Design, Problem
    from bellcrank.refine.by_sheet import Sheet
    from bellcrank.refine.refinement import Progress
    from bellcrank.refine.state import State


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
    report: Callable[[Progress], None] = lambda _progress: None,
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
        Called with each accepted step.
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
    job = FrameRefinement(given, settings, report)
    job.run()
    sheets = 0
    if sheet is not None:
        continued = SheetRefinement(job, sheet)
        continued.run()
        sheets = continued.sheets
    refined = design
    improved = bool(job.chosen.any())
    if improved:
        at = job.variables.problem_at(job.chosen)
        refined = with_geometry_of(design, at)
    return Refinement(
        design=refined,
        before=job.before,
        after=job.best,
        steps=job.steps,
        evaluations=job.evaluations,
        sheets=sheets,
        reason=job.reason,
        improved=improved,
    )


def with_geometry_of(design: Design, other: Problem) -> Design:
    """Return a design with the positions and widths of another problem on the same lattice."""
    moved = design.problem.with_geometry(other.lattice.positions, other.widths)
    return replace(design, problem=with_joints(moved, design.mask))


def _with_mass(problem: Problem, mask: NDArray[np.bool_]) -> Problem:
    """Return a problem whose specification limits the mass to that of a design."""
    wanted = problem.specification
    assert wanted is not None
    item = Item(
        quantity="mass", case=next(iter(problem.cases)), at_most=volume_of(problem, mask)[0]
    )
    return replace(problem, specification=replace(wanted, items=(*wanted.items, item)))
