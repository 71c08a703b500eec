"""`bellcrank design`: the main job."""

from __future__ import annotations

import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from bellcrank.cli.app import NOT_MET, app
from bellcrank.cli.arguments import design_named, settings_of
from bellcrank.cli.console import (
    announce_compilation,
    notes,
    plain,
    results,
    warn_of_another_version,
)
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from bellcrank.model import Design, Problem
    from bellcrank.part import PartSpec
    from bellcrank.workflows import DesignReport


@app.command()
def design(
    problem: Annotated[
        str | None, typer.Argument(help="A built-in problem or a problem file.")
    ] = None,
    steps: Annotated[int | None, typer.Option(help="Proposals of each chain. [20000]")] = None,
    chains: Annotated[int | None, typer.Option(help="Independent chains. [4]")] = None,
    seed: Annotated[
        int | None, typer.Option(help="Determines everything, with the chain's number. [0]")
    ] = None,
    objective: Annotated[
        str | None,
        typer.Option(help="displacement, directional:N or force; default: by the drive."),
    ] = None,
    search: Annotated[
        str,
        typer.Option(
            help="basin-hopping, tempering or paper (Bonfanti et al. 2020).",
        ),
    ] = "basin-hopping",
    unloaded_beams: Annotated[
        str | None,
        typer.Option(
            help="stripped (what bears no load), ignored (dead ends) or counted (as in 'paper')."
        ),
    ] = None,
    cost: Annotated[
        str | None, typer.Option(help="exponential (the paper) or negative; for chains.")
    ] = None,
    schedule: Annotated[
        str | None, typer.Option(help="linear (the paper), geometric, constant; for chains.")
    ] = None,
    minimum_degree: Annotated[
        int | None, typer.Option(help="Least number of beams at a free node; for chains.")
    ] = None,
    patience: Annotated[
        int | None, typer.Option(help="End a chain after so many rejections in a row.")
    ] = None,
    goal: Annotated[
        list[str] | None,
        typer.Option(help="What the design must keep, like 'mass <= 0.6'; repeatable."),
    ] = None,
    strokes: Annotated[
        str | None, typer.Option(help="Average over these parts of the stroke, like 0.25,0.5,1.")
    ] = None,
    strut_width: Annotated[
        str | None, typer.Option(help="Search with the stiffness of struts this wide, like 1.6mm.")
    ] = None,
    scale: Annotated[
        str | None, typer.Option(help="Length of a lattice unit of that part. \\[10mm]")
    ] = None,
    material: Annotated[
        str | None, typer.Option(help="Of that part, kept for validation. \\[ninjaflex]")
    ] = None,
    more: Annotated[
        list[str] | None,
        typer.Option("--set", help="KEY=VALUE: any other setting of the search; repeatable."),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(help="Chains at the same time; changes no result.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Result folder; default: the name.")] = None,
    begin: Annotated[
        str | None,
        typer.Option("--from", help="Begin with this design, in place of a whole lattice."),
    ] = None,
    resume: Annotated[Path | None, typer.Option(help="Go on with the run in this folder.")] = None,
) -> None:
    """Design an actuator: search, clean up, verify, and see what was designed."""
    from bellcrank.cli.progress import SearchProgress
    from bellcrank.cli.stopping import stopping_on_interrupt
    from bellcrank.model import find_problem
    from bellcrank.search import read_settings
    from bellcrank.workflows import complete_design, reopen_design, start_design

    if sum(given is not None for given in (problem, begin, resume)) != 1:
        raise InvalidSettings(
            "give one of these: a problem to design for, --from DESIGN, or --resume DIR"
        )
    part = _part(strut_width, scale, material)
    if resume is not None and part is not None:
        raise InvalidSettings("--strut-width, --scale and --material are kept from the run's start")
    if workers is not None and workers < 1:
        raise InvalidSettings(f"workers: expected at least 1, got {workers}")
    given = {
        "steps": steps, "chains": chains, "seed": seed, "objective": objective,
        "unloaded_beams": unloaded_beams,
        "cost": cost, "schedule": schedule,
        "minimum_degree": minimum_degree, "patience": patience,
        "goals": goal and tuple(goal), "strokes": strokes and _numbers("--strokes", strokes),
        **settings_of("--set", more),
    }  # fmt: skip
    chosen = {key: value for key, value in given.items() if value is not None}
    if resume is not None and (chosen or out is not None):
        what = next(iter(chosen), "out").replace("_", "-")
        raise InvalidSettings(
            f"--{what} cannot be changed with --resume; to continue from the design of that run, "
            f"start a new one with --from {resume}"
        )
    with stopping_on_interrupt(resumable=True) as stop:
        announce_compilation()
        if resume is not None:
            folder = reopen_design(resume)
            warn_of_another_version(folder.provenance, "run")
        else:
            settings = read_settings({"search": search, **chosen})
            if problem is not None:
                task = find_problem(problem)
            else:
                task = _task_from(design_named(str(begin)))
            folder = start_design(task, settings, out or _new_folder(task), part)
        command = f"bellcrank design --resume {shlex.quote(str(folder.path))}"
        stop.hint = f"Stopped. To continue: {plain(command)}"
        with SearchProgress(read_settings(folder.settings)) as progress:
            report = complete_design(
                folder, workers=workers, tell=progress, trying=progress.trying, stop=stop
            )
        if report is None:
            stop.exit()  # a thread may still compute a block, which delays a usual exit
    assert report is not None
    _print_report(report)
    if report.failures:
        sys.exit(NOT_MET)


def _new_folder(task: Problem) -> Path:
    """Return a folder that is not in use, named after a task."""
    from bellcrank.storage import unused_folder

    wanted = Path(Path(task.name).name)
    folder = unused_folder(wanted)
    if folder != wanted:
        notes.print(f"{plain(wanted)}/ exists; the results are written to {plain(folder)}/")
    return folder


def _task_from(design: Design) -> Problem:
    """Return the task of a design, with that to begin with."""
    return replace(design.problem, initial=design.mask)


def _part(width: str | None, scale: str | None, material: str | None) -> PartSpec | None:
    """Return what the design will be made as, if anything was said about that."""
    from bellcrank.part import PartSpec, materials

    if width is None:
        if scale is not None or material is not None:
            raise InvalidSettings("--scale and --material belong to a part; give --strut-width too")
        return None
    given = {"width": width, "scale": scale, "material": material and materials[material].name}
    return PartSpec().changed({key: value for key, value in given.items() if value is not None})


def _numbers(option: str, text: str) -> tuple[float, ...]:
    """Read numbers with commas between them."""
    try:
        return tuple(map(float, text.split(",")))
    except ValueError:
        raise InvalidSettings(f"{option} {text}: expected numbers with commas between") from None


def _print_report(report: DesignReport) -> None:
    """Say what was designed, in a few lines."""
    from bellcrank.workflows.report import part_rows

    selection = report.selection
    table = Table.grid(padding=(0, 2))
    table.add_row("efficiency", f"[bold]{selection.efficiency_after:.4f}[/]")
    for name, value in part_rows(report):
        table.add_row(name, value)
    table.add_row("before cleaning", f"{selection.efficiency_before:.4f}")
    table.add_row("where the search began", f"{report.initial_efficiency:.4f}")
    if report.human_response is not None:
        table.add_row("human design", f"{report.human_response.efficiency:.4f}")
    if report.settings.goals:
        table.add_row("goals kept", plain(", ".join(report.settings.goals)))
    table.add_row("beams", f"{selection.design.beam_count}")
    table.add_row(
        "verified",
        f"from rest in {' and '.join(report.checks)}, which differ by {report.agreement:.0e}",
    )
    table.add_row("designs looked at", f"{report.proposals}")
    table.add_row("results", plain(f"{report.folder}/"))
    results.print(table)
    if report.failures:
        notes.print(
            f"[bold yellow]warning:[/] no design works: {plain('; '.join(report.failures))}. "
            "Use more steps (--steps), more chains (--chains), another initial design (--from) or, "
            "for a part, other struts (--strut-width)."
        )
    if not report.verified:
        notes.print(
            "[bold yellow]warning:[/] the efficiency depends on the load increments: the design "
            "may snap."
        )
