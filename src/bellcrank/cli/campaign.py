"""`bellcrank campaign`: many runs, from a laptop to a cluster."""

from __future__ import annotations

import json
import shlex
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bellcrank.cli.app import FAILED, INTERRUPTED, app
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
    help="Many runs: described by a short file, on one core or thousands, safe from any kill.",
    rich_markup_mode="rich",
)
app.add_typer(campaign)

Folder = Annotated[Path, typer.Argument(help="Folder of the campaign.")]
Workers = Annotated[
    int | None, typer.Option(help="Processes, or SLURM jobs; changes no result. \\[all cores]")
]
Engine = Annotated[
    str | None, typer.Option(help="local, address, slurm or serial (no Dask). \\[local]")
]
Host = Annotated[str | None, typer.Option(help="Address to listen on. [127.0.0.1; slurm: any]")]
Scheduler = Annotated[
    str | None, typer.Option(help="A running Dask scheduler, tcp://host:port or tls://host:port.")
]
TlsCa = Annotated[Path | None, typer.Option(help="For tls://: certificate of the authority.")]
TlsCert = Annotated[Path | None, typer.Option(help="For tls://: our certificate.")]
TlsKey = Annotated[Path | None, typer.Option(help="For tls://: our key.")]
Slurm = Annotated[
    list[str] | None,
    typer.Option(help="KEY=VALUE for dask-jobqueue's SLURMCluster; repeatable."),
]
ShardText = Annotated[
    str | None, typer.Option("--shard", help="i/N: only each N-th run, for job arrays. i from 1.")
]
KeepSegments = Annotated[
    bool, typer.Option("--keep-segments", help="Make no table when all is done.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]


@campaign.command()
def run(
    spec: Annotated[Path, typer.Argument(help="The TOML file that describes the campaign.")],
    out: Annotated[Path | None, typer.Option(help="Its folder; default: its name.")] = None,
    workers: Workers = None,
    engine: Engine = None,
    host: Host = None,
    scheduler: Scheduler = None,
    tls_ca: TlsCa = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
    slurm: Slurm = None,
    shard: ShardText = None,
    keep_segments: KeepSegments = False,
) -> None:
    """Begin a campaign, or join one that is under way."""
    from bellcrank.campaign import Store, read_spec

    options = _options(workers, host, scheduler, tls_ca, tls_cert, tls_key, slurm)
    wanted = _engine_name(engine, scheduler, shard)
    found = read_spec(spec)
    store = Store.create(out or Path(found.name), found)
    _complete(store, wanted, options, shard, compacting=not keep_segments)


@campaign.command()
def resume(
    folder: Folder,
    workers: Workers = None,
    engine: Engine = None,
    host: Host = None,
    scheduler: Scheduler = None,
    tls_ca: TlsCa = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
    slurm: Slurm = None,
    shard: ShardText = None,
    keep_segments: KeepSegments = False,
) -> None:
    """Go on with a campaign after Ctrl-C, a kill or a full disk."""
    from bellcrank.campaign import Store

    options = _options(workers, host, scheduler, tls_ca, tls_cert, tls_key, slurm)
    wanted = _engine_name(engine, scheduler, shard)
    _complete(Store.open(folder), wanted, options, shard, compacting=not keep_segments)


def _engine_name(engine: str | None, scheduler: str | None, shard: str | None) -> str:
    """Return the engine that the options ask for, by its name or otherwise."""
    from bellcrank.campaign import Shard, engines

    if shard is not None:
        Shard.parse(shard)
    if scheduler is not None and engine not in (None, "address"):
        raise InvalidSettings(f"scheduler: only for engine 'address', not {engine!r}")
    name = engine or ("address" if scheduler else "serial" if shard else "local")
    engines[name]  # an unknown name explains itself
    return name


def _options(
    workers: int | None,
    host: str | None,
    scheduler: str | None,
    tls_ca: Path | None,
    tls_cert: Path | None,
    tls_key: Path | None,
    slurm: list[str] | None,
) -> EngineOptions:
    from bellcrank.campaign import EngineOptions

    return EngineOptions(
        workers=workers,
        host=host,
        scheduler=scheduler,
        tls_ca=tls_ca,
        tls_cert=tls_cert,
        tls_key=tls_key,
        slurm=settings_of("--slurm", slurm),
    )


def _complete(
    store: Store, engine: str, options: EngineOptions, shard: str | None, *, compacting: bool
) -> None:
    """Compute what is left, show how it goes, and say how it ended."""
    from bellcrank.campaign import Shard, Watcher, complete
    from bellcrank.cli.campaign_view import CampaignProgress, status_table
    from bellcrank.cli.design import stopping_on_interrupt

    announce_compilation()
    warn_of_another_version(store.provenance, "campaign")
    part = Shard.parse(shard) if shard else None
    with stopping_on_interrupt() as stop, CampaignProgress() as progress:
        done = complete(
            store,
            engine,
            options,
            shard=part,
            compacting=compacting,
            tell=progress,
            announce=lambda note: notes.print(plain(note)),
            stop=stop,
        )
    folder = shlex.quote(str(store.path))
    if not done:
        notes.print(
            f"Stopped; what is done is kept. Go on with: bellcrank campaign resume {plain(folder)}"
        )
        sys.exit(INTERRUPTED)
    results.print(status_table(Watcher(store).look()))


@campaign.command()
def status(folder: Folder, as_json: AsJson = False) -> None:
    """Show how a campaign stands."""
    from bellcrank.campaign import Store, Watcher
    from bellcrank.cli.campaign_view import status_table

    found = Watcher(Store.open(folder)).look()
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
    interval: Annotated[float, typer.Option(help="Seconds between two looks.")] = 2.0,
) -> None:
    """Show how a campaign stands, until it is done; changes nothing, from anywhere."""
    from rich.live import Live

    from bellcrank.campaign import Store, Watcher
    from bellcrank.cli.campaign_view import one_line, status_table

    if not interval > 0.0:
        raise InvalidSettings(f"interval: expected seconds above 0, got {interval}")
    watcher = Watcher(Store.open(folder))
    found = watcher.look()
    if notes.is_terminal:
        with Live(status_table(found), console=notes, auto_refresh=False) as live:
            while not found.done:
                time.sleep(interval)
                found = watcher.look()
                live.update(status_table(found), refresh=True)
    else:
        last = ""
        while not found.done:
            if (line := one_line(found)) != last:
                notes.print(plain(line))
                last = line
            time.sleep(interval)
            found = watcher.look()
    results.print(status_table(found))


@campaign.command()
def verify(
    folder: Folder,
    repair: Annotated[
        bool, typer.Option("--repair", help="Delete what is damaged; resume computes it again.")
    ] = False,
) -> None:
    """Check every byte of a campaign's store."""
    from bellcrank.campaign import Store
    from bellcrank.campaign import repair as repair_store
    from bellcrank.campaign import verify as verify_store

    store = Store.open(folder)
    found = verify_store(store)
    results.print(f"{number_of(found.files, 'file')} with {found.rows} rows as written.")
    if not found.damage:
        return
    for line in found.damage:
        results.print(plain(line))
    if repair and found.damage:
        repair_store(store, found)
        results.print(
            f"Deleted {number_of(len(found.doomed), 'file')}; "
            f"bellcrank campaign resume {plain(shlex.quote(str(folder)))} computes what is missing."
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
    n: Annotated[int, typer.Option("-n", help="How many.")] = 10,
    task: Annotated[str | None, typer.Option(help="Of this task only.")] = None,
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


@campaign.command()
def harvest(
    folder: Folder,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the designs; default: FOLDER-designs.")
    ] = None,
    task: Annotated[str | None, typer.Option(help="Of this task only.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the files.")] = False,
) -> None:
    """Write the best design of each task, cleaned and checked, as a file of its own."""
    from bellcrank.campaign import Store, write_harvest
    from bellcrank.cli.campaign_view import harvest_table

    announce_compilation()
    target = out or Path(f"{folder if folder.name else folder.absolute()}-designs")
    found = write_harvest(Store.open(folder), target, task, overwrite=overwrite)
    results.print(harvest_table(found))
    results.print(f"written to {plain(target)}/")
