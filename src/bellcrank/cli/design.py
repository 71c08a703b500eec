"""`bellcrank design`: the main job."""

from __future__ import annotations

import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bellcrank.cli.app import NOT_MET, app
from bellcrank.cli.arguments import UNLOADED_BEAMS, design_named, settings_of
from bellcrank.cli.console import (
    announce_compilation,
    notes,
    plain,
    warn_of_another_version,
)
from bellcrank.cli.design_report import print_report
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.model import Design, Problem
    from bellcrank.part import PartSpec


@app.command()
def design(
    problem: Annotated[
        str | None, typer.Argument(help="Bundled task or problem, or a file of one.")
    ] = None,
    steps: Annotated[
        int | None,
        typer.Option(help="Number of proposals per chain. [25000; 8000 before a refinement]"),
    ] = None,
    chains: Annotated[int | None, typer.Option(help="Number of independent chains. [2]")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the random numbers. [0]")] = None,
    objective: Annotated[
        str | None,
        typer.Option(
            help="Objective: displacement, directional:N or force; default: by the drive."
        ),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            help="Mechanical model: frames (beams that are the struts of a part) or springs. "
            "\\[frames]"
        ),
    ] = None,
    paper: Annotated[
        bool,
        typer.Option("--paper", help="Springs and search of the paper (Bonfanti et al. 2020)."),
    ] = False,
    search: Annotated[
        str | None,
        typer.Option(help="Search method: basin-hopping, tempering or paper. \\[basin-hopping]"),
    ] = None,
    unloaded_beams: Annotated[
        str | None,
        typer.Option(help=UNLOADED_BEAMS),
    ] = None,
    cost: Annotated[
        str | None,
        typer.Option(help="Cost of a Markov chain: exponential (the paper) or negative."),
    ] = None,
    schedule: Annotated[
        str | None,
        typer.Option(
            help="Temperature schedule of a Markov chain: linear (the paper) or constant."
        ),
    ] = None,
    goal: Annotated[
        list[str] | None,
        typer.Option(
            help="Constraint on the design, for example 'mass <= 0.6'; repeatable. For a part, "
            "without any: 'no-contact WIDTH'."
        ),
    ] = None,
    strokes: Annotated[
        str | None,
        typer.Option(help="Fractions of the stroke to average over, for example 0.25,0.5,1."),
    ] = None,
    strut_width: Annotated[
        str | None,
        typer.Option(help="Strut width of the part, for example 1.6mm. \\[2mm]"),
    ] = None,
    thickness: Annotated[str | None, typer.Option(help="Thickness of the part. \\[5mm]")] = None,
    scale: Annotated[
        str | None, typer.Option(help="Length of a lattice unit of the part. \\[10mm]")
    ] = None,
    material: Annotated[
        str | None, typer.Option(help="Material of the part. \\[ninjaflex]")
    ] = None,
    more: Annotated[
        list[str] | None,
        typer.Option("--set", help="KEY=VALUE, any other setting of the search; repeatable."),
    ] = None,
    refine: Annotated[
        bool,
        typer.Option(
            "--refine/--no-refine",
            help="Move the nodes of the design of a task with a specification after the search.",
        ),
    ] = True,
    workers: Annotated[
        int | None,
        typer.Option(help="Number of chains that run in parallel; does not change results."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Result folder; default: name of the problem.")
    ] = None,
    begin: Annotated[
        str | None,
        typer.Option("--from", help="Initial design, in place of the full lattice."),
    ] = None,
    resume: Annotated[Path | None, typer.Option(help="Folder of a run to resume.")] = None,
) -> None:
    """Design an actuator: search, clean, verify and report."""
    from bellcrank.cli.stopping import stopping_on_interrupt

    if sum(given is not None for given in (problem, begin, resume)) != 1:
        raise InvalidSettings(
            "give one of these: a problem to design for, --from DESIGN, or --resume DIR"
        )
    if workers is not None and workers < 1:
        raise InvalidSettings(f"workers: expected at least 1, got {workers}")
    given = {
        "steps": steps, "chains": chains, "seed": seed, "objective": objective,
        "unloaded_beams": unloaded_beams,
        "cost": cost, "schedule": schedule,
        "goals": goal and tuple(goal), "strokes": strokes and _numbers("--strokes", strokes),
        **settings_of("--set", more),
    }  # fmt: skip
    chosen = {key: value for key, value in given.items() if value is not None}
    lengths = {
        "width": strut_width, "thickness": thickness, "scale": scale, "material": material
    }  # fmt: skip
    wanted = {key: value for key, value in lengths.items() if value is not None}
    _check_model(model, search, chosen, wanted, paper=paper)
    others = {"model": model, "paper": paper or None, "search": search, "out": out, **lengths}
    changed = [*chosen, *(key for key, value in others.items() if value is not None)]
    if resume is not None and changed:
        what = changed[0].replace("_", "-").replace("width", "strut-width")
        raise InvalidSettings(
            f"--{what} cannot be changed with --resume; to continue from the design of that run, "
            f"start a new one with --from {resume}"
        )
    # Input is refused before the modules that take long to import.
    model = "springs" if paper else model or "frames"
    task, part = None, None
    if resume is None:
        task, part = _in_model(_design(problem, str(begin)), model, wanted)
    from bellcrank.search import read_settings
    from bellcrank.workflows.refinement import BEFORE_REFINEMENT

    if refine and task is not None and task.is_specified:
        chosen = {**BEFORE_REFINEMENT, **chosen}
    method = "paper" if paper else search or "basin-hopping"
    settings = read_settings({"search": method, **chosen})
    from bellcrank.cli.progress import SearchProgress
    from bellcrank.mechanics import compile_ahead
    from bellcrank.workflows import complete_design, reopen_design, start_design

    with stopping_on_interrupt(resumable=True) as stop:
        announce_compilation()
        if task is None:
            assert resume is not None
            folder = reopen_design(resume)
            warn_of_another_version(folder.provenance, "run")
        else:
            compile_ahead(task)
            folder = start_design(task, settings, out or _new_folder(task), part, refine=refine)
            _print_stroke(task, 10.0 if part is None else part.scale)
            _print_nodes(task, 10.0 if part is None else part.scale)
        command = f"bellcrank design --resume {shlex.quote(str(folder.path))}"
        stop.hint = f"Stopped. To continue: {plain(command)}"
        with SearchProgress(read_settings(folder.settings), folder.problem) as progress:
            report = complete_design(
                folder,
                workers=workers,
                progress=progress,
                verifying=progress.verifying,
                refining=progress.refining,
                stop=stop,
            )
        if report is None:
            stop.exit()  # a thread may still compute a block, which delays a usual exit
    assert report is not None
    print_report(report)
    if report.failures or report.missed or report.low_yield:
        sys.exit(NOT_MET)


def _new_folder(task: Problem) -> Path:
    """Return a folder that is not in use, named after a task."""
    from bellcrank.storage import unused_folder

    wanted = Path(Path(task.name).name)
    folder = unused_folder(wanted)
    if folder != wanted:
        notes.print(f"{plain(wanted)}/ exists; the results are written to {plain(folder)}/")
    return folder


def _print_stroke(task: Problem, scale: float) -> None:
    """Print the input displacement in beam lengths and in millimetres of a part."""
    import numpy as np

    if task.input.drive != "displacement":
        return
    amount = task.input.amount
    lengths = amount / float(np.median(task.lattice.rest_length))
    notes.print(
        f"input: {lengths:.3g} beam lengths, {amount * scale:.3g} mm at {scale:g} mm for each "
        "lattice unit"
    )
    if lengths > 1.0:
        notes.print(
            "[yellow]note:[/] input.amount is in lattice units, not in millimetres; a displacement "
            "of more than one beam length is unusually large"
        )


LISTED = 4
"""Largest number of nodes that are printed one by one."""


def _print_nodes(task: Problem, scale: float) -> None:
    """Print the nodes of a specification, which the regions of its task select, in mm."""
    if task.specification is None:
        return

    def text(nodes: NDArray[np.int64]) -> str:
        places = scale * task.lattice.positions[nodes]
        if len(places) > LISTED:
            low, high = (_point(ends) for ends in (places.min(axis=0), places.max(axis=0)))
            return f"{len(places)} nodes between {low} and {high}"
        return ", ".join(map(_point, places))

    for name, case in task.cases.items():
        parts = [f"supports {text(case.supports.nodes)}", f"input {text(case.input.nodes)}"]
        parts += [f"{output} {text(each.nodes)}" for output, each in case.outputs.items()]
        label = f"nodes of {name}" if len(task.cases) > 1 else "nodes"
        notes.print(f"{plain(label)}, mm: {plain('; '.join(parts))}")


def _point(position: NDArray[np.float64]) -> str:
    """Return the coordinates of a point as text."""
    return f"({', '.join(f'{each:.4g}' for each in position)})"


PAPER = {"unloaded_beams": "keep", "cost": "exponential", "schedule": "linear"}
"""Settings of the paper's search that have an option of their own."""
PAPER_OPTIONS = ("steps", "chains", "seed", "objective")
"""Options that go with ``--paper``."""


def _check_model(
    model: str | None,
    search: str | None,
    chosen: dict[str, Any],
    part: dict[str, str],
    *,
    paper: bool,
) -> None:
    """Refuse options that contradict each other.

    Raises
    ------
    InvalidSettings
    """
    if paper:
        given = {"model": model, "search": search, **chosen, **part}
        known = {"model": "springs", "search": "paper", **PAPER}
        for key, value in given.items():
            if value is not None and key not in PAPER_OPTIONS and known.get(key) != value:
                raise InvalidSettings(
                    f"--paper: {_option(key)} {value} contradicts it; the paper's model and "
                    "search leave only --steps, --chains, --seed and --objective to choose"
                )
    if model == "springs" and part:
        raise InvalidSettings(
            f"{_option(next(iter(part)))}: a part is made of frames; leave out --model springs"
        )


OPTIONS = {
    "width": "--strut-width", "goals": "--goal",
    **{
        key: f"--{key.replace('_', '-')}"
        for key in ("model", "search", "strokes", "thickness", "scale", "material", *PAPER)
    },
}  # fmt: skip


def _option(key: str) -> str:
    """Return the option of a setting."""
    return OPTIONS.get(key, f"--set {key}")


def _design(problem: str | None, begin: str) -> Design:
    """Return the named task or problem with its initial design, or a design as the initial one."""
    from bellcrank.model import find_problem

    if problem is not None:
        from bellcrank.task import find_task

        if (task := find_task(problem)) is not None:
            return task.initial_design()
        return find_problem(problem).full_design()
    design = design_named(begin)
    return replace(design, problem=replace(design.problem, initial=design.mask))


def _in_model(design: Design, model: str, part: dict[str, str]) -> tuple[Problem, PartSpec | None]:
    """Return a problem in its mechanical model, and for frames the part that is designed.

    A problem that has a section keeps it unless the part is given.
    """
    from bellcrank.part import frame_problem, materials, models
    from bellcrank.workflows import spec_for

    make = models[model]
    if design.problem.specification is not None:
        given = ["--model springs"] if model == "springs" else [_option(key) for key in part]
        if given:
            raise InvalidSettings(
                f"{given[0]}: {design.problem.name!r} is a task, which is designed as a part of "
                "frames; size and material are in its [part]"
            )
        return design.problem, spec_for(design)
    if model == "springs":
        return make(design.problem, spec_for(design)), None
    changes = dict(part)
    if "material" in changes:
        changes["material"] = materials[changes["material"]].name
    spec = spec_for(design).changed(changes)
    if part:
        return frame_problem(design.problem, spec), spec
    return make(design.problem, spec), spec


def _numbers(option: str, text: str) -> tuple[float, ...]:
    """Parse numbers separated by commas."""
    try:
        return tuple(map(float, text.split(",")))
    except ValueError:
        raise InvalidSettings(f"{option} {text}: expected numbers separated by commas") from None
