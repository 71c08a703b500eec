"""`bellcrank train`: a network learns efficiencies from a dataset."""

from __future__ import annotations

import json
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from bellcrank.cli.app import INTERRUPTED, app
from bellcrank.cli.arguments import settings_of
from bellcrank.cli.console import announce_compilation, notes, plain, print_json, results
from bellcrank.cli.predict import Device
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from bellcrank.learning.active import Round
    from bellcrank.learning.fitting import Ensemble
    from bellcrank.learning.proposing import ActiveSettings
    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.trained import TrainedModel

    Found = tuple[list[TrainedModel], list[Round] | None]
    """Networks, and what each round has found if they learnt in rounds."""


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
        int | None,
        typer.Option(help="Networks that differ in their seeds; 3 to 5 tell uncertainty. \\[1]"),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Of weights and order.")] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="KEY=VALUE: anything else in the recipe.")
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            "--from",
            help="Go on from trained networks: a file, a training's folder, or shipped (the one "
            "that comes with bellcrank).",
        ),
    ] = None,
    rounds: Annotated[
        int | None,
        typer.Option(help="Then let networks search, label what they propose, train again. \\[0]"),
    ] = None,
    of_round: Annotated[
        list[str] | None,
        typer.Option(
            "--round",
            help="KEY=VALUE for each round: chains, steps, disputed, best, share, epochs, "
            "epoch_size, learning_rate, ...",
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder; default: PROBLEM-MODEL.")] = None,
    resume: Annotated[
        Path | None, typer.Option(help="Go on with the training in this folder.")
    ] = None,
    device: Device = "auto",
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Train a network, and test it on runs that it has not seen."""
    from bellcrank.learning.course import begin_rounds
    from bellcrank.learning.fitting import Ensemble, networks_to_go_on_from
    from bellcrank.surrogate.dataset import read_dataset
    from bellcrank.surrogate.recipes import recipe_of

    given = [model, recipe, epochs, members, seed, settings, start, rounds, of_round, out]
    if resume is not None:
        if any(value not in (None, []) for value in given):
            raise InvalidSettings("--resume goes on as it was begun; leave out the other options")
        data, folder = read_dataset(dataset), resume
        found = _go_on(data, folder, device)
    else:
        changes = {"model": model, "epochs": epochs, "seed": seed, **settings_of("--set", settings)}
        chosen = recipe_of(recipe or "own", **changes)
        active = _rounds_of(rounds, of_round)
        data = read_dataset(dataset)
        folder = out or Path(f"{data.problem.name}-{chosen.model}")
        initial = [] if start is None else networks_to_go_on_from(data.problem, start)
        ensemble = Ensemble(chosen, members, initial)
        if active is None:
            found = _fit(data, ensemble, folder, device)
        else:
            begin_rounds(data, ensemble, folder, active, rounds or 0, device=device)
            found = _learn(data, folder, device)
    if found is None:
        told = f"bellcrank train {shlex.quote(str(dataset))} --resume {shlex.quote(str(folder))}"
        notes.print(f"Stopped; what is done is kept. Go on with: {plain(told)}")
        sys.exit(INTERRUPTED)
    trained, learnt = found
    if as_json:
        print_json(json.dumps(_record(trained, learnt), indent=1))
        return
    results.print(_table(trained))
    results.print(f"written to {plain(folder)}/")


def _rounds_of(rounds: int | None, texts: list[str] | None) -> ActiveSettings | None:
    """Return what a round is told; None if there are to be none."""
    from bellcrank.learning.proposing import ActiveSettings

    if rounds is not None and rounds < 0:
        raise InvalidSettings(f"--rounds: expected at least 0, got {rounds}")
    if texts and not rounds:
        raise InvalidSettings("--round: there are no rounds; say how many (--rounds N)")
    return ActiveSettings.from_dict(settings_of("--round", texts)) if rounds else None


def _go_on(data: Dataset, folder: Path, device: str) -> Found | None:
    """Go on with what a folder has begun."""
    from bellcrank.learning.course import is_course

    if is_course(folder):
        return _learn(data, folder, device)
    return _fit(data, None, folder, device)


def _fit(data: Dataset, ensemble: Ensemble | None, folder: Path, device: str) -> Found | None:
    """Begin to train an ensemble, or go on with the one that a folder has begun."""
    from bellcrank.cli.design import stopping_on_interrupt
    from bellcrank.cli.training_live import TrainingLive
    from bellcrank.learning.fitting import fit

    with stopping_on_interrupt() as stop, TrainingLive() as live:
        trained = fit(data, ensemble, folder, device=device, tell=live, stop=stop.is_set)
    return None if trained is None else (trained, None)


def _learn(data: Dataset, folder: Path, device: str) -> Found | None:
    """Make what is left of the learning in rounds that a folder has begun."""
    from bellcrank.cli.design import stopping_on_interrupt
    from bellcrank.cli.training_live import RoundsLive
    from bellcrank.learning.rounds import learn_in_rounds

    announce_compilation()
    with stopping_on_interrupt() as stop, RoundsLive() as live:
        learnt = learn_in_rounds(folder, data, device=device, tell=live.show, stop=stop.is_set)
    return None if learnt is None else (learnt.models, learnt.rounds)


def _record(trained: list[TrainedModel], rounds: list[Round] | None) -> dict[str, Any]:
    """Return what is printed as JSON."""
    found: dict[str, Any] = {"results": [each.record for each in trained]}
    if rounds is not None:
        found["rounds"] = [
            {"round": number, **each.to_dict()} for number, each in enumerate(rounds, 1)
        ]
    return found


def _table(trained: list[TrainedModel]) -> Table:
    from bellcrank.surrogate.metrics import Accuracy

    table = Table(box=None, padding=(0, 2, 0, 0))
    table.add_column("model")
    for name in ("designs seen", "seconds", "R²", "determination", "rms error"):
        table.add_column(name, justify="right")
    for each in trained:
        found = Accuracy.from_dict(each.record["held_out"])
        table.add_row(
            each.architecture,
            f"{each.seen['designs']:.0f}",
            f"{each.seen['seconds']:.0f}",
            f"{found.r_squared:.4f}",
            f"{found.determination:.4f}",
            f"{found.rms_error:.4f}",
        )
    return table
