"""`bellcrank export`: files to print, cut, look at and compute with."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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

if TYPE_CHECKING:
    from bellcrank.workflows.fabricate import Grips

PRINTED = (".stl", ".3mf")
"""What goes to a printer, whose limits are worth a word."""
CUT = (".dxf", ".svg", ".step", ".stp")
"""What becomes a part by other ways."""

Plate = Annotated[bool, typer.Option("--plate", help="Make the supports a solid plate to clamp.")]
Screws = Annotated[int, typer.Option(help="Screw holes through that plate.")]
ScrewDiameter = Annotated[str, typer.Option(help="Of the screw holes.")]
Pad = Annotated[bool, typer.Option("--pad", help="Make the input a solid pad to push.")]
Pointer = Annotated[str, typer.Option(help="Length of a strut that points out of the output.")]


def grips_of(plate: bool, screws: int, screw_diameter: str, pad: bool, pointer: str) -> Grips:
    """Return what is added to a part, from what stands on the command line."""
    from bellcrank.part import read_length
    from bellcrank.workflows.fabricate import Grips

    return Grips(
        plate=plate,
        screws=screws,
        screw_diameter=read_length("screw diameter", screw_diameter),
        pad=pad,
        pointer=read_length("pointer", pointer),
    )


@app.command()
def export(
    design: DesignName,
    out: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="stl, 3mf, step, dxf, svg, vtu, data or dump."),
    ],
    part: PartFile = None,
    width: Width = None,
    thickness: Thickness = None,
    scale: Scale = None,
    fillet: Fillet = None,
    material: MaterialName = None,
    layer: Annotated[
        str, typer.Option(help="Layer height: the part is as thick as whole layers; 0: as said.")
    ] = "0.32mm",
    plate: Plate = False,
    screws: Screws = 0,
    screw_diameter: ScrewDiameter = "3.4mm",
    pad: Pad = False,
    pointer: Pointer = "0",
    moved: Annotated[
        bool, typer.Option("--moved", help="With the motion, where the format can hold one.")
    ] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the file.")] = False,
) -> None:
    """Write the part that a design becomes, for printers, cutters and other programs."""
    from bellcrank.export import check_print, exporter_for
    from bellcrank.export import export as write
    from bellcrank.model.storage import check_folder
    from bellcrank.part import read_length
    from bellcrank.workflows import spec_for
    from bellcrank.workflows.fabricate import bundle_of

    exporter_for(out)
    chosen = design_named(design)
    lengths = {"width": width, "thickness": thickness, "scale": scale, "fillet": fillet}
    spec = part_of(spec_for(chosen), part, lengths, material)
    grips = grips_of(plate, screws, screw_diameter, pad, pointer)
    height = read_length("layer", layer)
    check_folder(out)
    if moved:
        announce_compilation()
    whole = out.suffix.lower() in (*PRINTED, *CUT)
    bundle = bundle_of(chosen, spec, grips, layer=height or None, moved=moved, whole=whole)
    write(bundle, out, overwrite=overwrite)
    notes.print(f"wrote {plain(out)}, {bundle.thickness:g} mm thick")
    if out.suffix.lower() in PRINTED:
        for finding in check_print(bundle):
            notes.print(f"[yellow]printing:[/] {plain(finding.sentence)}")
