"""`bellcrank dataset`: designs with their efficiencies, to learn from."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bellcrank.cli.app import INTERRUPTED, app
from bellcrank.cli.arguments import settings_of
from bellcrank.cli.console import (
    announce_compilation,
    notes,
    plain,
    print_json,
    results,
)

if TYPE_CHECKING:
    from bellcrank.surrogate.dataset import Dataset

dataset = typer.Typer(
    name="dataset",
    help="Designs with their efficiencies, for networks to learn from.",
    rich_markup_mode="rich",
)
app.add_typer(dataset)

DatasetFile = Annotated[Path, typer.Argument(help="A dataset, or the folder it was built in.")]


@dataset.command()
def build(
    problem: Annotated[str, typer.Argument(help="A built-in problem, or a problem file.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder; default: NAME-dataset. Again to go on.")
    ] = None,
    runs: Annotated[int, typer.Option(help="Searches, half of them backwards.")] = 2000,
    steps: Annotated[int, typer.Option(help="Proposals of each.")] = 582,
    seed: Annotated[int, typer.Option(help="Of the first run.")] = 0,
    workers: Annotated[int | None, typer.Option(help="Processes. \\[all cores]")] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="KEY=VALUE: a setting of the search.")
    ] = None,
) -> None:
    """Run many short searches, and keep all that they proposed."""
    from bellcrank.campaign.dataset import DatasetSpec, build_dataset
    from bellcrank.cli.campaign_view import CampaignProgress
    from bellcrank.cli.stopping import stopping_on_interrupt
    from bellcrank.model import find_problem

    found = find_problem(problem)
    spec = DatasetSpec(
        problem=found, runs=runs, steps=steps, seed=seed, search=settings_of("--set", settings)
    )
    folder = out or Path(f"{found.name}-dataset")
    announce_compilation()
    with stopping_on_interrupt() as stop, CampaignProgress() as progress:
        data = build_dataset(spec, folder, workers=workers, tell=progress, stop=stop)
    if data is None:
        notes.print("Stopped; what is done is kept. The same command goes on with it.")
        sys.exit(INTERRUPTED)
    _print_summary(summary_of(data))
    results.print(f"written to {plain(folder)}/")


@dataset.command()
def info(
    file: DatasetFile,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Say what is in a dataset."""
    from bellcrank.surrogate.dataset import read_dataset

    told = summary_of(read_dataset(file))
    if as_json:
        print_json(json.dumps(told, indent=1))
    else:
        _print_summary(told)


def summary_of(data: Dataset) -> dict[str, Any]:
    """Return what is in a dataset, as plain data."""
    import numpy as np

    from bellcrank.surrogate.recipes import Recipe
    from bellcrank.surrogate.splitting import overlap, split_by_run

    recipe = Recipe()
    told: dict[str, Any] = {
        "problem": data.problem.name,
        "beams": data.problem.lattice.beam_count,
        "designs": len(data),
        "runs": data.run_count,
        "accepted": int(data.accepted.sum()),
        "left_out": data.origin.get("left_out", 0),
        "efficiency": dict(
            zip(
                ("least", "lower_quartile", "median", "upper_quartile", "most"),
                np.quantile(data.efficiency, [0.0, 0.25, 0.5, 0.75, 1.0]).tolist(),
                strict=True,
            )
        ),
    }
    if data.run_count > 1:
        found = overlap(data, split_by_run(data, recipe.held_out, recipe.split_seed))
        told |= {
            "distinct": found.distinct, "held_out": found.held_out, "repeated": found.repeated,
        }  # fmt: skip
    return told


def _print_summary(told: dict[str, Any]) -> None:
    spread = told["efficiency"]
    results.print(
        f"{told['designs']} designs of {plain(told['problem'])} ({told['beams']} beams) from "
        f"{told['runs']} runs; {told['left_out']} without a unique response left out"
    )
    results.print(
        f"efficiency from {spread['least']:.3f} to {spread['most']:.3f}, half of them from "
        f"{spread['lower_quartile']:.3f} to {spread['upper_quartile']:.3f}"
    )
    if "distinct" in told:
        share = 100.0 * told["repeated"] / told["held_out"]
        results.print(
            f"{told['distinct']} of them distinct; of {told['held_out']} held out for tests, "
            f"{told['repeated']} ({share:.1f} %) occur in the training runs too"
        )
