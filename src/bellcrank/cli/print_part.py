"""`bellcrank print`: G-code by PrusaSlicer."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

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
from bellcrank.cli.console import announce_compilation, notes, plain, results
from bellcrank.cli.export import (
    Pad,
    Plate,
    Pointer,
    PrintedWidth,
    ScrewDiameter,
    Screws,
    grips_of,
    printed_width_of,
)

if TYPE_CHECKING:
    from bellcrank.workflows.fabricate import PrintJob


@app.command("print")
def print_(
    design: DesignName,
    out: Annotated[
        Path | None, typer.Argument(metavar="FILE", help="G-code file to write. \\[NAME.gcode]")
    ] = None,
    profile: Annotated[
        str | None, typer.Option(help="Print profile. \\[that of the material]")
    ] = None,
    nozzle: Annotated[str | None, typer.Option(help="Nozzle diameter. \\[0.4mm]")] = None,
    layer: Annotated[str | None, typer.Option(help="Layer height. \\[0.32mm]")] = None,
    bead_width: Annotated[str | None, typer.Option(help="Line width. \\[0.45mm]")] = None,
    slicer: Annotated[str | None, typer.Option(help="Path of PrusaSlicer.")] = None,
    part: PartFile = None,
    width: Width = None,
    thickness: Thickness = None,
    scale: Scale = None,
    fillet: Fillet = None,
    material: MaterialName = None,
    plate: Plate = False,
    screws: Screws = 0,
    screw_diameter: ScrewDiameter = "3.4mm",
    pad: Pad = False,
    pointer: Pointer = "0",
    printed_width: PrintedWidth = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the file.")] = False,
) -> None:
    """Slice a design for a printer and report material and time."""
    from bellcrank.part import read_length
    from bellcrank.workflows import spec_for
    from bellcrank.workflows.fabricate import (
        bundle_of,
        print_design,
        print_warnings,
        profile_for,
    )

    chosen = design_named(design)
    lengths = {"width": width, "thickness": thickness, "scale": scale, "fillet": fillet}
    spec = part_of(spec_for(chosen), part, lengths, material)
    given = {"nozzle": nozzle, "layer": layer, "bead_width": bead_width}
    figures = {key: None if text is None else read_length(key, text) for key, text in given.items()}
    ratio = printed_width_of(printed_width)
    printer = profile_for(profile, spec, **figures, printed_width=ratio)
    grips = grips_of(plate, screws, screw_diameter, pad, pointer)
    bundle = bundle_of(
        chosen, spec, grips, layer=printer.layer, printed_width=printer.printed_width
    )
    target = out or Path(f"{chosen.problem.name}.gcode")
    job = print_design(bundle, printer, target, slicer=slicer, overwrite=overwrite)
    _print(job)
    announce_compilation()
    for sentence in print_warnings(bundle, printer):
        notes.print(f"[yellow]printing:[/] {plain(sentence)}")
    notes.print(f"wrote {plain(target)}")


def _print(job: PrintJob) -> None:
    """Print layers, size, volume, mass and time."""
    deposit = job.sliced.deposit
    size = deposit.high - deposit.low
    table = Table.grid(padding=(0, 2))
    table.add_row("layers", f"{deposit.layers} of {job.profile.layer:g} mm")
    table.add_row("size", f"{size[0]:.1f} x {size[1]:.1f} x {deposit.high[2]:.2f} mm")
    table.add_row("solid", f"{job.volume / 1000.0:.2f} cm3")
    share = deposit.volume / job.volume
    table.add_row("deposited", f"{deposit.volume / 1000.0:.2f} cm3, {share:.1%} of the solid")
    if deposit.support:
        table.add_row("supports", f"{deposit.support / 1000.0:.2f} cm3, to be removed")
    if math.isfinite(job.mass):
        table.add_row("mass", f"{job.mass:.1f} g")
    if math.isfinite(deposit.seconds):
        minutes = round(deposit.seconds / 60.0)
        table.add_row("time", f"{minutes // 60} h {minutes % 60:02d} min (estimate of the slicer)")
    table.add_row("slicer", plain(job.sliced.slicer))
    results.print(table)
