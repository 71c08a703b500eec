"""`bellcrank characterise`: an actuator as others meet it, at its input and its output."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.box import SIMPLE
from rich.table import Table

from bellcrank.cli.app import app
from bellcrank.cli.arguments import DesignName, design_named
from bellcrank.cli.console import announce_compilation, notes, plain, print_json, results
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from bellcrank.machines import Characterisation, PortCurve, TwoPort

RECORD, PICTURE = "two-port.json", "two-port.png"


@app.command()
def characterise(
    design: DesignName,
    points: Annotated[int, typer.Option(help="Equal increments of the stroke.")] = 20,
    load: Annotated[
        list[str] | None,
        typer.Option(
            help="free, blocked, spring:STIFFNESS or force:FORCE (below 0 resists), in lattice "
            "units; may be given several times. \\[free, blocked, the best spring]"
        ),
    ] = None,
    unloaded_beams: Annotated[
        str,
        typer.Option(help="counted (literal model), ignored (dead ends) or stripped (idle parts)."),
    ] = "keep",
    potential: Annotated[
        bool, typer.Option("--potential", help="Fit potentials for chains of actuators too.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Where to keep it: a record (json), a picture (png, svg, pdf), or a folder for "
            f"{RECORD} and {PICTURE}."
        ),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace what is there.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the record.")] = False,
) -> None:
    """Say how a design answers at its two ports: stiffness, efficiency under load, stroke."""
    from bellcrank.machines import (
        Load,
        characterisation_to_dict,
        characterise,
        write_characterisation,
    )
    from bellcrank.machines.pictures import draw_characterisation

    chosen = design_named(design)
    loads = None if load is None else [Load.read(text) for text in load]
    if points < 1:
        raise InvalidSettings(f"--points: expected at least one, got {points}")
    targets = _targets(out, overwrite=overwrite)
    announce_compilation()
    found = characterise(
        chosen, loads, points, unloaded_beams=unloaded_beams, potentials=potential  # type: ignore[arg-type]
    )  # fmt: skip
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
    """Return the files to write, refused before anything is computed if they cannot be."""
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
            f"{out}: expected a record ending in .json, a picture ending in {', '.join(FORMATS)}, "
            "or a folder"
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
    results.print(f"{plain(name)}: {found.beams} beams; lattice units")
    linear = Table("at rest", "", box=SIMPLE)
    for label, value in _figures(found.rest):
        linear.add_row(label, value)
    results.print(linear)
    results.print("at the end of the stroke, forces from outside:")
    stroke = Table(box=SIMPLE)
    for heading in ("load", "u_in", "F_in", "u_out", "u_out/u_in", "F_out", "status"):
        stroke.add_column(heading, overflow="fold")  # a figure is not to be cut off
    for curve in found.curves:
        stroke.add_row(*_ending(curve))
    results.print(stroke)
    for kind, fitted in found.potentials.items():
        results.print(
            f"potential by {kind} ports: degree {fitted.degree}, off by "
            f"{fitted.typical_error.max():.2%} typically, {fitted.error.max():.2%} at most "
            f"({fitted.held_out} equilibria held out)"
        )
    for doubt in found.doubts:
        notes.print(f"[yellow]note:[/] {plain(doubt)}")


def _figures(rest: TwoPort) -> list[tuple[str, str]]:
    """Return the figures of a linear two-port, in words."""
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
            ("spring that takes the most work", rest.matched_spring),
            ("  and its share", rest.best_work_share),
        ]
    return [(label, _figure(value)) for label, value in rows]


def _ending(curve: PortCurve) -> list[str]:
    """Return the last state of a curve, in words."""
    figures = (
        curve.motion[-1], curve.input_force[-1], curve.output[-1], curve.efficiency[-1],
        curve.output_force[-1],
    )  # fmt: skip
    status = curve.status.label
    if curve.reached < 1.0:
        status = f"{status} at {curve.reached:.1%}"
    return [curve.load.label, *(_figure(value) for value in figures), status]


def _figure(value: float) -> str:
    """Return four digits; rounding errors are nothing, and what is no number is a dash."""
    if not math.isfinite(value):
        return "-"
    return "0" if abs(value) < 1e-12 else f"{value:.4g}"
