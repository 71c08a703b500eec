"""`bellcrank evaluate`: responses of given designs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.box import SIMPLE
from rich.table import Table

from bellcrank.cli.app import app
from bellcrank.cli.arguments import UNLOADED_BEAMS, ModelName, design_in_model, design_named
from bellcrank.cli.console import announce_compilation, print_json, results, text_grid


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
    model: ModelName = None,
    elements: Annotated[
        int | None,
        typer.Option(
            help="Number of linear elements of each beam of a frame. \\[one that includes the "
            "shortening of bent beams, as in searches]"
        ),
    ] = None,
    objective: Annotated[
        str | None,
        typer.Option(help="displacement, directional:N or force. \\[that of the design]"),
    ] = None,
    unloaded_beams: Annotated[
        str,
        typer.Option(help=f"{UNLOADED_BEAMS} Springs only: frames do not depend on them."),
    ] = "keep",
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Compute the response of designs, each from rest to the full stroke."""
    from bellcrank.mechanics import (
        VERIFICATION_INCREMENT,
        model_evaluator,
        objective_name,
    )
    from bellcrank.model import pack_mask, read_masks
    from bellcrank.workflows import spec_for
    from bellcrank.workflows.figures import figure_text, figures_of, model_record, model_words
    from bellcrank.workflows.specification import item_data, item_rows, results_for

    design = design_named(problem)
    masks = read_masks(designs, design.problem) if designs else [design.mask]
    task = design_in_model(design, model).problem
    evaluator = model_evaluator(task, objective, unloaded_beams, elements)  # type: ignore[arg-type]
    about = {
        "objective": objective_name(task, objective),
        **model_record(task, elements),
    }
    announce_compilation()
    rows, items = [], []
    for mask in masks:
        response = evaluator.evaluate(mask, VERIFICATION_INCREMENT)
        row = {"mask": pack_mask(mask), **figures_of(evaluator, response)}
        found = results_for(task, mask, elements)
        if found is not None:
            part = spec_for(design)
            model = model_words(task, elements)
            row["specification"] = item_data(task, part, {model: found})
            items.append(item_rows(task, part, {model: found}))
        rows.append({**row, "beams": int(mask.sum()), **about})
    if as_json:
        print_json(json.dumps({"results": rows}, indent=1))
        return
    columns = ("design", "beams", "efficiency", "off-axis", "rotation", "energy", "status")
    caption = f"efficiency ({about['objective']}), {model_words(task, elements)}"
    table = Table(*columns, box=SIMPLE, caption=caption)
    for number, row in enumerate(rows):
        table.add_row(
            str(number), str(row["beams"]), figure_text(row["efficiency"], "{:.7f}"),
            figure_text(row["off_axis"], "{:.1%}"),
            figure_text(row["output_rotation_deg"], "{:.2f} deg"),
            figure_text(row["energy"], "{:.7f}"), row["status"],
        )  # fmt: skip
    results.print(table)
    for number, texts in enumerate(items):
        if len(items) > 1:
            results.print(f"design {number}")
        results.print(text_grid(texts))
