"""`bellcrank plot`: pictures of problems, designs and runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bellcrank.cli.app import app
from bellcrank.cli.arguments import design_named
from bellcrank.cli.console import announce_compilation, notes, plain
from bellcrank.errors import InvalidSettings


@app.command()
def plot(
    what: Annotated[
        str,
        typer.Argument(
            help="Problem, design file, result folder, human:NAME or machine:NAME; with --paths "
            "a result folder."
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(help="Picture to write (png, svg, pdf). \\[NAME.png]")
    ] = None,
    rest: Annotated[
        bool, typer.Option("--rest", help="Draw the design at rest, with its regions.")
    ] = False,
    paths: Annotated[
        bool, typer.Option("--paths", help="Draw the efficiency along the chains of a run.")
    ] = False,
    compare: Annotated[
        str | None, typer.Option(help="Second design, drawn beside the first.")
    ] = None,
    magnify: Annotated[float, typer.Option(help="Factor of the displacements drawn.")] = 1.0,
    objective: Annotated[
        str | None,
        typer.Option(help="displacement, directional:N or force. \\[that of the design]"),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the picture.")] = False,
) -> None:
    """Draw a design at rest and at full stroke, a problem, or the chains of a run."""
    from bellcrank.mechanics import objective_name
    from bellcrank.plots import draw_comparison, draw_design, draw_motion
    from bellcrank.workflows.pictures import draw_run, motion_of

    if compare is not None and (paths or rest):
        raise InvalidSettings("--compare draws motions; leave out --rest and --paths")
    if rest and paths:
        raise InvalidSettings("give either --rest or --paths")
    if paths:
        target = out or Path(what) / "paths.png"
        draw_run(Path(what), target, overwrite=overwrite)
        notes.print(f"wrote {plain(target)}")
        return
    design = design_named(what)
    target = out or Path(f"{design.problem.name}.png")
    if rest:
        draw_design(design, target, overwrite=overwrite)
    elif compare is None:
        announce_compilation()
        draw_motion(motion_of(design, objective, magnify=magnify), target, overwrite=overwrite)
    else:
        shown = {what: design, compare: design_named(compare)}
        announce_compilation()
        ratios = [objective_name(each.problem, objective) for each in shown.values()]
        # Efficiencies by different definitions are not one figure: each is then labelled.
        titles = [
            name if len(set(ratios)) == 1 else f"{name} ({ratio})"
            for name, ratio in zip(shown, ratios, strict=True)
        ]
        motions = [
            motion_of(each, objective, name=title, magnify=magnify)
            for each, title in zip(shown.values(), titles, strict=True)
        ]
        draw_comparison(motions[0], motions[-1], target, overwrite=overwrite)
    notes.print(f"wrote {plain(target)}")
