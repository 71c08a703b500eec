"""`bellcrank export`: files for printers, cutters and other programs."""

from __future__ import annotations

from dataclasses import replace
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
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from bellcrank.workflows.fabricate import Grips

PRINTED = (".stl", ".3mf")
"""Suffixes of files for printing, for which the part is checked."""
CUT = (".dxf", ".svg", ".step", ".stp")
"""Suffixes of files for other ways of making the part."""

Plate = Annotated[bool, typer.Option("--plate", help="Fill the supports to a plate for clamping.")]
Screws = Annotated[int, typer.Option(help="Number of screw holes in the plate.")]
ScrewDiameter = Annotated[str, typer.Option(help="Diameter of the screw holes.")]
Pad = Annotated[bool, typer.Option("--pad", help="Fill the input to a pad for pushing.")]
Pointer = Annotated[str, typer.Option(help="Length of a pointer at the output.")]
PrintedWidth = Annotated[
    str | None,
    typer.Option(
        metavar="RATIO",
        help="Width of a printed strut over the drawn one, measured on the printer, such as 88%: "
        "struts are drawn wider by its inverse. \\[100%]",
    ),
]


def printed_width_of(text: str | None) -> float | None:
    """Return the ratio of printed to drawn widths of the option."""
    from bellcrank.part.units import read_quantity

    return None if text is None else read_quantity("printed width", text, "ratio")


def grips_of(plate: bool, screws: int, screw_diameter: str, pad: bool, pointer: str) -> Grips:
    """Return the plate, pad and pointer of the options."""
    from bellcrank.part import read_length
    from bellcrank.workflows.fabricate import Grips

    return Grips(
        plate=plate,
        screws=screws,
        screw_diameter=read_length("screw diameter", screw_diameter),
        pad=pad,
        pointer=read_length("pointer", pointer),
    )


def check_markers(out: Path, size: float | None, overwrite: bool) -> None:
    """Check before any computation that the markers of an exported part can be written.

    Raises
    ------
    InvalidSettings
        If OpenCV is not installed, the size is out of range, or the format is not one for making
        the part.
    OutputExists
        If one of the files exists and is not to be replaced.
    """
    from bellcrank.measure.corners import opencv
    from bellcrank.measure.layout import check_size
    from bellcrank.model.storage import already_exists
    from bellcrank.workflows.markers import marker_files

    opencv()
    if out.suffix.lower() not in (*PRINTED, *CUT):
        raise InvalidSettings(
            f"markers: expected a file for making the part ({', '.join((*PRINTED, *CUT))}), "
            f"got {out}"
        )
    if size is not None:
        check_size("marker size", size)
    for path in marker_files(out):
        if path.exists() and not overwrite:
            raise already_exists(path)


@app.command()
def export(
    design: DesignName,
    out: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="File: stl, 3mf, step, dxf, svg, vtu or lmp."),
    ],
    part: PartFile = None,
    width: Width = None,
    thickness: Thickness = None,
    scale: Scale = None,
    fillet: Fillet = None,
    material: MaterialName = None,
    layer: Annotated[
        str, typer.Option(help="Layer height, to which the thickness is rounded; 0: no rounding.")
    ] = "0.32mm",
    plate: Plate = False,
    screws: Screws = 0,
    screw_diameter: ScrewDiameter = "3.4mm",
    pad: Pad = False,
    pointer: Pointer = "0",
    printed_width: PrintedWidth = None,
    markers: Annotated[
        bool,
        typer.Option(
            "--markers",
            help="Also write the markers for bellcrank measure (FILE.markers.pdf, .svg and .json), "
            "and fill supports, input and output to pads for them.",
        ),
    ] = False,
    marker_size: Annotated[
        str | None, typer.Option(help="Side of the markers on the part. \\[12mm]")
    ] = None,
    moved: Annotated[bool, typer.Option("--moved", help="Include the motion (vtu).")] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the file.")] = False,
) -> None:
    """Write the part of a design to a file for printers, cutters or other programs."""
    from bellcrank.export import check_print, exporters
    from bellcrank.export import export as write
    from bellcrank.model.storage import check_folder
    from bellcrank.part import read_length
    from bellcrank.workflows import spec_for
    from bellcrank.workflows.fabricate import bundle_of, size_and_volume

    exporters.for_path(out).check_installed()
    chosen = design_named(design)
    lengths = {"width": width, "thickness": thickness, "scale": scale, "fillet": fillet}
    spec = part_of(spec_for(chosen), part, lengths, material)
    grips = grips_of(plate, screws, screw_diameter, pad, pointer)
    size = None if marker_size is None else read_length("marker size", marker_size)
    if markers:
        check_markers(out, size, overwrite)
        grips = replace(grips, plate=True, pad=True, output_pad=True, strict=False)
    elif size is not None:
        raise InvalidSettings("marker-size: expected --markers as well")
    height = read_length("layer", layer)
    check_folder(out)
    if markers:
        from bellcrank.workflows.measure import check_measurable

        check_measurable(chosen)
    if moved:
        announce_compilation()
    whole = out.suffix.lower() in (*PRINTED, *CUT)
    ratio = printed_width_of(printed_width)
    bundle = bundle_of(
        chosen, spec, grips, layer=height or None, moved=moved, whole=whole,
        printed_width=1.0 if ratio is None else ratio,
    )  # fmt: skip
    write(bundle, out, overwrite=overwrite)
    size_text = " x ".join(f"{side:.4g}" for side in size_and_volume(bundle)[0])
    notes.print(f"wrote {plain(out)}, {size_text} mm")
    if markers:
        from bellcrank.workflows.markers import write_markers

        announce_compilation()
        for path in write_markers(chosen, spec, out, size, overwrite=overwrite):
            notes.print(f"wrote {plain(path)}")
    if out.suffix.lower() in PRINTED:
        for warning in check_print(bundle):
            notes.print(f"[yellow]printing:[/] {plain(warning.sentence)}")
