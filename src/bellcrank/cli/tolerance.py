"""`bellcrank tolerance`: what a part does when it is not printed or driven as drawn."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bellcrank.cli.app import app
from bellcrank.cli.arguments import DesignName, design_named
from bellcrank.cli.console import (
    announce_compilation,
    notes,
    plain,
    print_json,
    results,
    text_grid,
)
from bellcrank.cli.live import Live

if TYPE_CHECKING:
    from bellcrank.workflows.tolerance import ToleranceReport

SHOWN_STRUTS = 5
"""Number of struts whose loss is printed."""


class ScenarioProgress(Live):
    """Progress of a computation of scenarios."""

    def __init__(self) -> None:
        super().__init__("scenarios", None)

    def __call__(self, done: int, total: int) -> None:
        """Show the number of scenarios that are computed."""
        self._show(done, total, f"{done} of {total}", f"{done} of {total} scenarios")


@app.command()
def tolerance(
    design: DesignName,
    width: Annotated[float, typer.Option(help="Deviation of all widths, mm.")] = 0.1,
    relative_width: Annotated[
        float | None,
        typer.Option(
            help="The same as a part of the width; random prints have it too. Default, as for "
            "--each-width, --node and --angle: that of the task, or 0.1."
        ),
    ] = None,
    thin: Annotated[
        float, typer.Option(help="Part of the width by which all struts may be too thin.")
    ] = 0.2,
    each_width: Annotated[
        float | None,
        typer.Option(help="Standard deviation of the width of each strut, as a part of it: 0.05."),
    ] = None,
    node: Annotated[
        float | None,
        typer.Option(help="Largest deviation of each coordinate of a node, mm: 0.1."),
    ] = None,
    angle: Annotated[
        float | None, typer.Option(help="Deviation of the direction of the input, degrees: 5.")
    ] = None,
    shortest: Annotated[
        float, typer.Option(help="Shortest stroke, as a part of the nominal one.")
    ] = 0.5,
    longest: Annotated[
        float, typer.Option(help="Longest stroke, as a part of the nominal one.")
    ] = 1.5,
    prints: Annotated[int, typer.Option(help="Number of random prints.")] = 200,
    struts: Annotated[
        bool, typer.Option("--struts/--no-struts", help="Compute the loss of each strut.")
    ] = True,
    seed: Annotated[int, typer.Option(help="Seed of the random prints.")] = 0,
    workers: Annotated[
        int | None, typer.Option(help="Number of processes; default: that of the cores.")
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Draw the critical struts (png, svg, pdf); not with --no-struts."
        ),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace existing files.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Compute what a part does when it is not printed or driven as drawn, or loses a strut."""
    chosen = design_named(design)
    from bellcrank.cli.stopping import stopping_on_interrupt
    from bellcrank.errors import InvalidSettings
    from bellcrank.model import require_plane
    from bellcrank.tolerance import Deviations
    from bellcrank.workflows.pictures import check_targets
    from bellcrank.workflows.tolerance import compute_tolerance, tolerances_of
    from bellcrank.workflows.validation import spec_for

    if workers is not None and workers < 1:
        raise InvalidSettings(f"--workers: expected at least 1, got {workers}")
    spec = spec_for(chosen)
    given = {
        "width": relative_width, "each_width": each_width, "angle": angle,
        "node": None if node is None else node / spec.scale,
    }  # fmt: skip
    changes = {name: value for name, value in given.items() if value is not None}
    deviations = Deviations(
        tolerances=replace(tolerances_of(chosen, spec), **changes), width=width / spec.scale,
        thin=thin, shortest=shortest, longest=longest, prints=prints, struts=struts, seed=seed,
    )  # fmt: skip
    if picture is not None:
        require_plane(chosen.problem, "--picture")
        if not struts:
            raise InvalidSettings("--picture draws the loss of each strut; leave out --no-struts")
    check_targets(picture, None, overwrite=overwrite)
    announce_compilation()
    with stopping_on_interrupt() as stop, ScenarioProgress() as progress:
        report = compute_tolerance(
            chosen, deviations, progress=progress, workers=workers, stop=stop
        )
    if report is None:
        stop.exit()
        return
    if as_json:
        print_json(json.dumps(report.to_dict(), indent=1))
    else:
        _print(report)
    if picture is not None:
        from bellcrank.plots import draw_critical_struts

        losses = report.tolerance.strut_losses()
        draw_critical_struts(report.design, losses, picture, overwrite=overwrite)
        notes.print(f"wrote {plain(picture)}")


def _print(report: ToleranceReport) -> None:
    """Print the items, the worst scenarios and the critical struts."""
    from bellcrank.workflows.tolerance import (
        scenario_rows,
        strut_lines,
        tolerance_rows,
        tolerance_sentence,
    )

    results.print(tolerance_sentence(report))
    results.print(text_grid(tolerance_rows(report)))
    results.print(text_grid(scenario_rows(report)))
    for line in strut_lines(report, SHOWN_STRUTS):
        results.print(plain(line))
