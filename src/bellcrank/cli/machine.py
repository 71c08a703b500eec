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
from bellcrank.cli.arguments import ModelName, design_in_model
from bellcrank.cli.console import announce_compilation, notes, plain, print_json, results
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bellcrank.machines import Machine, Plan, PortCurve, TwoPort
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
    model: ModelName = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace existing files.")] = False,
    as_json: AsJson = False,
) -> None:
    """Assemble a machine into one design, evaluate it, and write it."""
    from dataclasses import replace

    from bellcrank.machines.bundled import find_plan
    from bellcrank.mechanics import VERIFICATION_INCREMENT, model_evaluator
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
    built = _assemble(found, model)
    announce_compilation()
    response = model_evaluator(built.design.problem).evaluate(
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
            **{name: record[name] for name in ("name", "model", "nodes", "beams", "designable")},
            parts=", ".join(record["parts"]),
            efficiency=f"{value}{status}",
        )
    notes.print(f"wrote {plain(target)}")


@machine.command()
def predict(
    plan: PlanName,
    points: Annotated[int, typer.Option(help="Number of increments of the stroke.")] = 20,
    model: ModelName = None,
    as_json: AsJson = False,
) -> None:
    """Predict a machine from its condensed parts, and simulate its whole lattice."""
    from bellcrank.machines import assembled_ports, simulate, two_port_at
    from bellcrank.machines import predict as predict_curve
    from bellcrank.machines.bundled import find_plan

    if points < 1:
        raise InvalidSettings(f"--points: expected at least one, got {points}")
    built = _assemble(find_plan(plan), model)
    announce_compilation()
    parts = assembled_ports(built)
    rest = two_port_at(parts, parts.rest())
    predicted, simulated = predict_curve(built, points), simulate(built, points)
    if as_json:
        print_json(json.dumps(_prediction(built, rest, predicted, simulated), indent=1))
        return
    rows = {
        "name": built.design.problem.name,
        "model": _model(built),
        "efficiency at rest": f"{rest.efficiency:.4f}",
        "input stiffness at rest": f"{rest.input_stiffness:.4g}",
        **dict(_endings(("predicted from its parts", predicted), ("simulated", simulated))),
    }
    _print_rows(**rows)
    columns = ("u_in", "u_out", "u_out, simulated", "u_out/u_in", "F_in", "energy")
    table = Table(*columns, box=SIMPLE)
    count = min(len(predicted.motion), len(simulated.motion)) - 1
    for point in sorted({math.ceil(count * row / ROWS) for row in range(1, ROWS + 1)} - {0}):
        values = (
            predicted.motion, predicted.output, simulated.output, predicted.efficiency,
            predicted.input_force, predicted.energy,
        )  # fmt: skip
        table.add_row(*(f"{value[point]:.4g}" for value in values))
    results.print(table)


def _endings(*curves: tuple[str, PortCurve]) -> Iterator[tuple[str, str]]:
    """Yield label and efficiency at the end of the stroke for each curve."""
    for label, curve in curves:
        where = "full stroke"
        if curve.reached < 1.0:
            where = f"{curve.reached:.1%} of the stroke, where it snaps"
        last = f"{curve.efficiency[-1]:.4f}" if len(curve.motion) > 1 else "-"
        yield f"efficiency, {label}, {where}", last


def _assemble(plan: Plan, model: str | None) -> Machine:
    """Assemble a machine; files of parts are relative to the plan."""
    from bellcrank.machines import assemble

    return assemble(plan, partial(_find_part, Path(plan.source).parent, model))


def _find_part(folder: Path, model: str | None, entry: str) -> Design:
    """Return the design of a part: a file beside the plan, or a named design."""
    from bellcrank.workflows import find_design

    path = folder / entry
    return design_in_model(find_design(str(path) if path.exists() else entry), model)


def _model(built: Machine) -> str:
    from bellcrank.mechanics import model_name

    return model_name(built.design.problem)


def _record(built: Machine, response: Response) -> dict[str, Any]:
    """Return the figures of a machine as plain data."""
    problem = built.design.problem
    return {
        "name": problem.name,
        "model": _model(built),
        "parts": list(built.parts),
        "nodes": problem.lattice.node_count,
        "beams": built.design.beam_count,
        "designable": len(problem.designable),
        "efficiency": response.efficiency if math.isfinite(response.efficiency) else None,
        "status": response.status.label,
    }


def _prediction(
    built: Machine, rest: TwoPort, predicted: PortCurve, simulated: PortCurve
) -> dict[str, Any]:
    """Return prediction and simulation as plain data."""
    return {
        "name": built.design.problem.name,
        "model": _model(built),
        "parts": list(built.parts),
        "rest": {"efficiency": rest.efficiency, "input_stiffness": rest.input_stiffness},
        "prediction": _curve(predicted),
        "simulation": _curve(simulated),
    }


def _curve(curve: PortCurve) -> dict[str, Any]:
    """Return a curve as plain data."""
    columns = ("motion", "output", "input_force", "energy")
    return {
        "efficiency": float(curve.efficiency[-1]) if len(curve.motion) > 1 else None,
        "status": curve.status.label,
        "reached": curve.reached,
        **{name: getattr(curve, name).tolist() for name in columns},
    }


def _print_rows(**rows: object) -> None:
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    for label, value in rows.items():
        table.add_row(label, plain(str(value)))
    results.print(table)
