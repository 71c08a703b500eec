"""`bellcrank train`: a network learns efficiencies from a dataset."""

from __future__ import annotations

import json
import shlex
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.progress import TextColumn, TimeRemainingColumn
from rich.table import Table

from bellcrank.cli.app import INTERRUPTED, app
from bellcrank.cli.arguments import settings_of
from bellcrank.cli.console import notes, plain, print_json, results
from bellcrank.cli.live import Live
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from bellcrank.learning.fitting import FitProgress
    from bellcrank.surrogate.trained import TrainedModel


@app.command()
def train(
    dataset: Annotated[Path, typer.Argument(help="A dataset, or the folder it was built in.")],
    model: Annotated[
        str | None, typer.Option(help="resnet50, resnet18-w16, grid or mlp. \\[the recipe's]")
    ] = None,
    recipe: Annotated[
        str | None, typer.Option(help="paper, or own (better, and faster). \\[own]")
    ] = None,
    epochs: Annotated[int | None, typer.Option(help="Times through the data.")] = None,
    members: Annotated[
        int, typer.Option(help="Networks that differ in their seeds; 3 to 5 tell uncertainty.")
    ] = 1,
    seed: Annotated[int | None, typer.Option(help="Of weights and order.")] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="KEY=VALUE: anything else in the recipe.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder; default: PROBLEM-MODEL.")] = None,
    resume: Annotated[
        Path | None, typer.Option(help="Go on with the training in this folder.")
    ] = None,
    device: Annotated[str, typer.Option(help="auto, cpu or cuda.")] = "auto",
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Train a network, and test it on runs that it has not seen."""
    from bellcrank.cli.design import stopping_on_interrupt
    from bellcrank.learning.fitting import fit
    from bellcrank.surrogate.dataset import read_dataset
    from bellcrank.surrogate.recipes import Recipe, recipe_of

    changes = {"model": model, "epochs": epochs, "seed": seed, **settings_of("--set", settings)}
    asked = recipe is not None or any(value is not None for value in changes.values())
    if resume is not None and (asked or out is not None):
        raise InvalidSettings("--resume goes on as it was begun; leave out the other options")
    chosen: Recipe | None = None if resume else recipe_of(recipe or "own", **changes)
    data = read_dataset(dataset)
    folder = resume or out or Path(f"{data.problem.name}-{chosen.model if chosen else ''}")
    with stopping_on_interrupt() as stop, TrainingProgress() as progress:
        trained = fit(
            data, chosen, folder, members=members, device=device, tell=progress, stop=stop.is_set
        )
    if trained is None:
        told = f"bellcrank train {shlex.quote(str(dataset))} --resume {shlex.quote(str(folder))}"
        notes.print(f"Stopped; what is done is kept. Go on with: {plain(told)}")
        sys.exit(INTERRUPTED)
    if as_json:
        print_json(json.dumps({"results": [each.record for each in trained]}, indent=1))
        return
    results.print(_table(trained))
    results.print(f"written to {plain(folder)}/")


class TrainingProgress(Live):
    """Shows how training goes, and keeps a line of each epoch."""

    def __init__(self) -> None:
        super().__init__("training", None, TextColumn("left"), TimeRemainingColumn())
        self._start = time.monotonic()
        self._first: int | None = None

    def __call__(self, told: FitProgress) -> None:
        """Take in where training is."""
        progress = told.progress
        done = told.member * progress.total + progress.done
        total = told.members * progress.total
        if self._first is None:
            self._first = done
        speed = (done - self._first) / max(time.monotonic() - self._start, 1e-9)
        which = f"network {told.member + 1} of {told.members}  " if told.members > 1 else ""
        figures = f"{which}loss {progress.loss:.4f}  {speed:.0f} designs/s"
        self._show(done, total, figures, f"training {100.0 * done / total:3.0f} %  {figures}")
        if (epoch := progress.epoch) is not None:
            notes.print(
                f"{which}epoch {epoch.epoch}: loss {epoch.loss:.4f}, held out R² "
                f"{epoch.r_squared:.4f}, determination {epoch.determination:.4f}, error "
                f"{epoch.rms_error:.3f}"
            )


def _table(trained: list[TrainedModel]) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0))
    table.add_column("model")
    for name in ("designs seen", "seconds", "R²", "determination", "rms error"):
        table.add_column(name, justify="right")
    for each in trained:
        found: dict[str, Any] = each.record["held_out"]
        table.add_row(
            each.architecture,
            str(each.record["designs"]),
            f"{each.record['seconds']:.0f}",
            f"{found['r_squared']:.4f}",
            f"{found['determination']:.4f}",
            f"{found['rms_error']:.4f}",
        )
    return table
