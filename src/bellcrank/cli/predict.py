"""`bellcrank predict`: efficiencies predicted by a trained network, in the form of `evaluate`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.box import SIMPLE
from rich.table import Table

from bellcrank.cli.app import app
from bellcrank.cli.arguments import design_named
from bellcrank.cli.console import print_json, results, warn_of_other_stiffness

STATUS = "predicted"
"""Status of a prediction, in place of that of an equilibrium."""

ModelFile = Annotated[
    Path | None,
    typer.Option(
        "--model", help="Trained network: a file, or the folder of a training. \\[bundled network]"
    ),
]
Device = Annotated[str, typer.Option(help="Where the network is evaluated: auto, cpu or cuda.")]


@app.command()
def predict(
    problem: Annotated[str, typer.Argument(help="Bundled problem, problem file or design.")],
    designs: Annotated[
        Path | None,
        typer.Option(
            help="JSON file with results\\[].mask or masks. \\[the initial design of the problem]"
        ),
    ] = None,
    model: ModelFile = None,
    device: Device = "auto",
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Predict the efficiency of designs with a trained network, without mechanics."""
    import numpy as np

    from bellcrank.model import pack_mask, read_masks
    from bellcrank.surrogate.predictor import load_predictor

    design = design_named(problem)
    masks = read_masks(designs, design.problem) if designs else [design.mask]
    predictor = load_predictor(design.problem, model, device=device, any_stiffness=True)
    warn_of_other_stiffness(design.problem, predictor.problem, "predicted")
    stacked = np.array(masks, np.bool_).reshape(len(masks), -1)
    efficiency = predictor.predict(stacked).tolist()
    if as_json:
        rows = [
            {
                "mask": pack_mask(mask),
                "efficiency": value,
                "energy": None,
                "status": STATUS,
                "beams": int(mask.sum()),
            }
            for mask, value in zip(stacked, efficiency, strict=True)
        ]
        print_json(json.dumps({"results": rows}, indent=1))
        return
    table = Table("design", "beams", "efficiency", box=SIMPLE)
    for number, (mask, value) in enumerate(zip(stacked, efficiency, strict=True)):
        table.add_row(str(number), str(int(mask.sum())), f"{value:.4f}")
    results.print(table)
