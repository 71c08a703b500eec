"""`bellcrank explain`: what a network sees in a design, beside what is there."""

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

if TYPE_CHECKING:
    from bellcrank.surrogate.explaining import Explanation

ABOUT = {
    "screening": "low-rank screening",
    "network": "network, each flip",
    "gradient": "network, gradient",
    "occlusion": "network, fitting block",
    "white": "network, white block",
    "black": "network, black block",
}


@app.command()
def explain(
    what: DesignName,
    model: Annotated[
        Path | None,
        typer.Option(
            help="A trained model, or the folder of a training. "
            "\\[the one that comes with bellcrank]"
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Picture to write (png, svg, pdf). \\[NAME-explained.png; with --json none]"
        ),
    ] = None,
    block: Annotated[
        int | None, typer.Option(help="Side of the block that hides, in pixels. \\[12]")
    ] = None,
    stride: Annotated[
        int | None, typer.Option(help="From one place of the block to the next. \\[4]")
    ] = None,
    device: Annotated[str, typer.Option(help="auto, cpu or cuda.")] = "auto",
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the picture.")] = False,
) -> None:
    """Say which beams matter, to a trained network and by mechanics, and how far they agree."""
    require_reproduction()
    from bellcrank.surrogate.backend import import_torch

    design = design_named(what)
    import_torch()
    from bellcrank.surrogate.occlusion import Block
    from reproduction.explanation import explain_design

    given = {
        key: value for key, value in (("size", block), ("stride", stride)) if value is not None
    }
    target = out
    if target is None and not as_json:
        target = Path(f"{design.problem.name}-explained.png")
    announce_compilation()
    found = explain_design(
        design, model, target,
        block=Block(**given) if given else None, device=device, overwrite=overwrite,
    )  # fmt: skip
    warn_of_other_stiffness(design.problem, found.design.problem, "explained")
    if as_json:
        print_json(json.dumps(found.to_dict(), indent=1))
    else:
        _print_agreements(found)
    if target is not None:
        notes.print(f"wrote {plain(target)}")


def _print_agreements(found: Explanation) -> None:
    results.print(
        f"{plain(found.design.problem.name)}: efficiency {found.efficiency:.4f} by mechanics, "
        f"{found.predicted:.4f} by {plain(found.architecture)}"
    )
    table = Table("foreseen by", "flips", "count", "Pearson", "Spearman", "top 30", box=SIMPLE)
    for name, told in found.correlations().items():
        for subset, one in told.items():
            if one.count:
                figures = [_figure(value) for value in (one.pearson, one.spearman, one.recall)]
                table.add_row(ABOUT[name] if subset == "all" else "", subset, str(one.count),
                              *figures)  # fmt: skip
    results.print(table)


def _figure(value: float) -> str:
    return "-" if value != value else f"{value:.3f}"  # noqa: PLR0124  (nan)
