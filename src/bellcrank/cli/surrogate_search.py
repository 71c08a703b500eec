"""`bellcrank surrogate-search`: designs by networks, and what the mechanics says of them."""

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
from bellcrank.cli.console import announce_compilation, notes, plain, print_json, results
from bellcrank.cli.live import Live
from bellcrank.cli.predict import Device, ModelFiles

if TYPE_CHECKING:
    from bellcrank.learning.driven import Driven
    from bellcrank.learning.driving import DrivingProgress


@app.command()
def surrogate_search(
    problem: Annotated[str, typer.Argument(help="A built-in problem or a problem file.")],
    model: ModelFiles = None,
    chains: Annotated[int, typer.Option(help="Independent chains.")] = 100,
    steps: Annotated[int, typer.Option(help="Proposals of each.")] = 582,
    seed: Annotated[int, typer.Option(help="Determines everything, with the networks.")] = 0,
    caution: Annotated[
        float, typer.Option(help="Take off so many times what the networks dispute.")
    ] = 0.0,
    checked: Annotated[
        int, typer.Option(help="Best predicted designs of each chain that the mechanics checks.")
    ] = 10,
    confirm: Annotated[
        int, typer.Option(help="Steps after which the mechanics may send a chain back; 0: never.")
    ] = 0,
    dataset: Annotated[
        Path | None,
        typer.Option(help="A dataset: tells how new designs are beside it."),
    ] = None,
    exact: Annotated[
        bool,
        typer.Option("--exact", help="The network only screens, the mechanics decides."),
    ] = False,
    compare: Annotated[
        bool, typer.Option("--compare/--no-compare", help="Search as long by mechanics too.")
    ] = True,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", help="KEY=VALUE: cost, hot, cold, ...; --exact: doubt."),
    ] = None,
    device: Device = "auto",
    out: Annotated[Path | None, typer.Option(help="Result folder; default: NAME-network.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the record as JSON.")] = False,
) -> None:
    """Search with a network in place of the mechanics, and check by mechanics what it makes."""
    from bellcrank.cli.design import stopping_on_interrupt
    from bellcrank.learning.driving import drive
    from bellcrank.learning.driving_files import keep_driven
    from bellcrank.learning.driving_settings import Driving
    from bellcrank.learning.fitting import model_files
    from bellcrank.model import find_problem
    from bellcrank.storage import check_free
    from bellcrank.surrogate.dataset import read_dataset
    from bellcrank.surrogate.predictor import load_predictor

    task = find_problem(problem)
    told = Driving(
        chains=chains, steps=steps, seed=seed, caution=caution, checked=checked, confirm=confirm,
        exact=exact, compare=compare, search=settings_of("--set", settings),
    )  # fmt: skip
    folder = out or Path(f"{task.name}-network")
    check_free(folder)
    paths = [file for path in model or () for file in model_files(path)]
    predictor = load_predictor(task, paths, device=device)
    training = None if dataset is None else read_dataset(dataset)
    announce_compilation()
    with stopping_on_interrupt() as stop, DrivingLive("true" if exact else "predicted") as live:
        driven = drive(task, predictor, told, training=training, tell=live, stop=stop)
    keep_driven(driven, folder)
    if as_json:
        print_json(json.dumps(driven.to_dict(), indent=1))
    else:
        _print_driven(driven, folder)
    if driven.stopped:
        notes.print(
            f"Stopped after {driven.steps} of {told.steps} steps; what the chains offered by "
            f"then is checked and kept in {plain(folder)}/."
        )
        sys.exit(INTERRUPTED)


class DrivingLive(Live):
    """Shows how a network-driven search goes: its jobs, one after the other.

    Parameters
    ----------
    figure
        What the figure is that comes while searching.
    """

    UNITS = {"searching": "steps", "checking": "designs", "comparing": "chains"}  # noqa: RUF012

    def __init__(self, figure: str) -> None:
        super().__init__("network", None)
        self._figure = figure

    def __call__(self, progress: DrivingProgress) -> None:
        """Take in how far it is."""
        figure = "" if progress.figure is None else f"  {self._figure} {progress.figure:.3f}"
        unit = self.UNITS[progress.what]
        line = f"{progress.what}  {progress.done} / {progress.total} {unit}{figure}"
        self._show(progress.done, progress.total, line, line)


def _print_driven(driven: Driven, folder: Path) -> None:
    """Say in short tables what was made and what it took."""
    summary = driven.summary()
    _print_offers(driven, summary)
    _print_efforts(driven)
    for who in ("network", "mechanics"):
        if failed := summary["checked"][f"{who}_failed"]:
            notes.print(f"{failed} chains by {who} offer no design with a unique response.")
    if driven.best is None:
        notes.print("[bold yellow]warning:[/] no design that the network made has one.")
    else:
        results.print(
            f"best: true efficiency [bold]{driven.best.truth.efficiency:.4f}[/], predicted "
            f"{driven.best.predicted:.4f}"
        )
    results.print(f"results: {plain(folder)}/")


def _print_offers(driven: Driven, summary: dict[str, Any]) -> None:
    """Print what the chains offer."""
    columns = {"predicted": "predicted", "network": "screened" if driven.exact else "true"}
    if driven.by_mechanics:
        columns["mechanics"] = "by mechanics"
    if any(row["distance"] is not None for row in summary.values()):
        columns["distance"] = "beams from the dataset"
    table = Table("medians", box=SIMPLE)
    for title in columns.values():
        table.add_column(title, justify="right")
    for offer, words in driven.offers.items():
        table.add_row(words, *(_figure(name, summary[offer][name]) for name in columns))
    results.print(table)


def _print_efforts(driven: Driven) -> None:
    """Print what it took the chains to get there."""
    table = Table("medians of a chain", box=SIMPLE)
    efforts = {"screened" if driven.exact else "by network": ("network", driven.network)}
    if driven.mechanics is not None:
        efforts["by mechanics"] = ("mechanics", driven.mechanics)
    for title in efforts:
        table.add_column(title, justify="right")
    told = [(driven.seconds[name], effort.medians()) for name, effort in efforts.values()]
    rows = {
        "proposals accepted": [f"{medians['acceptance']:.1%}" for _, medians in told],
        "responses of the mechanics": [f"{medians['responses']:.0f}" for _, medians in told],
        "looks by the network": [f"{medians['scored']:.0f}" for _, medians in told],
        "seconds, all chains": [f"{seconds:.1f}" for seconds, _ in told],
    }
    for words, figures in rows.items():
        table.add_row(words, *figures)
    results.print(table)


def _figure(name: str, value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.0f}" if name == "distance" else f"{value:.4f}"
