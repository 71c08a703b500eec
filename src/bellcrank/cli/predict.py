"""`bellcrank predict`: what trained networks say of designs, in the form of `evaluate`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.box import SIMPLE
from rich.table import Table

from bellcrank.cli.app import app
from bellcrank.cli.arguments import design_named
from bellcrank.cli.console import print_json, results, warn_of_other_stiffness

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.surrogate.predictor import Prediction

STATUS = "predicted"
"""In place of how a search for an equilibrium ended: there was none."""

ModelFiles = Annotated[
    list[Path] | None,
    typer.Option(
        "--model",
        help="A trained model, or the folder of a training; repeat for several. "
        "\\[the one that comes with bellcrank]",
    ),
]
Device = Annotated[str, typer.Option(help="auto, cpu or cuda.")]


@app.command()
def predict(
    problem: Annotated[str, typer.Argument(help="A built-in problem, a problem or a design file.")],
    designs: Annotated[
        Path | None,
        typer.Option(help="JSON with results\\[].mask or masks; default: the initial design."),
    ] = None,
    model: ModelFiles = None,
    device: Device = "auto",
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Predict the efficiency of designs by a trained network, without any mechanics."""
    import numpy as np

    from bellcrank.learning.fitting import model_files
    from bellcrank.model import read_masks
    from bellcrank.surrogate.predictor import load_predictor

    design = design_named(problem)
    masks = read_masks(designs, design.problem) if designs else [design.mask]
    paths = [file for path in model or () for file in model_files(path)]
    predictor = load_predictor(design.problem, paths, device=device, any_stiffness=True)
    warn_of_other_stiffness(design.problem, predictor.problem, "predicted")
    stacked = np.array(masks, np.bool_).reshape(len(masks), -1)
    found = predictor.predict(stacked)
    if as_json:
        print_json(json.dumps({"results": _rows(stacked, found)}, indent=1))
        return
    table = Table("design", "beams", "efficiency", box=SIMPLE)
    if found.spread is not None:
        table.add_column("spread")
    for number, row in enumerate(_rows(stacked, found)):
        spread = [f"{row['spread']:.4f}"] if found.spread is not None else []
        table.add_row(str(number), str(row["beams"]), f"{row['efficiency']:.4f}", *spread)
    results.print(table)


def _rows(masks: NDArray[Any], found: Prediction) -> list[dict[str, Any]]:
    from bellcrank.model import pack_mask

    rows: list[dict[str, Any]] = []
    for number, mask in enumerate(masks):
        row = {
            "mask": pack_mask(mask),
            "efficiency": float(found.efficiency[number]),
            "energy": None,
            "status": STATUS,
            "beams": int(mask.sum()),
        }
        if found.spread is not None:
            row["spread"] = float(found.spread[number])
        rows.append(row)
    return rows
