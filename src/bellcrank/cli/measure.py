"""`bellcrank measure`: the motion of a printed part from a film of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bellcrank.cli.app import app
from bellcrank.cli.arguments import (
    Fillet,
    MaterialName,
    PartFile,
    Scale,
    Thickness,
    Width,
    design_named,
    part_of,
)
from bellcrank.cli.console import announce_compilation, notes, plain, print_json, results
from bellcrank.cli.live import Live
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from rich.table import Table


class FilmProgress(Live):
    """Shows the number of pictures that are read."""

    def __init__(self) -> None:
        super().__init__("film", None)

    def __call__(self, done: int, total: int) -> None:
        """Show the numbers of pictures that are done and of all."""
        figures = f"picture {done} of {total}"
        self._show(done, total, figures, f"film: {figures}")


@app.command()
def measure(
    film: Annotated[
        list[Path],
        typer.Argument(metavar="VIDEO|IMAGES", help="A film, photographs or a folder of them."),
    ],
    design: Annotated[
        str, typer.Option(help="Design of the part: file, result folder or bundled name.")
    ],
    markers: Annotated[
        Path | None,
        typer.Option(
            help="File FILE.markers.json of export --markers. \\[markers of the default size]"
        ),
    ] = None,
    outline: Annotated[
        bool, typer.Option("--outline", help="Measure a part without markers by its outline.")
    ] = False,
    sheet: Annotated[
        str | None,
        typer.Option(
            metavar="WxH",
            help="Measured width and height of the printed sheet over the outer edges of the "
            "corner markers, mm, such as 217.2x146.8. \\[as drawn]",
        ),
    ] = None,
    placement: Annotated[
        str, typer.Option(help="Standard deviation of the positions of the markers on the part.")
    ] = "0.3mm",
    overlay: Annotated[
        Path | None,
        typer.Option(help="Movie (mp4) of the film with the measured and the computed motion."),
    ] = None,
    part: PartFile = None,
    width: Width = None,
    thickness: Thickness = None,
    scale: Scale = None,
    fillet: Fillet = None,
    material: MaterialName = None,
    seed: Annotated[int, typer.Option(help="Seed of the bootstrap.")] = 0,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the movie.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Measure the motion of a printed part in a film, beside the computed motion."""
    from bellcrank.measure import MeasureSettings, open_film, read_layout
    from bellcrank.part import read_length

    settings = MeasureSettings(placement=read_length("placement", placement), seed=seed)
    measured_sheet = None if sheet is None else sheet_size(sheet)
    if outline and (markers is not None or sheet is not None):
        raise InvalidSettings("outline: a part without markers has no --markers and no --sheet")
    opened = open_film(film)
    if overlay is not None:
        from bellcrank.plots.movies import check_movie

        check_movie(overlay, overwrite=overwrite)
    layout = None if markers is None else read_layout(markers)
    chosen = design_named(design)
    from bellcrank.workflows import spec_for
    from bellcrank.workflows.measure import (
        computed_motion,
        layout_for,
        measure_film,
        measure_outline,
        printed_scale,
        result_data,
    )

    lengths = {"width": width, "thickness": thickness, "scale": scale, "fillet": fillet}
    spec = part_of(spec_for(chosen), part, lengths, material)
    announce_compilation()
    computed = computed_motion(chosen, spec)
    with FilmProgress() as progress:
        if outline:
            found = measure_outline(opened, computed, settings=settings, report=progress)
        else:
            layout = layout or layout_for(computed)
            printed = None if measured_sheet is None else printed_scale(layout, measured_sheet)
            found = measure_film(
                opened, computed, layout, settings=settings, printed=printed, report=progress
            )
    if overlay is not None:
        from bellcrank.workflows.overlay import write_overlay

        write_overlay(found, overlay, overwrite=overwrite)
        notes.print(f"wrote {plain(overlay)}")
    data = result_data(found)
    if as_json:
        print_json(json.dumps(data, indent=1))
        return
    results.print(_table(data))
    for line in _remarks(data):
        results.print(plain(line))


def sheet_size(text: str) -> tuple[float, float]:
    """Read the width and the height of a printed sheet, mm.

    Raises
    ------
    InvalidSettings

    Examples
    --------
    >>> sheet_size("217.2x146.8")
    (217.2, 146.8)
    """
    wide, cross, high = text.replace("×", "x").partition("x")
    try:
        size = float(wide), float(high)
    except ValueError:
        size = (0.0, 0.0)
    if not cross or not all(0.0 < each < 1e5 for each in size):
        raise InvalidSettings(
            f"sheet: expected width and height in mm like 217.2x146.8, got {text!r}"
        )
    return size


def _table(data: dict[str, Any]) -> Table:
    """Return the figures at all strokes: measured with intervals, and computed."""
    from rich.box import SIMPLE
    from rich.table import Table

    table = Table(
        "input", "quantity", "measured", "95 % interval", "computed", box=SIMPLE,
        caption=f"{data['method']}, {data['frames']['used']} of {data['frames']['read']} pictures, "
        f"{data['pixels_per_mm']:.1f} pixels per mm; computed by {data['model']}",
    )  # fmt: skip
    for row in data["strokes"]:
        cells = [
            ("efficiency", row["efficiency"], "{:.3f}", 1.0),
            ("off-axis", row["off_axis"], "{:.1f} %", 100.0),
            ("rotation", row["rotation_deg"], "{:.2f} deg", 1.0),
            ("path x", row["path_mm"][0], "{:.2f} mm", 1.0),
            ("path y", row["path_mm"][1], "{:.2f} mm", 1.0),
        ]
        for number, (name, figure, form, factor) in enumerate(cells):
            stroke = f"{row['input_mm']:.2f} mm" if number == 0 else ""
            measured, low, high, computed = (
                "-" if figure[key] is None else form.format(factor * figure[key])
                for key in ("measured", "low", "high", "computed")
            )
            table.add_row(
                stroke, name, measured, f"{low} to {high}", computed, end_section=number == 4
            )
    return table


def _remarks(data: dict[str, Any]) -> list[str]:
    """Return sentences about what the figures mean."""
    own = data["efficiency"]
    sentence = (
        f"Efficiency at {data['reached_mm']:.2f} mm of input: {own['measured']:.3f}, 95 % interval "
        f"{own['low']:.3f} to {own['high']:.3f}; computed {own['computed']:.3f}."
    )
    lines = [sentence]
    if data["reached_mm"] < 0.98 * data["full_stroke_mm"]:
        lines.append(
            f"The film ends at {data['reached_mm']:.2f} mm of the full stroke of "
            f"{data['full_stroke_mm']:.2f} mm; computed figures are at the same input."
        )
    return lines
