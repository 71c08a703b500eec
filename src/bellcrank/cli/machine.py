"""`bellcrank machine`: actuators that push each other, as one design."""

from __future__ import annotations

import json
import math
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from bellcrank.cli.app import app
from bellcrank.cli.console import announce_compilation, notes, plain, print_json, results
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from bellcrank.machines.assembly import Machine
    from bellcrank.mechanics import Response
    from bellcrank.model import Design

machine = typer.Typer(
    name="machine",
    help="Machines: actuators that push each other.",
    rich_markup_mode="rich",
)
app.add_typer(machine)

PlanName = Annotated[
    str, typer.Argument(help="A machine's plan, TOML, or a name of `bellcrank machine list`.")
]


@machine.command(name="list")
def list_machines() -> None:
    """List the machines that come with the package."""
    from bellcrank.machines.showcases import find_plan, showcases

    table = Table(box=None, header_style="bold", padding=(0, 2, 0, 0))
    for heading in ("machine", "parts", "about"):
        table.add_column(heading)
    for name in showcases():
        plan = find_plan(name).table
        table.add_row(name, str(len(plan.parts)), plain(plan.about))
    results.print(table)


@machine.command()
def build(
    plan: PlanName,
    out: Annotated[
        Path | None, typer.Option(help="Design to write; default: beside the plan, or NAME.json.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace what is there.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Make one lattice of a machine's parts, and say what it does."""
    from dataclasses import replace

    from bellcrank.machines.assembly import assemble
    from bellcrank.machines.showcases import find_plan
    from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator
    from bellcrank.model import write_design
    from bellcrank.model.storage import already_exists, check_folder

    found = find_plan(plan)
    target = out or Path(plan).with_suffix(".json")
    if target.suffix.lower() != ".json":
        raise InvalidSettings(f"{target}: expected a name ending in .json, as a design is written")
    check_folder(target)
    if target.exists() and not overwrite:
        raise already_exists(target)
    start = time.perf_counter()
    built = assemble(found, partial(find_part, Path(found.source).parent))
    announce_compilation()
    response = SpringEvaluator(built.design.problem).evaluate(
        built.design.mask, VERIFICATION_INCREMENT
    )
    seconds = time.perf_counter() - start
    efficiency = response.efficiency if math.isfinite(response.efficiency) else None
    write_design(replace(built.design, efficiency=efficiency), target, overwrite=overwrite)
    if as_json:
        print_json(json.dumps({**_record(built, response), "seconds": round(seconds, 3)}, indent=1))
    else:
        results.print(_table(built, response))
    notes.print(f"wrote {plain(target)}")


def find_part(folder: Path, entry: str) -> Design:
    """Return the design of a part: a file beside the plan, or what is known by that name."""
    from bellcrank.workflows import find_design

    beside = folder / entry
    return find_design(str(beside) if beside.exists() else entry)


def _record(built: Machine, response: Response) -> dict[str, Any]:
    """Return what is told about a machine, as plain data."""
    problem = built.design.problem
    sound = math.isfinite(response.efficiency)
    return {
        "name": problem.name,
        "parts": list(built.parts),
        "nodes": problem.lattice.node_count,
        "beams": built.design.beam_count,
        "designable": len(problem.designable),
        "efficiency": response.efficiency if sound else None,
        "status": response.status.label,
    }


def _table(built: Machine, response: Response) -> Table:
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    told = _record(built, response)
    for name in ("name", "nodes", "beams", "designable"):
        table.add_row(name, plain(told[name]))
    table.add_row("parts", plain(", ".join(told["parts"])))
    value = "-" if told["efficiency"] is None else f"{told['efficiency']:.4f}"
    status = "" if response.is_admissible else f" ({response.status.message})"
    table.add_row("efficiency", f"{value}{status}")
    return table
