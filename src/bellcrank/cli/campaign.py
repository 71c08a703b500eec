"""`bellcrank campaign`: many runs, on a laptop or a cluster."""

from __future__ import annotations

import json
import shlex
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bellcrank.cli.app import FAILED, app
from bellcrank.cli.arguments import settings_of
from bellcrank.cli.console import (
    announce_compilation,
    notes,
    number_of,
    plain,
    print_json,
    results,
    warn_of_another_version,
)
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from bellcrank.campaign import EngineOptions, Store

campaign = typer.Typer(
    name="campaign",
    help="Many runs described by a short file, on one core or thousands; safe against kills.",
    rich_markup_mode="rich",
)
app.add_typer(campaign)

Folder = Annotated[Path, typer.Argument(help="Folder of the campaign.")]
Workers = Annotated[
    int | None,
    typer.Option(help="Processes or SLURM jobs; the results do not depend on it. \\[all cores]"),
]
Engine = Annotated[
    str | None,
    typer.Option(help="processes, serial, or (extra 'cluster') dask, slurm. \\[processes]"),
]
Host = Annotated[str | None, typer.Option(help="Address on which engine slurm listens. [any]")]
Scheduler = Annotated[
    str | None,
    typer.Option(help="Address of a running Dask scheduler, tcp://host:port or tls://host:port."),
]
Slurm = Annotated[
    list[str] | None,
    typer.Option(help="KEY=VALUE for SLURMCluster of dask-jobqueue; repeatable."),
]
ShardText = Annotated[
    str | None,
    typer.Option("--shard", help="i/N: only every N-th run, for job arrays; i starts at 1."),
]
KeepSegments = Annotated[
    bool, typer.Option("--keep-segments", help="Do not make the table at the end.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]


@campaign.command()
def run(
    spec: Annotated[Path, typer.Argument(help="TOML file that describes the campaign.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the campaign; default: its name.")
    ] = None,
    workers: Workers = None,
    engine: Engine = None,
    host: Host = None,
    scheduler: Scheduler = None,
    slurm: Slurm = None,
    shard: ShardText = None,
    keep_segments: KeepSegments = False,
) -> None:
    """Start a campaign, continue it, or join one that is running."""
    from bellcrank.campaign import Store, read_spec

    options = _options(workers, host, scheduler, slurm)
    wanted = _engine_name(engine, scheduler, shard)
    found = read_spec(spec)
    store = Store.create(out or Path(found.name), found)
    _complete(store, wanted, options, shard, keep_segments=keep_segments)


@campaign.command()
def resume(
    folder: Folder,
    workers: Workers = None,
    engine: Engine = None,
    host: Host = None,
    scheduler: Scheduler = None,
    slurm: Slurm = None,
    shard: ShardText = None,
    keep_segments: KeepSegments = False,
) -> None:
    """Continue a campaign after Ctrl-C, a kill or a full disk."""
    from bellcrank.campaign import Store

    options = _options(workers, host, scheduler, slurm)
    wanted = _engine_name(engine, scheduler, shard)
    _complete(Store.open(folder), wanted, options, shard, keep_segments=keep_segments)


def _engine_name(engine: str | None, scheduler: str | None, shard: str | None) -> str:
    """Return the name of the engine that follows from the options."""
    from bellcrank.campaign import Shard, engines

    if shard is not None:
        Shard.parse(shard)
    if scheduler is not None and engine not in (None, "dask"):
        raise InvalidSettings(f"scheduler: only for engine 'dask', not {engine!r}")
    name = engine or ("dask" if scheduler else "serial" if shard else "processes")
    engines[name]  # raises if the name is unknown
    return name


def _options(
    workers: int | None,
    host: str | None,
    scheduler: str | None,
    slurm: list[str] | None,
) -> EngineOptions:
    from bellcrank.campaign import EngineOptions

    return EngineOptions(
        workers=workers,
        host=host,
        scheduler=scheduler,
        slurm=settings_of("--slurm", slurm),
    )


def _complete(
    store: Store, engine: str, options: EngineOptions, shard: str | None, *, keep_segments: bool
) -> None:
    """Compute the remaining runs, show the progress and print the status."""
    from bellcrank.campaign import Shard, StatusReader, complete
    from bellcrank.cli.campaign_view import CampaignProgress, status_table
    from bellcrank.cli.stopping import stopping_on_interrupt

    part = Shard.parse(shard) if shard else None
    command = f"bellcrank campaign resume {shlex.quote(str(store.path))}"
    with stopping_on_interrupt(resumable=True) as stop:
        stop.hint = f"Stopped. To continue: {plain(command)}"
        announce_compilation()
        warn_of_another_version(store.provenance, "campaign")
        with CampaignProgress() as progress:
            done = complete(
                store,
                engine,
                options,
                shard=part,
                compacting=not keep_segments,
                report=progress,
                announce=lambda note: notes.print(plain(note)),
                stop=stop,
            )
        if not done:
            stop.exit()  # a thread may still compute a segment, which delays a usual exit
    results.print(status_table(StatusReader(store).read()))


@campaign.command()
def status(folder: Folder, as_json: AsJson = False) -> None:
    """Show the status of a campaign."""
    from bellcrank.campaign import StatusReader, Store
    from bellcrank.cli.campaign_view import status_table

    found = StatusReader(Store.open(folder)).read()
    if not as_json:
        results.print(status_table(found))
        return
    data = {
        "name": found.name, "done": found.done, "compacted": found.compacted,
        "runs": found.runs, "runs_done": found.runs_done,
        "steps": found.steps, "steps_done": found.steps_done,
        "tasks": [asdict(task) for task in found.tasks],
    }  # fmt: skip
    print_json(json.dumps(data, indent=1))


@campaign.command()
def watch(
    folder: Folder,
    interval: Annotated[float, typer.Option(help="Seconds between two updates.")] = 2.0,
) -> None:
    """Show the status of a campaign until it is done."""
    from rich.live import Live

    from bellcrank.campaign import StatusReader, Store
    from bellcrank.cli.campaign_view import one_line, status_table

    if not interval > 0.0:
        raise InvalidSettings(f"interval: expected seconds above 0, got {interval}")
    reader = StatusReader(Store.open(folder))
    found = reader.read()
    if notes.is_terminal:
        with Live(status_table(found), console=notes, auto_refresh=False) as live:
            while not found.done:
                time.sleep(interval)
                found = reader.read()
                live.update(status_table(found), refresh=True)
    else:
        last = ""
        while not found.done:
            if (line := one_line(found)) != last:
                notes.print(plain(line))
                last = line
            time.sleep(interval)
            found = reader.read()
    results.print(status_table(found))


@campaign.command()
def verify(
    folder: Folder,
    repair: Annotated[
        bool, typer.Option("--repair", help="Delete damaged files; resume computes them again.")
    ] = False,
) -> None:
    """Check every byte of the files of a campaign."""
    from bellcrank.campaign import Store
    from bellcrank.campaign import repair as repair_store
    from bellcrank.campaign import verify as verify_store

    store = Store.open(folder)
    found = verify_store(store)
    results.print(f"{number_of(found.files, 'file')} with {found.rows} rows intact.")
    if not found.damage:
        return
    for line in found.damage:
        results.print(plain(line))
    if repair:
        repair_store(store, found)
        results.print(
            f"Deleted {number_of(len(found.doomed), 'file')}; "
            f"bellcrank campaign resume {plain(shlex.quote(str(folder)))} computes them again."
        )
    left = verify_store(store).damage if repair else found.damage
    if left:
        notes.print(
            f"[bold red]error:[/] {plain(folder)} is damaged in {number_of(len(left), 'place')}"
        )
        sys.exit(FAILED)


@campaign.command()
def top(
    folder: Folder,
    n: Annotated[int, typer.Option("-n", help="Number of designs.")] = 10,
    task: Annotated[str | None, typer.Option(help="Only this task.")] = None,
    as_json: AsJson = False,
) -> None:
    """List the best distinct designs; `evaluate --designs` reads the JSON."""
    from bellcrank.campaign import Store, best_designs
    from bellcrank.cli.campaign_view import ranking_table

    designs = best_designs(Store.open(folder), n, task)
    if as_json:
        print_json(json.dumps({"results": [asdict(design) for design in designs]}, indent=1))
    else:
        results.print(ranking_table(designs))


@campaign.command("results")
def write_best(
    folder: Folder,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the designs; default: FOLDER-designs.")
    ] = None,
    task: Annotated[str | None, typer.Option(help="Only this task.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace existing files.")] = False,
) -> None:
    """Write the best design of each task, cleaned and verified, to a file."""
    from bellcrank.campaign import Store, write_results
    from bellcrank.cli.campaign_view import results_table

    announce_compilation()
    target = out or Path(f"{folder if folder.name else folder.absolute()}-designs")
    found = write_results(Store.open(folder), target, task, overwrite=overwrite)
    results.print(results_table(found))
    results.print(f"written to {plain(target)}/")
