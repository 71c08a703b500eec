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
        typer.Argument(help="A problem, a design file or folder, human:NAME, machine:NAME."),
    ],
    out: Annotated[
        Path | None, typer.Option(help="Picture to write (png, svg, pdf); default: NAME.png.")
    ] = None,
    rest: Annotated[bool, typer.Option("--rest", help="At rest only, with the regions.")] = False,
    paths: Annotated[
        bool, typer.Option("--paths", help="Efficiency along the chains of a result folder.")
    ] = False,
    beside: Annotated[
        str | None, typer.Option(help="A second design, drawn beside the first.")
    ] = None,
    magnify: Annotated[float, typer.Option(help="Draw the motion so many times its size.")] = 1.0,
    objective: Annotated[
        str | None, typer.Option(help="displacement, directional:N or force.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the picture.")] = False,
) -> None:
    """Draw a design at rest and moved, a problem, or the paths of a search."""
    from bellcrank.plots import draw_comparison, draw_design, draw_motion
    from bellcrank.workflows import draw_run, motion_of

    if beside is not None and (paths or rest):
        raise InvalidSettings("--beside compares motions; leave out --rest and --paths")
    if rest and paths:
        raise InvalidSettings("give either --rest or --paths")
    if paths:
        folder = Path(what)
        target = out or folder / "paths.png"
        draw_run(folder, target, overwrite=overwrite)
    else:
        design = design_named(what)
        target = out or Path(f"{design.problem.name}.png")
        if rest:
            draw_design(design, target, overwrite=overwrite)
        else:
            announce_compilation()
            first = motion_of(design, objective, magnify=magnify)
            if beside is None:
                draw_motion(first, target, overwrite=overwrite)
            else:
                second = motion_of(design_named(beside), objective, name=beside, magnify=magnify)
                draw_comparison(
                    motion_of(design, objective, name=what, magnify=magnify),
                    second,
                    target,
                    overwrite=overwrite,
                )
    notes.print(f"wrote {plain(target)}")
