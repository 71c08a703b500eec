"""`bellcrank card`: a one-page summary of a design as a part."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bellcrank.cli.app import app
from bellcrank.cli.arguments import (
    DesignName,
    Fillet,
    MaterialName,
    PartFile,
    Scale,
    Thickness,
    Width,
    design_named,
    part_of,
)
from bellcrank.cli.console import announce_compilation, notes, plain
from bellcrank.cli.validate import record_of


@app.command()
def card(
    design: DesignName,
    out: Annotated[
        Path | None, typer.Argument(metavar="FILE", help="pdf, png or svg. \\[NAME.pdf]")
    ] = None,
    protocol: Annotated[
        bool,
        typer.Option("--protocol", help="Describe how to film the part for bellcrank measure."),
    ] = False,
    part: PartFile = None,
    width: Width = None,
    thickness: Thickness = None,
    scale: Scale = None,
    fillet: Fillet = None,
    material: MaterialName = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an existing file.")
    ] = False,
) -> None:
    """Draw a one-page summary of a design as a part, or how to film it."""
    chosen = design_named(design)
    from bellcrank.workflows import spec_for
    from bellcrank.workflows.card import make_card

    lengths = {"width": width, "thickness": thickness, "scale": scale, "fillet": fillet}
    spec = part_of(spec_for(chosen), part, lengths, material)
    default = f"{chosen.problem.name}.protocol.pdf" if protocol else f"{chosen.problem.name}.pdf"
    target = out or Path(default)
    announce_compilation()
    if protocol:
        from bellcrank.workflows.markers import write_protocol

        write_protocol(chosen, spec, design, target, overwrite=overwrite)
        notes.print(f"wrote {plain(target)}")
        return
    make_card(chosen, spec, target, record=record_of(design), title=design, overwrite=overwrite)
    notes.print(f"wrote {plain(target)}")
