"""`bellcrank explain`: which beams matter, to a trained network and to the mechanics."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

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

LABELS = {
    "white": "white block, present beams",
    "black": "black block, absent beams",
    "network": "flips predicted by the network",
    "low_rank": "flips predicted by low-rank updates",
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
    stride: Annotated[int, typer.Option(help="Distance of positions of the block in pixels.")] = 4,
    device: Device = "auto",
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the picture.")] = False,
) -> None:
    """Compare occlusion maps of a trained network with the exact effect of each beam."""
    require_reproduction()
    from bellcrank.plots.saving import check_target
    from bellcrank.surrogate.predictor import load_model

    design = design_named(what)
    network = load_model(design.problem, model, any_stiffness=True)
    from reproduction.networks.attribution import attribute
    from reproduction.networks.attribution_picture import draw_attribution

    target = out
    if target is None and not as_json:
        target = Path(f"{design.problem.name}-explained.png")
    if target is not None:
        check_target(target, overwrite=overwrite)
    announce_compilation()
    found = attribute(network, design, stride=stride, device=device)
    warn_of_other_stiffness(design.problem, found.design.problem, "explained")
    if target is not None:
        draw_attribution(found, target, overwrite=overwrite)
    if as_json:
        print_json(json.dumps(found.to_dict(), indent=1))
    else:
        results.print(
            f"{plain(design.problem.name)}: efficiency {found.efficiency:.4f} by mechanics, "
            f"{found.predicted:.4f} by {plain(found.architecture)}"
        )
        results.print("rank correlation with the exact change of efficiency by flips:")
        for name, rho in found.correlations().items():
            results.print(f"  {LABELS[name]}: {rho:.3f}")
    if target is not None:
        notes.print(f"wrote {plain(target)}")
