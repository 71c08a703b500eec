"""`bellcrank train`: train a network on a dataset."""

from __future__ import annotations

import json
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.progress import TextColumn, TimeRemainingColumn

from bellcrank.cli.app import INTERRUPTED, app
from bellcrank.cli.arguments import settings_of
from bellcrank.cli.console import notes, plain, print_json, results
from bellcrank.cli.live import Live
from bellcrank.cli.predict import Device
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from bellcrank.surrogate.training import Progress

BUNDLED_NETWORK = "bundled"
"""Value of --start for the network that the package contains."""
FIGURES = {"R²": "r_squared", "determination": "determination", "rms error": "rms_error"}


@app.command()
def train(
    datasets: Annotated[
        list[Path],
        typer.Argument(help="Datasets of one problem, or the folders they were built in."),
    ],
    model: Annotated[
        str | None, typer.Option(help="resnet50, resnet18-w16 or mlp. \\[that of the recipe]")
    ] = None,
    recipe: Annotated[
        str | None,
        typer.Option(help="paper, or own (faster and more accurate). \\[own]"),
    ] = None,
    epochs: Annotated[int | None, typer.Option(help="Number of epochs.")] = None,
    seed: Annotated[
        int | None, typer.Option(help="Seed of the initial weights and the order of the designs.")
    ] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="KEY=VALUE: another setting of the recipe.")
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            help="Start from the weights of a trained network: a file, the folder of a training, "
            "or bundled. \\[random weights]"
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder. \\[PROBLEM-MODEL]")] = None,
    resume: Annotated[Path | None, typer.Option(help="Resume the training in this folder.")] = None,
    device: Device = "auto",
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Train a network, and test it on runs that are held out."""
    from bellcrank.cli.stopping import stopping_on_interrupt
    from bellcrank.surrogate.dataset import join, read_dataset
    from bellcrank.surrogate.predictor import load_model
    from bellcrank.surrogate.recipes import recipe_of
    from bellcrank.surrogate.training_setup import begin
    from bellcrank.surrogate.training_setup import resume as resume_training

    given = [model, recipe, epochs, seed, settings, start, out]
    if resume is not None:
        if any(value not in (None, []) for value in given):
            raise InvalidSettings(
                "--resume continues with the settings of the training; leave out the other options"
            )
        folder = resume
        training = resume_training(folder, join(list(map(read_dataset, datasets))), device=device)
    else:
        changes = {"model": model, "epochs": epochs, "seed": seed, **settings_of("--set", settings)}
        chosen = recipe_of(recipe or "own", **changes)
        data = join(list(map(read_dataset, datasets)))
        folder = out or Path(f"{data.problem.name}-{chosen.model}")
        first = None
        if start is not None:
            first = load_model(data.problem, None if start == BUNDLED_NETWORK else start)
        training = begin(data, chosen, folder, start=first, device=device)
    with stopping_on_interrupt() as stop, TrainingLive() as live:
        for progress in training.run(stop.is_set):
            live(progress)
        trained = training.finish(live) if training.is_done else None
    if trained is None:
        command = shlex.join(["bellcrank", "train", *map(str, datasets), "--resume", str(folder)])
        notes.print(f"Stopped; the training is saved. Resume it with: {plain(command)}")
        sys.exit(INTERRUPTED)
    if as_json:
        print_json(json.dumps({"results": [trained.record]}, indent=1))
        return
    record = trained.record
    results.print(
        f"{trained.architecture}: {record['designs']} training designs in {record['seconds']:.0f} s"
    )
    for label, key in FIGURES.items():
        value = record["held_out"][key]
        results.print(f"held out {label}: {'-' if value is None else format(value, '.4f')}")
    results.print(f"written to {plain(folder)}/")


class TrainingLive(Live):
    """Progress line of a training, and a line for each epoch."""

    def __init__(self) -> None:
        super().__init__("training", None, TextColumn("left"), TimeRemainingColumn())

    def __call__(self, progress: Progress) -> None:
        """Show the progress."""
        if progress.testing is not None:
            tested, held_out = progress.testing
            line = f"testing  {tested} / {held_out} held-out designs"
            self._show(progress.done, progress.total, line, line)
            return
        share, figures = 100.0 * progress.done / progress.total, f"loss {progress.loss:.4f}"
        self._show(progress.done, progress.total, figures, f"training {share:3.0f} %  {figures}")
        if (epoch := progress.epoch) is not None:
            notes.print(
                f"epoch {epoch.epoch}: loss {epoch.loss:.4f}, held out R² "
                f"{epoch.r_squared:.4f}, determination {epoch.determination:.4f}, error "
                f"{epoch.rms_error:.3f}"
            )
