"""`bellcrank explain`: which beams matter, to a trained network and to the mechanics."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.box import SIMPLE
from rich.table import Table

from bellcrank.cli.app import app
from bellcrank.cli.arguments import DesignName, design_named
from bellcrank.cli.checkout import require_reproduction
from bellcrank.cli.console import (
    announce_compilation,
    notes,
    plain,
    print_json,
    results,
    warn_of_other_stiffness,
)
from bellcrank.cli.predict import Device, ModelFile

if TYPE_CHECKING:
    from reproduction.networks.attribution import Attribution

LABELS = {
    "low_rank": "low-rank update",
    "network": "network, flips",
    "occlusion": "network, white and black block",
    "white": "network, white block",
    "black": "network, black block",
}


@app.command()
def explain(
    what: DesignName,
    model: ModelFile = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Picture to write (png, svg, pdf). \\[NAME-explained.png; with --json none]"
        ),
    ] = None,
    block: Annotated[
        int | None, typer.Option(help="Side of the occluding block in pixels. \\[12]")
    ] = None,
    stride: Annotated[
        int | None, typer.Option(help="Distance of positions of the block in pixels. \\[4]")
    ] = None,
    device: Device = "auto",
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the picture.")] = False,
) -> None:
    """Compare which beams matter to a trained network and to the mechanics."""
    require_reproduction()
    from bellcrank.plots.saving import check_target
    from bellcrank.surrogate.backend import import_torch
    from bellcrank.surrogate.predictor import load_model

    design = design_named(what)
    import_torch()
    from reproduction.networks.attribution import Block, attribute
    from reproduction.networks.attribution_picture import draw_attribution

    given = {
        key: value for key, value in (("size", block), ("stride", stride)) if value is not None
    }
    target = out
    if target is None and not as_json:
        target = Path(f"{design.problem.name}-explained.png")
    if target is not None:
        check_target(target, overwrite=overwrite)
    network = load_model(design.problem, model, any_stiffness=True)
    announce_compilation()
    found = attribute(network, design, Block(**given) if given else None, device=device)
    warn_of_other_stiffness(design.problem, found.design.problem, "explained")
    if target is not None:
        draw_attribution(found, target, overwrite=overwrite)
    if as_json:
        print_json(json.dumps(found.to_dict(), indent=1))
    else:
        _print_agreements(found)
    if target is not None:
        notes.print(f"wrote {plain(target)}")


def _print_agreements(found: Attribution) -> None:
    results.print(
        f"{plain(found.design.problem.name)}: efficiency {found.efficiency:.4f} by mechanics, "
        f"{found.predicted:.4f} by {plain(found.architecture)}"
    )
    table = Table("predicted by", "flips", "count", "Pearson", "Spearman", "top 30", box=SIMPLE)
    for name, subsets in found.correlations().items():
        for subset, one in subsets.items():
            if one.count:
                figures = [_figure(value) for value in (one.pearson, one.spearman, one.recall)]
                label = LABELS[name] if subset == "all" else ""
                table.add_row(label, subset, str(one.count), *figures)
    results.print(table)


def _figure(value: float) -> str:
    return "-" if value != value else f"{value:.3f}"  # noqa: PLR0124  (nan)
