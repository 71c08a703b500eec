"""`bellcrank surrogate-search`: search with a trained network in place of the mechanics."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.box import SIMPLE
from rich.table import Table

from bellcrank.cli.app import INTERRUPTED, app
from bellcrank.cli.arguments import settings_of
from bellcrank.cli.checkout import require_reproduction
from bellcrank.cli.console import announce_compilation, notes, plain, print_json, results
from bellcrank.cli.live import Live
from bellcrank.cli.predict import Device, ModelFile

if TYPE_CHECKING:
    from reproduction.networks.surrogate_search import (
        SurrogateSearchProgress,
        SurrogateSearchResult,
    )

UNITS = {"searching": "chains", "verifying": "chains", "comparing": "chains"}


@app.command()
def surrogate_search(
    problem: Annotated[str, typer.Argument(help="Bundled problem or problem file.")],
    model: ModelFile = None,
    chains: Annotated[int, typer.Option(help="Number of independent chains.")] = 100,
    steps: Annotated[int, typer.Option(help="Proposals of each chain.")] = 582,
    seed: Annotated[int, typer.Option(help="Seed of the random numbers.")] = 0,
    verified: Annotated[
        int,
        typer.Option(help="Best predicted designs of each chain that the mechanics evaluates."),
    ] = 10,
    dataset: Annotated[
        Path | None,
        typer.Option(help="Dataset to compute the distances of the designs to."),
    ] = None,
    compare: Annotated[
        bool, typer.Option("--compare/--no-compare", help="Run as many chains with the mechanics.")
    ] = True,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", help="KEY=VALUE: cost, schedule, hot, cold or annealing."),
    ] = None,
    device: Device = "auto",
    out: Annotated[
        Path | None, typer.Option(help="Result folder. \\[NAME-surrogate-search]")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the record as JSON.")] = False,
) -> None:
    """Search with a network in place of the mechanics, and verify the designs by the mechanics."""
    require_reproduction()
    from bellcrank.cli.stopping import stopping_on_interrupt
    from bellcrank.model import find_problem
    from bellcrank.storage import require_new_folder
    from bellcrank.surrogate.dataset import read_dataset
    from bellcrank.surrogate.predictor import load_predictor
    from reproduction.networks.surrogate_search import SurrogateSearchSettings, run_surrogate_search
    from reproduction.networks.surrogate_search_files import write_surrogate_search

    task = find_problem(problem)
    chosen = SurrogateSearchSettings(
        chains=chains, steps=steps, seed=seed, verified=verified, compare=compare,
        search=settings_of("--set", settings),
    )  # fmt: skip
    folder = out or Path(f"{task.name}-surrogate-search")
    require_new_folder(folder)
    predictor = load_predictor(task, model, device=device)
    training = None if dataset is None else read_dataset(dataset)
    announce_compilation()
    with stopping_on_interrupt() as stop, SurrogateSearchLive() as live:
        result = run_surrogate_search(
            task, predictor, chosen, training=training, report=live, stop=stop
        )
    write_surrogate_search(result, folder)
    if as_json:
        print_json(json.dumps(result.to_dict(), indent=1))
    else:
        _print_result(result)
        results.print(f"results: {plain(folder)}/")
    if result.stopped:
        notes.print(
            f"Stopped after {len(result.offered('final'))} of {chains} chains; the designs found "
            f"so far are verified and written to {plain(folder)}/."
        )
        sys.exit(INTERRUPTED)


class SurrogateSearchLive(Live):
    """Progress line of a search with a network."""

    def __init__(self) -> None:
        super().__init__("searching", None)

    def __call__(self, progress: SurrogateSearchProgress) -> None:
        """Show the stage and the number of chains that are done."""
        line = f"{progress.stage}  {progress.done} / {progress.total} {UNITS[progress.stage]}"
        self._show(progress.done, progress.total, line, line)


def _print_result(result: SurrogateSearchResult) -> None:
    """Print the medians of the offered designs, the effort and the best design."""
    from reproduction.networks.surrogate_search import OFFERS

    medians = result.medians()
    columns = {"predicted": "predicted", "network": "with network"}
    if result.by_mechanics:
        columns["mechanics"] = "with mechanics"
    if any(row["distance"] is not None for row in medians.values()):
        columns["distance"] = "beams from the dataset"
    table = Table("median efficiency", box=SIMPLE)
    for title in columns.values():
        table.add_column(title, justify="right")
    for offer, words in OFFERS.items():
        table.add_row(words, *(_figure(name, medians[offer][name]) for name in columns))
    results.print(table)
    for name, share in result.acceptance.items():
        results.print(
            f"with {name}: {share:.1%} of the proposals accepted (median), "
            f"{result.seconds[name]:.1f} s"
        )
        if failed := medians["verified"][f"{name}_failed"]:
            notes.print(f"{failed} chains with {name} offer no design with a unique response.")
    if result.best is None:
        notes.print(
            "[bold yellow]warning:[/] no design found with the network has a unique response."
        )
    else:
        results.print(
            f"best: efficiency [bold]{result.best.efficiency:.4f}[/] by mechanics, predicted "
            f"{result.best.predicted:.4f}"
        )


def _figure(name: str, value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.0f}" if name == "distance" else f"{value:.4f}"
