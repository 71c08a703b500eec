"""The main job: search, choose, clean, verify, compare, and leave it all in a folder."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import BellcrankError, InvalidSettings
from bellcrank.fem import FemSettings
from bellcrank.fem.results import finite
from bellcrank.mechanics import (
    VERIFICATION_INCREMENT,
    Response,
    model_evaluator,
)
from bellcrank.model import Design, Problem, human_counterpart, write_design
from bellcrank.part import PartSpec, models
from bellcrank.provenance import provenance
from bellcrank.search import (
    Candidate,
    Progress,
    SearchSettings,
    Selection,
    advance_chain,
    candidates_of,
    make_evaluator,
    read_settings,
    run_chains,
    searches,
    start_chain,
    verification_evaluator,
    with_stable_initial,
)
from bellcrank.search.choice import select_design
from bellcrank.search.scores import SCORE_COLUMNS, recorded_scores
from bellcrank.search.verification import ELEMENTS
from bellcrank.storage import RunFolder, check_no_run, remove_temporaries
from bellcrank.storage.locking import LOCK, locked
from bellcrank.workflows.figures import figures_of, model_record
from bellcrank.workflows.part_figures import part_figures
from bellcrank.workflows.refinement import refine_selection, refinement_data, with_refined
from bellcrank.workflows.report import RESULTS, DesignReport
from bellcrank.workflows.report_tables import write_report
from bellcrank.workflows.tolerance import compute_tolerance, deviations_of
from bellcrank.workflows.validation import Validation, validate
from bellcrank.workflows.validation_record import replace_record

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from bellcrank.refine.refinement import Progress as RefinementProgress
    from bellcrank.workflows.tolerance import ToleranceReport


def prepare(problem: Problem, settings: SearchSettings) -> None:
    """Compile the kernels of a search and check that it can start from the initial design.

    Raises
    ------
    InvalidSettings
        If the initial design has no unique, stable response.
    """
    evaluator = make_evaluator(problem, settings)
    # One step evaluates the initial design, the other may predict flips.
    few = replace(settings, steps=2)
    advance_chain(evaluator, few, 0, start_chain(evaluator, few))


def start_design(
    problem: Problem,
    settings: SearchSettings,
    out: Path,
    part: PartSpec | None = None,
    *,
    refine: bool = True,
) -> RunFolder:
    """Create the folder of a design job.

    Parameters
    ----------
    problem
        Problem to be solved, in the spring model or as a frame.
    settings
        Settings of the search.
    out
        New folder.
    part
        Part to be designed. The beams of a problem of the spring model become its struts; a
        problem with a section keeps it. Without goals of its own, the search has the goal that no
        two struts come nearer than their width.
    refine
        Whether the selected design of a task with a specification is refined.

    Raises
    ------
    OutputExists
        If the folder contains a run.
    InvalidSettings
        If the initial design has no unique, stable response, or the part cannot be built.
    StorageError
        If the folder cannot be written.
    """
    check_no_run(out)
    notes: dict[str, Any] = {}
    if part is not None:
        problem = models["frames"](problem, part)
        part.of(problem.full_design())
        notes["part"] = part.to_dict()
        if not settings.goals and problem.section is not None and not problem.is_specified:
            settings = replace(settings, goals=(f"no-contact {problem.section.width:g}",))
    if problem.is_specified:
        problem = with_stable_initial(problem, settings)
        settings = replace(settings, before_refinement=refine)
    prepare(problem, settings)
    return RunFolder.create(out, problem, settings.to_dict(), notes=notes)


def reopen_design(out: Path) -> RunFolder:
    """Open the folder of an interrupted design job to resume it.

    Raises
    ------
    InvalidFile, CorruptRun
        If the folder is not the folder of a run, or is damaged.
    """
    folder = RunFolder.open(out)
    prepare(folder.problem, read_settings(folder.settings))
    return folder


def complete_design(
    folder: RunFolder,
    *,
    workers: int | None = None,
    progress: Callable[[Progress], None] = lambda _progress: None,
    verifying: Callable[[int, int], None] = lambda _done, _total: None,
    refining: Callable[[int, RefinementProgress], None] = lambda _number, _progress: None,
    stop: threading.Event | None = None,
) -> DesignReport | None:
    """Run or resume a design job and write its results.

    Parameters
    ----------
    folder
        Folder of the job.
    workers
        Number of chains, and then of refinements, that run in parallel; all cores by default. It
        does not change results.
    progress
        Called with the progress of a chain, from the thread of that chain.
    verifying
        For a frame: called with the number of candidates verified and the largest number.
    refining
        For a task with a specification: called with the number of a design and each accepted step
        of its refinement, from threads of their own.
    stop
        Event that stops the search after the current block of steps; completed steps are stored.

    Returns
    -------
    DesignReport or None
        None if the search was stopped before its end.

    Raises
    ------
    StorageError, CorruptRun
        If the folder cannot be written, is damaged or is in use by another process.
    """
    settings = read_settings(folder.settings)
    with locked(folder.path / LOCK, wait=False):
        folder.status = "running"
        try:
            done = run_chains(folder, settings, workers=workers, progress=progress, stop=stop)
            if done:
                report = conclude(folder, settings, verifying, refining, stop, workers)
                if report is not None:
                    folder.finish()
                    return report
        except BaseException:
            _try_to_mark_stopped(folder)
            raise
        folder.status = "stopped"
        return None


def _try_to_mark_stopped(folder: RunFolder) -> None:
    """Set the status of a run to stopped, if it can still be written."""
    try:
        folder.status = "stopped"
    except (BellcrankError, OSError):
        return


def accepted_candidates(
    folder: RunFolder, settings: SearchSettings
) -> tuple[list[Candidate], int, list[float]]:
    """Return candidates of all chains, the number of proposals and the best of each chain.

    Accepted designs that violate goals are no candidates; those that do not meet a specification
    are, ranked by their scores.
    """
    candidates: list[Candidate] = []
    proposals = 0
    best: list[float] = []
    for chain in range(settings.chains):
        records = folder.read(chain, ["step", "mask", *SCORE_COLUMNS])
        scores = recorded_scores(records, settings, folder.problem)
        taken = np.flatnonzero(~np.isnan(scores))
        proposals += len(scores)
        score = scores[taken]
        best.append(float(score.max(initial=-np.inf)))
        candidates += candidates_of(
            chain, records["step"][taken], records["mask"][taken], score,
            searches[settings.name].candidate_rule,
        )  # fmt: skip
    return candidates, proposals, best


def verify(design: Design, settings: SearchSettings, response: Response) -> dict[str, float]:
    """Return the efficiency of a design from rest, in fine and in adaptive load increments."""
    second = verification_evaluator(design.problem, settings, goals=()).evaluate(design.mask)
    return {"increments of 1/32": response.efficiency, "adaptive increments": second.efficiency}


def conclude(
    folder: RunFolder,
    settings: SearchSettings,
    verifying: Callable[[int, int], None] = lambda _done, _total: None,
    refining: Callable[[int, RefinementProgress], None] = lambda _number, _progress: None,
    stop: threading.Event | None = None,
    workers: int | None = None,
    refined: Sequence[Design] | None = None,
) -> DesignReport | None:
    """Select, clean, verify, refine and compare a design, and write the result files.

    Candidates of a frame are verified with more elements (`bellcrank.search.verification`).

    Parameters
    ----------
    folder, settings
        A search.
    verifying, refining, stop, workers
        As in `complete_design`.
    refined
        Designs of the refinement of a search that was stopped, the best first; the selected design
        is replaced by the first that meets all items. It is not computed over tolerances then. None
        for a search that was not stopped.

    Returns
    -------
    DesignReport or None
        None if the refinement was stopped before its end.

    Raises
    ------
    NoDesignFound
        If no design qualifies.
    StorageError, CorruptRun
        If the folder cannot be written, or is damaged.
    """
    remove_temporaries(folder.path, RESULTS)
    problem = folder.problem
    spec = _part_of(folder)
    candidates, proposals, best = accepted_candidates(folder, settings)
    limit = math.nan if spec is None else spec.registered_material.strain_limit
    selection = select_design(problem, candidates, settings, limit, verifying)
    refinement = None
    if settings.before_refinement:
        selection, refinement = refine_selection(selection, spec, refining, workers, stop)
        if stop is not None and stop.is_set():
            return None
    else:
        selection = with_refined(selection, refined or ())
    elements = None if problem.section is None else ELEMENTS
    all_beams = verification_evaluator(problem, settings, elements, goals=())
    human = human_counterpart(problem)
    human_response = None
    if human is not None:
        human_response = all_beams.evaluate(human.mask, VERIFICATION_INCREMENT)
    tolerance = None
    if refined is None:
        tolerance = _tolerance(selection.design, spec, workers, stop)
    if stop is not None and stop.is_set():
        return None
    report = DesignReport(
        folder=folder.path,
        settings=settings,
        selection=selection,
        checks=verify(selection.design, settings, selection.response),
        initial_efficiency=all_beams.evaluate(problem.initial, VERIFICATION_INCREMENT).efficiency,
        human=human,
        human_response=human_response,
        proposals=proposals,
        best_by_chain=best,
        figures=_figures(selection),
        part=spec,
        refinement=refinement,
        validation=_validated(selection.design, spec),
        part_figures=(
            [] if spec is None or problem.section is None else part_figures(selection.design, spec)
        ),
        tolerance=tolerance,
    )
    part = {} if spec is None else {"part": spec.to_dict()}
    design = replace(
        selection.design,
        efficiency=report.efficiency,
        provenance=provenance(**_origin(report), **part),
    )
    write_design(design, folder.path / "design.json", overwrite=True)
    if report.validation is not None:
        replace_record(report.validation, folder.path / "validation.json")
    from bellcrank.workflows.pictures import draw_report

    draw_report(report, folder)
    write_report(report, folder)
    return report


def _figures(selection: Selection) -> list[dict[str, Any]]:
    """Return the figures of the design by the model of the search, and by its verification."""
    problem, found = selection.design.problem, selection.verification
    rows = []
    for elements in [None] if found is None else [None, found.elements]:
        evaluator = model_evaluator(problem, elements=elements)
        response = evaluator.evaluate(selection.design.mask, VERIFICATION_INCREMENT)
        rows.append({**model_record(problem, elements), **figures_of(evaluator, response)})
    return rows


def _tolerance(
    design: Design, spec: PartSpec | None, workers: int | None, stop: threading.Event | None
) -> ToleranceReport | None:
    """Return a part over the tolerances of its task; None without, or if it is not stable."""
    wanted = design.problem.specification
    if spec is None or wanted is None or wanted.tolerances is None:
        return None
    try:
        deviations = deviations_of(design, spec, struts=False)
        return compute_tolerance(design, deviations, spec, workers=workers, stop=stop)
    except InvalidSettings:
        return None


def _validated(design: Design, spec: PartSpec | None) -> Validation | None:
    """Return the frame analysis of a part; None without one, or if it is not held."""
    if spec is None:
        return None
    try:
        return validate(design, spec, [("frame", FemSettings())])
    except InvalidSettings:
        return None


def _part_of(folder: RunFolder) -> PartSpec | None:
    """Return the part of a run, if it has one."""
    data = folder.provenance.get("part")
    return None if data is None else PartSpec.from_dict(data, f"{folder.path}: part")


def _origin(report: DesignReport) -> dict[str, Any]:
    """Return the origin of a design, for its provenance."""
    return {
        "kind": "machine",
        "settings": report.settings.to_dict(),
        "chain": report.selection.found.chain,
        "step": report.selection.found.step,
        "efficiency_before_cleaning": finite(report.selection.efficiency_before),
        "checks": {name: finite(value) for name, value in report.checks.items()},
        "status": report.selection.response.status.label,
        **({} if report.refinement is None else {"refinement": refinement_data(report.refinement)}),
    }
