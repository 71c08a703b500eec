"""`bellcrank evaluate`: responses of given designs."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.box import SIMPLE
from rich.table import Table

from bellcrank.cli.app import app
from bellcrank.cli.arguments import UNLOADED_BEAMS, design_named
from bellcrank.cli.console import announce_compilation, print_json, results

if TYPE_CHECKING:
    from bellcrank.mechanics import Response


@app.command()
def evaluate(
    problem: Annotated[
        str,
        typer.Argument(help="Bundled problem, problem file, design file or result folder."),
    ],
    designs: Annotated[
        Path | None,
        typer.Option(help="JSON file with results\\[].mask or masks. \\[the design itself]"),
    ] = None,
    objective: Annotated[
        str | None,
        typer.Option(help="displacement, directional:N or force. \\[that of the design]"),
    ] = None,
    unloaded_beams: Annotated[
        str,
        typer.Option(help=UNLOADED_BEAMS),
    ] = "keep",
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Compute the response of designs, each from rest to the full stroke."""
    from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, objective_name
    from bellcrank.model import pack_mask, read_masks

    design = design_named(problem)
    masks = read_masks(designs, design.problem) if designs else [design.mask]
    evaluator = SpringEvaluator(design.problem, objective, unloaded_beams)  # type: ignore[arg-type]
    ratio = objective_name(design.problem, objective)
    announce_compilation()
    rows = []
    for mask in masks:
        response = evaluator.evaluate(mask, VERIFICATION_INCREMENT)
        row = {"mask": pack_mask(mask), **_row(response)}
        rows.append({**row, "beams": int(mask.sum()), "objective": ratio})
    if as_json:
        print_json(json.dumps({"results": rows}, indent=1))
        return
    table = Table("design", "beams", f"efficiency ({ratio})", "energy", "status", box=SIMPLE)
    for number, row in enumerate(rows):
        table.add_row(
            str(number), str(row["beams"]), _number(row["efficiency"]), _number(row["energy"]),
            row["status"],
        )  # fmt: skip
    results.print(table)


def _row(response: Response) -> dict[str, Any]:
    """Return a response as plain data; numbers that are not finite become null."""
    numbers = {"efficiency": response.efficiency, "energy": response.energy}
    return {
        **{name: value if math.isfinite(value) else None for name, value in numbers.items()},
        "status": response.status.label,
    }


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.7f}"
