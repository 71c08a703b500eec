"""`bellcrank surrogate-search`: search with a trained network in place of the mechanics."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from bellcrank.cli.app import app
from bellcrank.cli.checkout import require_reproduction
from bellcrank.cli.console import announce_compilation, notes, plain, print_json, results
from bellcrank.cli.live import Live
from bellcrank.cli.predict import Device, ModelFile

COLUMNS = {
    "network": "with the network",
    "predicted": "predicted",
    "mechanics": "with the mechanics",
    "distance": "beams from the dataset",
}


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
    device: Device = "auto",
    out: Annotated[
        Path | None, typer.Option(help="Result folder. \\[NAME-surrogate-search]")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the record as JSON.")] = False,
) -> None:
    """Search with a network in place of the mechanics, and verify the designs by the mechanics."""
    require_reproduction()
    from bellcrank.model import find_problem
    from bellcrank.storage import require_new_folder
    from bellcrank.surrogate.dataset import read_dataset
    from bellcrank.surrogate.predictor import load_predictor
    from reproduction.networks import surrogate_search as search
    from reproduction.networks.surrogate_search_files import write_surrogate_search

    task = find_problem(problem)
    settings = search.SurrogateSearchSettings(
        chains=chains, steps=steps, seed=seed, verified=verified, compare=compare
    )
    folder = out or Path(f"{task.name}-surrogate-search")
    require_new_folder(folder)
    predictor = load_predictor(task, model, device=device)
    training = None if dataset is None else read_dataset(dataset)
    announce_compilation()
    with SurrogateSearchLive("searching", None) as live:
        record = search.run_surrogate_search(
            task, predictor, settings, training=training, report=live
        )
    write_surrogate_search(record, task, folder)
    if as_json:
        print_json(json.dumps(record, indent=1))
        return
    for rule, label in search.OFFERS.items():
        medians = record["medians"][rule]
        figures = [
            f"{title} {medians[key]:.4g}"
            for key, title in COLUMNS.items()
            if medians[key] is not None
        ]
        results.print(f"{label}, medians: {', '.join(figures) or 'none'}")
        if failed := medians["network_failed"]:
            notes.print(f"{failed} of these designs of the network have no unique response.")
    best = search.best_design(task, record)
    if best is not None:
        results.print(f"best: efficiency [bold]{best.efficiency:.4f}[/] by mechanics")
    results.print(f"results: {plain(folder)}/")


class SurrogateSearchLive(Live):
    """Progress line of a search with a network."""

    def __call__(self, evaluator: str, done: int, total: int) -> None:
        """Show the number of chains that are done."""
        line = f"with the {evaluator}: {done} / {total} chains"
        self._show(done, total, line, line)
