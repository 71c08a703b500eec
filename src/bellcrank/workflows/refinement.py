"""Refinement of the selected design of a job, and of a design in a file."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings
from bellcrank.fem.continuum.mesh import COARSE
from bellcrank.fem.results import finite
from bellcrank.fem.specification import sheet_items
from bellcrank.mechanics import VERIFICATION_INCREMENT, FrameEvaluator
from bellcrank.mechanics.frames.joints import with_joints
from bellcrank.provenance import provenance
from bellcrank.refine import Refinement, RefinementSettings, refine_design, specified
from bellcrank.search import HoppingSettings, SpecificationEvaluator
from bellcrank.search.verification import Verifier
from bellcrank.workflows.specification import item_rows
from bellcrank.workflows.validation import spec_for

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from bellcrank.mechanics import ItemResult
    from bellcrank.model import Design
    from bellcrank.part import PartSpec
    from bellcrank.refine.refinement import Progress
    from bellcrank.search import Selection

EVALUATIONS = 400
"""Number of geometries that the refinement of the selected designs of a job evaluates."""
BEFORE_REFINEMENT = {"steps": 8_000}
"""Settings of a search whose design is refined: a longer search gains less than the refinement."""
MOST_REFINED = 3
"""Number of designs that are refined where none meets the specification."""


def refine_selection(
    selection: Selection,
    spec: PartSpec | None,
    report: Callable[[Progress], bool] = lambda _progress: True,
) -> tuple[Selection, Refinement | None]:
    """Refine the selected design of a search; the nearest ones where none meets all.

    Returns
    -------
    selection
        With the refined design, if it is better.
    refinement
        How it came about; None if the problem has no specification or is in space.
    """
    problem = selection.design.problem
    if not problem.is_specified or problem.lattice.dimension == 3:
        return selection, None
    found = selection.verification
    given = replace(selection.design, problem=with_joints(problem, selection.design.mask))
    selection = replace(selection, design=given)
    designs = [given]
    if found is None or found.fault is not None:
        designs += [
            each.design
            for each in selection.nearest
            if each.design.mask_hex != selection.design.mask_hex
        ]
    designs = designs[:MOST_REFINED]
    settings = RefinementSettings(evaluations=EVALUATIONS // len(designs))
    sheet = sheet_of(spec)
    results = [refine_design(design, settings, report, sheet=sheet) for design in designs]
    best = max(results, key=lambda each: (each.after.met, each.after.objective))
    if best.design is selection.design:
        return selection, best
    return with_design(selection, best.design), best


def sheet_of(spec: PartSpec | None) -> Callable[[Design], Sequence[ItemResult] | None] | None:
    """Return a function from a design to its items in the sheet; None without NGSolve."""
    if spec is None or find_spec("ngsolve") is None:
        return None

    def items(design: Design) -> Sequence[ItemResult] | None:
        try:
            return sheet_items(spec.of(design), fineness=COARSE)
        except InvalidSettings:  # no outline: struts almost touch
            return None

    return items


def with_design(selection: Selection, design: Design) -> Selection:
    """Return a selection of another design of the same specification."""
    verification = Verifier(design.problem, HoppingSettings()).verify(design.mask)
    evaluator = SpecificationEvaluator(design.problem)
    response = evaluator.evaluate(design.mask, VERIFICATION_INCREMENT)
    items = tuple(evaluator.results()) if response.is_admissible else ()
    return replace(
        selection,
        design=design,
        response=response,
        efficiency_after=response.efficiency,
        verification=verification,
        items=items,
        nearest=() if verification.fault is None else selection.nearest,
    )


def refinement_data(refinement: Refinement) -> dict[str, Any]:
    """Return how a design was refined, as plain data."""
    return {
        "objective_before": finite(refinement.before.objective),
        "objective_after": finite(refinement.after.objective),
        "met_before": refinement.before.met,
        "met_after": refinement.after.met,
        "met_in_sheet": all(item.met for item in refinement.after.sheet)
        if refinement.after.sheet
        else None,
        "steps": refinement.steps,
        "evaluations": refinement.evaluations,
        "reason": refinement.reason,
    }


def refinement_text(refinement: Refinement) -> str:
    """Return how a design was refined, in one sentence."""
    before, after = refinement.before, refinement.after
    if not refinement.improved:
        return f"no better geometry found in {refinement.steps} steps ({refinement.reason})"
    met = {True: "all items met", False: "items missed"}
    return (
        f"objective {before.objective:.3g} ({met[before.met]}) to {after.objective:.3g} "
        f"({met[after.met]}) in {refinement.steps} steps"
    )


def refine_file(
    design: Design,
    settings: RefinementSettings,
    report: Callable[[Progress], bool] = lambda _progress: True,
) -> Refinement:
    """Refine a design that is in a file, for the part that its file names.

    Raises
    ------
    InvalidSettings
        As `bellcrank.refine.refine_design`.
    """
    limit = spec_for(design).registered_material.strain_limit
    sheet = sheet_of(spec_for(design)) if design.problem.is_specified else None
    result = refine_design(design, settings, report, limit, sheet)
    if not result.improved:
        return result
    notes = {**design.provenance, "refinement": refinement_data(result)}
    efficiency = (
        Verifier(result.design.problem, HoppingSettings())
        .verify(result.design.mask)
        .response.efficiency
    )
    own = provenance(**{key: value for key, value in notes.items() if key not in provenance()})
    refined = replace(result.design, efficiency=efficiency, provenance=own)
    return replace(result, design=refined)


def motion_rows(designs: Mapping[str, Design]) -> list[list[str]]:
    """Return efficiency, off-axis motion and rotation of designs, by 8 elements, as rows of texts.

    Of the first load case and its first output.
    """
    columns = []
    for design in designs.values():
        evaluator = FrameEvaluator(design.problem, elements=8)
        efficiency = evaluator.evaluate(design.mask, VERIFICATION_INCREMENT).efficiency
        motion = evaluator.output_motion()
        columns.append(
            (f"{efficiency:.3f}", f"{motion.off_axis:.1%}", f"{float(motion.rotation):.3g} deg")
        )
    names = ("efficiency", "off-axis motion", "rotation")
    return [
        ["8 elements", *designs],
        *([name, *texts] for name, texts in zip(names, zip(*columns, strict=True), strict=True)),
    ]


def refinement_rows(design: Design, refinement: Refinement) -> list[list[str]]:
    """Return the items before and after as rows of texts, the first with the names of columns."""
    spec = spec_for(design)
    problem = specified(design.problem, spec.registered_material.strain_limit)
    after = refinement.after
    states = {"before": refinement.before.items, "after": after.items, "sheet": after.sheet}
    return item_rows(problem, spec, {name: items for name, items in states.items() if items})
