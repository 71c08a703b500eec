"""`bellcrank machine predict`: what a machine does, foretold from its parts."""

from __future__ import annotations

import json
import math
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.box import SIMPLE
from rich.table import Table

from bellcrank.cli.console import announce_compilation, notes, plain, print_json, results
from bellcrank.cli.machine import PlanName, find_part, machine
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from bellcrank.machines import Check, Foretold, Machine, Prediction

ROWS = 5
"""Points of the stroke that are printed."""


@machine.command()
def predict(
    plan: PlanName,
    stroke: Annotated[
        bool, typer.Option("--stroke", help="Along the whole stroke too, by tables of the parts.")
    ] = False,
    points: Annotated[int, typer.Option(help="Equal increments of the stroke.")] = 20,
    live: Annotated[
        bool, typer.Option("--live", help="Follow the parts themselves instead of tables.")
    ] = False,
    check: Annotated[
        bool, typer.Option("--check", help="Simulate the whole machine too, and compare.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="Where to keep the stroke: json, or a picture (png, svg, pdf)."),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace what is there.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Foretell what a machine does, by chaining its condensed parts."""
    from bellcrank.machines import assemble, foretold_to_dict, predict
    from bellcrank.machines.showcases import find_plan

    if not stroke and (live or check or out is not None):
        raise InvalidSettings("--live, --check and --out are about the whole stroke: add --stroke")
    if points < 1:
        raise InvalidSettings(f"--points: expected at least one, got {points}")
    _check_out(out, overwrite=overwrite)
    chosen = find_plan(plan)
    built = assemble(chosen, partial(find_part, Path(chosen.source).parent))
    announce_compilation()
    predict(built)  # the first time, kernels are loaded
    start = time.perf_counter()
    linear = predict(built)
    told = _linear_told(built, linear, time.perf_counter() - start)
    if not stroke:
        _say(told, linear, as_json=as_json)
        return
    found = _foretell(built, points, live=live)
    compared = _simulate(built, found, points, told) if check else None
    told["stroke"] = foretold_to_dict(found, compared)
    if out is not None:
        _keep(told, found, compared, out, overwrite=overwrite)
    _say(told, linear, as_json=as_json)
    if not as_json:
        _print(found, compared, told)


def _check_out(out: Path | None, *, overwrite: bool) -> None:
    """Refuse a file before anything is computed if it cannot be written."""
    from bellcrank.model.storage import already_exists, check_folder
    from bellcrank.plots.saving import FORMATS

    if out is None:
        return
    if out.suffix.lower() not in {".json", *FORMATS}:
        raise InvalidSettings(
            f"{out}: expected a name ending in .json, or a picture ending in {', '.join(FORMATS)}"
        )
    check_folder(out)
    if out.exists() and not overwrite:
        raise already_exists(out)


def _linear_told(built: Machine, linear: Prediction, seconds: float) -> dict[str, Any]:
    return {
        "name": built.design.problem.name,
        "parts": list(built.parts),
        "efficiency": linear.efficiency,
        "input_stiffness": linear.input_stiffness,
        "seconds": round(seconds, 4),
    }


def _foretell(built: Machine, points: int, *, live: bool) -> Foretold:
    from bellcrank.machines import foretell
    from bellcrank.machines.shelf import usual_folder

    return foretell(
        built, points, live=live, folder=usual_folder(), tell=lambda what: notes.print(plain(what))
    )


def _simulate(built: Machine, found: Foretold, points: int, told: dict[str, Any]) -> Check:
    from bellcrank.machines import compare, simulate

    notes.print("simulating the whole machine")
    simulate(built, 1)  # the first time, kernels are loaded
    start = time.perf_counter()
    simulated = simulate(built, points)
    told["simulation_seconds"] = round(time.perf_counter() - start, 4)
    return compare(found, simulated)


def _keep(
    told: dict[str, Any], found: Foretold, compared: Check | None, out: Path, *, overwrite: bool
) -> None:
    from bellcrank.machines.pictures import draw_stroke
    from bellcrank.model.storage import write_text

    if out.suffix.lower() == ".json":
        write_text(out, json.dumps(told, indent=1) + "\n", overwrite=overwrite)
    else:
        draw_stroke(found, compared, out, title=told["name"], overwrite=overwrite)
    notes.print(f"wrote {plain(out)}")


def _say(told: dict[str, Any], linear: Prediction, *, as_json: bool) -> None:
    if as_json:
        print_json(json.dumps(told, indent=1))
        return
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_row("name", plain(told["name"]))
    table.add_row("efficiency, small strokes", f"{linear.efficiency:.4f}")
    if "stroke" in told:
        whole, reached = told["stroke"]["efficiency"], told["stroke"]["reached"]
        where = "full stroke" if reached == 1.0 else f"at {reached:.1%} of the stroke"
        table.add_row(f"efficiency, {where}", "-" if whole is None else f"{whole:.4f}")
    table.add_row("input stiffness", f"{linear.input_stiffness:.4g}")
    table.add_row("chained in", f"{1e3 * told['seconds']:.0f} ms")
    results.print(table)


def _simulated(compared: Check, seconds: float) -> str:
    """Say what the whole machine does, and how far off the parts were."""
    whole = compared.simulated
    efficiency = f"{whole.efficiency[-1]:.4f}" if len(whole.motion) > 1 else "-"
    where = "the end"
    if whole.reached < 1.0:
        where = f"{whole.reached:.1%} of the stroke, where stability is lost"
    return (
        f"simulated in {1e3 * seconds:.0f} ms: efficiency {efficiency} at {where}; foretold motion "
        f"off by {compared.output_error:.2%} at most, force by {compared.force_error:.2%}"
    )


def _print(found: Foretold, compared: Check | None, told: dict[str, Any]) -> None:
    """Print some points of the stroke, what stood for the parts, and how good it is."""
    curve = Table("u_in", "u_out", "u_out/u_in", "F_in", "energy", box=SIMPLE)
    last = len(found.motion) - 1
    for point in sorted({math.ceil(last * row / ROWS) for row in range(1, ROWS + 1)} - {0}):
        motion, output = found.motion[point], found.output[point]
        figures = (motion, output, output / motion, found.input_force[point], found.energy[point])
        curve.add_row(*(f"{figure:.4g}" for figure in figures))
    results.print(curve)
    kinds = {
        "usual": "its usual table", "around": "a table around its way here",
        "linear": "its tangent at rest", "itself": "itself, followed",
    }  # fmt: skip
    parts = Table("part", "stands for it", "degree", "error, typical", "error, largest", box=SIMPLE)
    for stand in found.stands:
        fit = stand.fit
        errors = ("", "", "") if fit is None else (
            str(fit.degree), f"{fit.typical_error.max():.2%}", f"{fit.error.max():.2%}"
        )  # fmt: skip
        parts.add_row(plain(stand.name), kinds[stand.kind], *errors)
    results.print(parts)
    results.print(f"the stroke was followed in {1e3 * found.seconds:.0f} ms")
    if compared is not None:
        results.print(_simulated(compared, told["simulation_seconds"]))
    for doubt in found.doubts:
        notes.print(f"[yellow]note:[/] {plain(doubt)}")
