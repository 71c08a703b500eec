"""`bellcrank machine`: machines of several actuators, assembled into one design."""

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

from bellcrank.cli.app import app
from bellcrank.cli.console import announce_compilation, notes, plain, print_json, results
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from bellcrank.machines import LinearResponse, Machine, Plan, PortCurve
    from bellcrank.mechanics import Response
    from bellcrank.model import Design

ROWS = 5
"""Number of points of the stroke that are printed."""

machine = typer.Typer(
    name="machine",
    help="Machines: actuators that drive each other.",
    rich_markup_mode="rich",
)
app.add_typer(machine)

PlanName = Annotated[
    str, typer.Argument(help="Plan of a machine (TOML), or a name of `bellcrank machine list`.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]


@machine.command(name="list")
def list_machines() -> None:
    """List the bundled machines."""
    from bellcrank.machines.bundled import bundled_machines, find_plan
    from bellcrank.machines.bundled.contact import bundled_contact

    table = Table(box=None, header_style="bold", padding=(0, 2, 0, 0))
    for heading in ("machine", "parts", "about", "contact of 2 mm struts"):
        table.add_column(heading)
    for name in bundled_machines():
        plan, contact = find_plan(name).table, bundled_contact(name)
        table.add_row(name, str(len(plan.parts)), plain(plan.about), contact.message)
    results.print(table)


@machine.command()
def build(
    plan: PlanName,
    out: Annotated[
        Path | None,
        typer.Option(help="Design file to write. \\[NAME.json, beside a plan file]"),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace existing files.")] = False,
    as_json: AsJson = False,
) -> None:
    """Assemble a machine into one design, evaluate it, and write it."""
    from dataclasses import replace

    from bellcrank.machines.bundled import find_plan
    from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator
    from bellcrank.model import write_design
    from bellcrank.model.storage import already_exists, check_folder

    found = find_plan(plan)
    target = out or Path(plan).with_suffix(".json")
    if target.suffix.lower() != ".json":
        raise InvalidSettings(f"{target}: expected a file name ending in .json, for a design")
    check_folder(target)
    if target.exists() and not overwrite:
        raise already_exists(target)
    start = time.perf_counter()
    built = _assemble(found)
    announce_compilation()
    response = SpringEvaluator(built.design.problem).evaluate(
        built.design.mask, VERIFICATION_INCREMENT
    )
    seconds = time.perf_counter() - start
    efficiency = response.efficiency if math.isfinite(response.efficiency) else None
    write_design(replace(built.design, efficiency=efficiency), target, overwrite=overwrite)
    record = _record(built, response)
    if as_json:
        print_json(json.dumps({**record, "seconds": round(seconds, 3)}, indent=1))
    else:
        status = "" if response.is_admissible else f" ({response.status.message})"
        value = "-" if efficiency is None else f"{efficiency:.4f}"
        _print_rows(
            **{name: record[name] for name in ("name", "nodes", "beams", "designable")},
            parts=", ".join(record["parts"]),
            efficiency=f"{value}{status}",
        )
    notes.print(f"wrote {plain(target)}")


@machine.command()
def predict(
    plan: PlanName,
    points: Annotated[int, typer.Option(help="Number of increments of the stroke.")] = 20,
    as_json: AsJson = False,
) -> None:
    """Compare the linear assembly of a machine with the simulation of its whole lattice."""
    from bellcrank.machines import linear_assembly, simulate
    from bellcrank.machines.bundled import find_plan

    if points < 1:
        raise InvalidSettings(f"--points: expected at least one, got {points}")
    built = _assemble(find_plan(plan))
    announce_compilation()
    linear = linear_assembly(built)
    curve = simulate(built, points)
    if as_json:
        print_json(json.dumps(_prediction(built, linear, curve), indent=1))
        return
    complete = curve.reached == 1.0
    where = "full stroke" if complete else f"{curve.reached:.1%} of the stroke, where it snaps"
    last = f"{curve.efficiency[-1]:.4f}" if len(curve.motion) > 1 else "-"
    rows = {
        "name": built.design.problem.name,
        "efficiency, linear assembly": f"{linear.efficiency:.4f}",
        f"efficiency, simulated, {where}": last,
        "input stiffness, linear assembly": f"{linear.input_stiffness:.4g}",
    }
    _print_rows(**rows)
    table = Table("u_in", "u_out", "u_out/u_in", "F_in", "energy", box=SIMPLE)
    count = len(curve.motion) - 1
    for point in sorted({math.ceil(count * row / ROWS) for row in range(1, ROWS + 1)} - {0}):
        values = (curve.motion, curve.output, curve.efficiency, curve.input_force, curve.energy)
        table.add_row(*(f"{value[point]:.4g}" for value in values))
    results.print(table)


def _assemble(plan: Plan) -> Machine:
    """Assemble a machine; files of parts are relative to the plan."""
    from bellcrank.machines import assemble

    return assemble(plan, partial(_find_part, Path(plan.source).parent))


def _find_part(folder: Path, entry: str) -> Design:
    """Return the design of a part: a file beside the plan, or a named design."""
    from bellcrank.workflows import find_design

    path = folder / entry
    return find_design(str(path) if path.exists() else entry)


def _record(built: Machine, response: Response) -> dict[str, Any]:
    """Return the figures of a machine as plain data."""
    problem = built.design.problem
    return {
        "name": problem.name,
        "parts": list(built.parts),
        "nodes": problem.lattice.node_count,
        "beams": built.design.beam_count,
        "designable": len(problem.designable),
        "efficiency": response.efficiency if math.isfinite(response.efficiency) else None,
        "status": response.status.label,
    }


def _prediction(built: Machine, linear: LinearResponse, curve: PortCurve) -> dict[str, Any]:
    """Return linear assembly and simulation as plain data."""
    columns = ("motion", "output", "input_force", "energy")
    return {
        "name": built.design.problem.name,
        "parts": list(built.parts),
        "linear": {"efficiency": linear.efficiency, "input_stiffness": linear.input_stiffness},
        "simulation": {
            "efficiency": float(curve.efficiency[-1]) if len(curve.motion) > 1 else None,
            "status": curve.status.label,
            "reached": curve.reached,
            **{name: getattr(curve, name).tolist() for name in columns},
        },
    }


def _print_rows(**rows: object) -> None:
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    for label, value in rows.items():
        table.add_row(label, plain(str(value)))
    results.print(table)
