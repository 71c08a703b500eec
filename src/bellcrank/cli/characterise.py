"""`bellcrank characterise`: an actuator as a two-port, at rest and along its stroke."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.box import SIMPLE
from rich.table import Table

from bellcrank.cli.app import app
from bellcrank.cli.arguments import (
    UNLOADED_BEAMS,
    DesignName,
    ModelName,
    design_in_model,
    design_named,
)
from bellcrank.cli.console import announce_compilation, notes, plain, print_json, results
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from bellcrank.machines import Characterisation, PortCurve, TwoPort

RECORD, PICTURE = "two-port.json", "two-port.png"


@app.command()
def characterise(
    design: DesignName,
    points: Annotated[int, typer.Option(help="Number of increments of the stroke.")] = 20,
    load: Annotated[
        list[str] | None,
        typer.Option(
            help="Load at the output: free, blocked, spring:STIFFNESS or force:FORCE (negative if "
            "it resists), in lattice units; repeatable. \\[free, blocked, matched spring]"
        ),
    ] = None,
    model: ModelName = None,
    unloaded_beams: Annotated[
        str,
        typer.Option(help=f"{UNLOADED_BEAMS} Springs only: frames do not depend on them."),
    ] = "keep",
    out: Annotated[
        Path | None,
        typer.Option(
            help="Output: a record (json), a picture (png, svg, pdf), or a folder for both, "
            f"{RECORD} and {PICTURE}."
        ),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace existing files.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the record.")] = False,
) -> None:
    """Compute stiffness and efficiency at input and output, at rest and along the stroke."""
    from bellcrank.machines import (
        Load,
        characterisation_to_dict,
        characterise,
        write_characterisation,
    )
    from bellcrank.machines.pictures import draw_characterisation

    chosen = design_in_model(design_named(design), model)
    loads = None if load is None else [Load.read(text) for text in load]
    if points < 1:
        raise InvalidSettings(f"--points: expected at least one, got {points}")
    targets = _targets(out, overwrite=overwrite)
    announce_compilation()
    found = characterise(chosen, loads, points, unloaded_beams=unloaded_beams)  # type: ignore[arg-type]
    if as_json:
        print_json(json.dumps(characterisation_to_dict(found), indent=1))
    else:
        _print(found, design)
    for target in targets:
        if target.suffix == ".json":
            write_characterisation(found, target, overwrite=overwrite)
        else:
            draw_characterisation(found, target, title=design, overwrite=overwrite)
        notes.print(f"wrote {plain(target)}")


def _targets(out: Path | None, *, overwrite: bool) -> list[Path]:
    """Return the files to write; check before the computation that they can be written."""
    from bellcrank.model.storage import already_exists, check_folder
    from bellcrank.plots.saving import FORMATS, check_target

    if out is None:
        return []
    if out.suffix.lower() in FORMATS:
        check_target(out, overwrite=overwrite)
        check_folder(out)
        return [out]
    if out.suffix.lower() == ".json":
        targets = [out]
        check_folder(out)
    elif out.suffix and not out.is_dir():
        raise InvalidSettings(
            f"{out}: expected a record (.json), a picture ({', '.join(FORMATS)}) or a folder"
        )
    else:
        targets = [out / RECORD, out / PICTURE]
        if out.exists() and not out.is_dir():
            raise already_exists(out)
    for target in targets:
        if target.exists() and not overwrite:
            raise already_exists(target)
    if len(targets) > 1:
        out.mkdir(parents=True, exist_ok=True)
    return targets


def _print(found: Characterisation, name: str) -> None:
    """Print the two-port and the end of each curve."""
    results.print(f"{plain(name)}: {found.beams} beams; {found.model}; lattice units")
    linear = Table("at rest", "", box=SIMPLE)
    for label, value in _figures(found.rest):
        linear.add_row(label, value)
    results.print(linear)
    results.print("at the end of the stroke, external forces:")
    stroke = Table(box=SIMPLE)
    for heading in ("load", "u_in", "F_in", "u_out", "u_out/u_in", "F_out", "status"):
        stroke.add_column(heading, overflow="fold")  # never cut off a figure
    for curve in found.curves:
        stroke.add_row(*_ending(curve))
    results.print(stroke)
    for warning in found.warnings:
        notes.print(f"[yellow]warning:[/] {plain(warning)}")


def _figures(rest: TwoPort) -> list[tuple[str, str]]:
    """Return the rows of a linear two-port."""
    rows = [
        ("efficiency, output free", rest.efficiency),
        ("input stiffness, output free", rest.input_stiffness),
        ("input stiffness, output blocked", rest.blocked_input_stiffness),
        ("output stiffness, input held", rest.output_stiffness),
        ("blocked force per input motion", rest.transmitted_stiffness),
        ("blocked force over input force", rest.force_efficiency),
        ("coupling", rest.coupling),
    ]
    if rest.connected:
        rows += [
            ("matched spring (takes the most work)", rest.matched_spring),
            ("  its share of the input work", rest.best_work_share),
        ]
    return [(label, _figure(value)) for label, value in rows]


def _ending(curve: PortCurve) -> list[str]:
    """Return the row of the last state of a curve."""
    figures = (
        curve.motion[-1], curve.input_force[-1], curve.output[-1], curve.efficiency[-1],
        curve.output_force[-1],
    )  # fmt: skip
    status = curve.status.label
    if curve.reached < 1.0:
        status = f"{status} at {curve.reached:.1%}"
    return [curve.load.label, *(_figure(value) for value in figures), status]


def _figure(value: float) -> str:
    """Return four digits, 0 for rounding errors, a dash for a value that is not finite."""
    if not math.isfinite(value):
        return "-"
    return "0" if abs(value) < 1e-12 else f"{value:.4g}"
