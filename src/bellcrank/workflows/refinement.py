"""Refinement of the selected design of a search, and its results as texts."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bellcrank.fem.results import finite
from bellcrank.mechanics import VERIFICATION_INCREMENT, FrameEvaluator
from bellcrank.mechanics.frames.joints import with_joints
from bellcrank.processes import default_workers
from bellcrank.refine import Refinement, RefinementSettings
from bellcrank.search import HoppingSettings, SpecificationEvaluator, specified
from bellcrank.search.choice import nearest
from bellcrank.search.selection import Finalist
from bellcrank.search.verification import Verifier
from bellcrank.workflows.refiners import (
    FIRST_EVALUATIONS,
    refine_designs,
    second_model,
)
from bellcrank.workflows.specification import item_rows
from bellcrank.workflows.validation import spec_for

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from bellcrank.model import Design, Problem
    from bellcrank.part import PartSpec
    from bellcrank.refine.refinement import Progress
    from bellcrank.search import Selection

BEFORE_REFINEMENT = {"steps": 8_000}
"""Settings of a search whose design is refined: a longer search gains less than the refinement."""
FIRST = RefinementSettings(evaluations=FIRST_EVALUATIONS, prints=0)
"""Settings of the first refinement of each design, without the sheet and random prints."""

BATCHES = 3
"""Largest number of times as many designs as there are chains are refined further."""


def refine_selection(
    selection: Selection,
    spec: PartSpec | None,
    report: Callable[[int, Progress], None] = lambda _number, _progress: None,
    workers: int | None = None,
    stop: threading.Event | None = None,
) -> tuple[Selection, Refinement | None]:
    """Refine designs of a search and select the best result.

    All are refined for a few geometries, and the best results further, as many as there are chains;
    as many again if all of those miss items in the sheet only. If no result meets all items, those
    of the reserve are refined in the same way.

    Parameters
    ----------
    selection
        Selected design of the search, and others that may be refined.
    spec
        Part that is computed in the sheet; None for no sheet.
    report
        Called with the number of a design and each accepted step, from threads of their own.
    workers
        Number of designs that are refined at a time, each in a process; by default one for each
        core. The result does not depend on it.
    stop
        Event that stops the refinements.

    Returns
    -------
    selection
        With the refined design, if it is better.
    refinement
        How it came about; None if the problem has no specification, or the refinements were
        stopped.
    """
    if not selection.design.problem.is_specified:
        return selection, None
    workers, stop = workers or default_workers(), stop or threading.Event()
    finalists: list[Finalist] = []
    results: list[Refinement] = []
    before = 0
    for group in ([_finalist(selection), *selection.others], selection.reserve):
        if not group or _is_met(results):
            continue

        def report_of_group(index: int, progress: Progress, before: int = before) -> None:
            report(before + index, progress)

        before += len(group)

        found = _refined(group, spec, report_of_group, workers, stop)
        if not found:
            return selection, None
        finalists += [finalist for finalist, _ in found]
        results += [result for _, result in found]
    best = max(range(len(results)), key=lambda number: _rank(results[number]))
    chosen = _verified(finalists[best], results[best].design)
    assert chosen.verification is not None
    if chosen.verification.fault is None:
        return _with_finalist(selection, chosen), results[best]
    pairs = [
        *((finalist, result.design) for finalist, result in zip(finalists, results, strict=True)),
        *((finalist, finalist.design) for finalist in selection.nearest),
    ]
    near = nearest([_verified(finalist, design) for finalist, design in pairs])
    return _with_finalist(selection, chosen, near), results[best]


def _refined(
    finalists: Sequence[Finalist],
    spec: PartSpec | None,
    report: Callable[[int, Progress], None],
    workers: int,
    stop: threading.Event,
) -> list[tuple[Finalist, Refinement]]:
    """Refine finalists, the best of them further; return those, or nothing if it is stopped."""
    chains = len({each.found.chain for each in finalists})
    designs = [each.design for each in finalists]
    designs = [replace(each, problem=with_joints(each.problem, each.mask)) for each in designs]
    first = refine_designs(designs, None, report, workers, stop, FIRST)
    if len(first) < len(designs):
        return []
    order = sorted(range(len(first)), key=lambda number: _rank(first[number]), reverse=True)
    results: list[Refinement] = []
    while len(results) < min(len(order), BATCHES * chains) and not _is_enough(results):
        batch = order[len(results) : len(results) + chains]

        def report_further(index: int, progress: Progress, batch: list[int] = batch) -> None:
            evaluations = progress.evaluations + first[batch[index]].evaluations
            report(batch[index], replace(progress, evaluations=evaluations))

        designs = [first[number].design for number in batch]
        found = refine_designs(designs, spec, report_further, workers, stop)
        if len(found) < len(batch):
            return []
        results += [_joined(first[n], each) for n, each in zip(batch, found, strict=True)]
    return [(finalists[number], each) for number, each in zip(order, results, strict=False)]


def with_refined(selection: Selection, designs: Sequence[Design]) -> Selection:
    """Return a selection with the first of some refined designs that meets all items.

    If neither one of them nor the selected design does, by eight elements in each strut, with the
    one that is nearest to that.

    Parameters
    ----------
    selection
        Selected design of the search.
    designs
        Designs of a refinement that was stopped, the best first.
    """
    if not designs:
        return selection
    own = _finalist(selection)
    refined = []
    for design in designs:
        chosen = _verified(own, design)
        assert chosen.verification is not None
        if chosen.verification.fault is None:
            return _with_finalist(selection, chosen)
        refined.append(chosen)
    near = nearest([_verified(own, selection.design), *refined])
    is_better = bool(near) and near[0].design is not selection.design
    return _with_finalist(selection, near[0], near) if is_better else selection


def _is_enough(results: Sequence[Refinement]) -> bool:
    """Whether no more designs are refined: unless all that meet the items miss some in the sheet.

    In space, with imperfections.
    """
    return bool(results) and (_is_met(results) or not any(each.after.met for each in results))


def _is_met(results: Sequence[Refinement]) -> bool:
    """Whether a result meets all items, in the sheet too where it was computed."""
    met = [each for each in results if each.after.met]
    return any(not each.sheets or each.after.met_in_sheet for each in met)


def _rank(refinement: Refinement) -> tuple[bool, bool, float, float]:
    """Return how good a refined design is.

    Items met by frames, and in the sheet; the part of random prints that meets them; the objective.
    """
    after = refinement.after
    return after.met, bool(after.met_in_sheet), after.share, after.objective


def _joined(first: Refinement, second: Refinement) -> Refinement:
    """Return a refinement and the one of its result as one."""
    return replace(
        second,
        before=first.before,
        steps=first.steps + second.steps,
        evaluations=first.evaluations + second.evaluations,
        improved=first.improved or second.improved,
    )


def _finalist(selection: Selection) -> Finalist:
    """Return the selected design as a finalist."""
    return Finalist(selection.found, selection.design, selection.response, selection.items)


def _verified(finalist: Finalist, design: Design) -> Finalist:
    """Return a finalist with a design in place of its own, by the specification of its problem."""
    evaluator = SpecificationEvaluator(design.problem)
    response = evaluator.evaluate(design.mask, VERIFICATION_INCREMENT)
    items = tuple(evaluator.results()) if response.is_admissible else ()
    verification = Verifier(design.problem, HoppingSettings()).verify(design.mask)
    return Finalist(finalist.found, design, response, items, verification)


def _with_finalist(
    selection: Selection, chosen: Finalist, near: Sequence[Finalist] = ()
) -> Selection:
    """Return the selection of a finalist, and of the nearest ones where it misses items."""
    is_own = chosen.found is selection.found
    return replace(
        selection,
        design=chosen.design,
        response=chosen.response,
        found=chosen.found,
        efficiency_before=selection.efficiency_before if is_own else chosen.response.efficiency,
        efficiency_after=chosen.response.efficiency,
        verification=chosen.verification,
        items=chosen.items,
        nearest=tuple(near),
    )


def refinement_data(refinement: Refinement) -> dict[str, Any]:
    """Return how a design was refined, as plain data."""
    return {
        "objective_before": finite(refinement.before.objective),
        "objective_after": finite(refinement.after.objective),
        "met_before": refinement.before.met,
        "met_after": refinement.after.met,
        _met_key(refinement.design.problem): refinement.after.met_in_sheet,
        "steps": refinement.steps,
        "evaluations": refinement.evaluations,
        "sheets": refinement.sheets,
        "reason": refinement.reason,
    }


def _met_key(problem: Problem) -> str:
    """Return the name of whether the second model of a refinement meets all items."""
    return {2: "met_in_sheet", 3: "met_with_imperfections"}[problem.lattice.dimension]


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
    after, name = refinement.after, second_model(problem)
    states = {"before": refinement.before.items, "after": after.items, name: after.sheet}
    return item_rows(problem, spec, {name: items for name, items in states.items() if items})
