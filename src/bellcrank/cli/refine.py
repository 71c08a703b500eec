"""`bellcrank refine`: move the nodes of a design."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bellcrank.cli.app import NOT_MET, app
from bellcrank.cli.arguments import DesignName, design_named
from bellcrank.cli.console import announce_compilation, notes, plain, results, text_grid
from bellcrank.errors import InvalidSettings, OutputExists

if TYPE_CHECKING:
    from bellcrank.refine.refinement import Progress


@app.command()
def refine(
    design: DesignName,
    out: Annotated[
        Path | None,
        typer.Argument(metavar="FILE", help="File of the result; default: NAME-refined.json."),
    ] = None,
    evaluations: Annotated[
        int, typer.Option(help="Largest number of geometries that are evaluated.")
    ] = 1000,
    largest_move: Annotated[
        float, typer.Option(help="Largest change of a coordinate of a node, in beam lengths.")
    ] = 0.9,
    widest: Annotated[
        float,
        typer.Option(help="Largest width of a strut over that of the section; 1 for no change."),
    ] = 1.8,
    same_mass: Annotated[bool, typer.Option("--same-mass", help="The mass may not grow.")] = False,
    tolerance: Annotated[
        bool,
        typer.Option(
            "--tolerance",
            help="Meet all items over deviations of print and drive too: those of the task, or the "
            "usual ones.",
        ),
    ] = False,
    picture: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw the motion before and after (png, svg, pdf)."),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace existing files.")] = False,
) -> None:
    """Move nodes and widen struts, so that a design meets its specification and its gain grows."""
    if evaluations < 1:
        raise InvalidSettings(f"--evaluations: expected at least 1, got {evaluations}")
    if not 0.0 < largest_move <= 2.0:
        raise InvalidSettings(
            f"--largest-move: expected above 0 and at most 2 beam lengths, got {largest_move:g}"
        )
    if not 1.0 <= widest <= 4.0:
        raise InvalidSettings(f"--widest: expected a number from 1 to 4, got {widest:g}")
    chosen = design_named(design)
    target = out or Path(f"{Path(chosen.problem.name).name}-refined.json")
    if target.exists() and not overwrite:
        raise OutputExists(f"{target} exists; choose another file, or --overwrite")
    from bellcrank.cli.stopping import stopping_on_interrupt
    from bellcrank.model import write_design
    from bellcrank.refine import RefinementSettings
    from bellcrank.workflows.file_refinement import FileRefinement
    from bellcrank.workflows.pictures import check_targets, draw_before_and_after
    from bellcrank.workflows.refinement import motion_rows, refinement_rows
    from bellcrank.workflows.tolerance import with_tolerances
    from bellcrank.workflows.validation import spec_for

    if tolerance:
        chosen = with_tolerances(chosen, spec_for(chosen))
    check_targets(picture, None, overwrite=overwrite)
    settings = RefinementSettings(
        evaluations=evaluations, largest_move=largest_move, widest=widest, same_mass=same_mass
    )
    announce_compilation()
    with stopping_on_interrupt() as stop:

        def report(progress: Progress) -> None:
            if progress.step % 10 == 0 and not progress.reason:
                notes.print(
                    f"step {progress.step}: objective {progress.rows.objective:.4g}, violation "
                    f"{progress.rows.violation:.3g}"
                )

        job = FileRefinement(chosen, settings)
        found = job.run(report, stop) or job.reached()
    results.print(text_grid(refinement_rows(chosen, found)))
    results.print(text_grid(motion_rows({"before": chosen, "after": found.design})))
    if not found.improved:
        notes.print(f"the design was not improved: {found.reason}")
        if stop.is_set():
            stop.exit()
        sys.exit(1)
    results.print(
        f"objective: {found.before.objective:.4g} before, {found.after.objective:.4g} after "
        f"{found.steps} steps ({found.reason})"
    )
    write_design(found.design, target, overwrite=overwrite)
    notes.print(f"wrote {plain(target)}")
    if picture is not None:
        draw_before_and_after(
            chosen, found.design, spec_for(found.design), picture, overwrite=overwrite
        )
        notes.print(f"wrote {plain(picture)}")
    if not found.after.met:
        sys.exit(NOT_MET)
