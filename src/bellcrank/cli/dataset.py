"""`bellcrank dataset`: designs with their efficiencies, to train networks."""

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
    help="Designs with their efficiencies, to train networks.",
    rich_markup_mode="rich",
)
app.add_typer(dataset)

DatasetFile = Annotated[Path, typer.Argument(help="Dataset, or the folder it was built in.")]


@dataset.command()
def build(
    problem: Annotated[str, typer.Argument(help="Bundled problem or problem file.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder; rerun to resume. \\[NAME-dataset]")
    ] = None,
    runs: Annotated[
        int, typer.Option(help="Number of searches, half of them with the reversed output.")
    ] = 2000,
    steps: Annotated[int, typer.Option(help="Proposals of each search.")] = 582,
    seed: Annotated[int, typer.Option(help="Seed of the first run.")] = 0,
    every: Annotated[int, typer.Option(help="Store every n-th proposal of a search only.")] = 1,
    workers: Annotated[int | None, typer.Option(help="Number of processes. \\[all cores]")] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="KEY=VALUE: a setting of the search.")
    ] = None,
) -> None:
    """Run many searches, and store their proposals."""
    from bellcrank.campaign.dataset import DatasetSpec, build_dataset
    from bellcrank.cli.campaign_view import CampaignProgress
    from bellcrank.cli.stopping import stopping_on_interrupt
    from bellcrank.model import find_problem

    found = find_problem(problem)
    spec = DatasetSpec(
        problem=found, runs=runs, steps=steps, seed=seed, every=every,
        search=settings_of("--set", settings),
    )  # fmt: skip
    folder = out or Path(f"{found.name}-dataset")
    announce_compilation()
    with stopping_on_interrupt() as stop, CampaignProgress() as progress:
        data = build_dataset(spec, folder, workers=workers, report=progress, stop=stop)
    if data is None:
        notes.print("Stopped; finished runs are kept. Rerun the same command to resume.")
        sys.exit(INTERRUPTED)
    _print_summary(summary_of(data))
    results.print(f"written to {plain(folder)}/")


@dataset.command()
def info(
    file: DatasetFile,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Print the size and the efficiencies of a dataset."""
    from bellcrank.surrogate.dataset import read_dataset

    summary = summary_of(read_dataset(file))
    if as_json:
        print_json(json.dumps(summary, indent=1))
    else:
        _print_summary(summary)


def summary_of(data: Dataset) -> dict[str, Any]:
    """Return the size and the efficiencies of a dataset as plain data."""
    import numpy as np

    from bellcrank.surrogate.recipes import Recipe
    from bellcrank.surrogate.splitting import overlap, split_by_run

    recipe = Recipe()
    summary: dict[str, Any] = {
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
        summary |= overlap(data, split_by_run(data, recipe.held_out, recipe.split_seed))
    return summary


def _print_summary(summary: dict[str, Any]) -> None:
    spread = summary["efficiency"]
    results.print(
        f"{summary['designs']} designs of {plain(summary['problem'])} ({summary['beams']} beams) "
        f"from {summary['runs']} runs; {summary['left_out']} without a unique response left out"
    )
    results.print(
        f"efficiency from {spread['least']:.3f} to {spread['most']:.3f}, half of them from "
        f"{spread['lower_quartile']:.3f} to {spread['upper_quartile']:.3f}"
    )
    if "distinct" in summary:
        share = 100.0 * summary["repeated"] / summary["held_out"]
        results.print(
            f"{summary['distinct']} distinct; of {summary['held_out']} held out for tests, "
            f"{summary['repeated']} ({share:.1f} %) also occur in the training runs"
        )
