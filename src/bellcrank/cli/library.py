"""`bellcrank library`: actuators that were found by searches, measured, and are known by name."""

from __future__ import annotations

import json
import shlex
import sys
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from bellcrank.cli.app import INTERRUPTED, app
from bellcrank.cli.arguments import DesignName, design_named
from bellcrank.cli.console import announce_compilation, notes, plain, print_json
from bellcrank.cli.library_view import MakingProgress, print_entries, print_entry, warn
from bellcrank.errors import InvalidSettings

library = typer.Typer(
    name="library",
    help="Elementary actuators: found by searches, measured, known by name.",
    rich_markup_mode="rich",
)
app.add_typer(library)

NAME = typer.Argument(help="Of an entry: its name, the beginning of it, or its hash.")
Name = Annotated[str, NAME]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace what is there.")]


@library.command("list")
def list_(as_json: AsJson = False) -> None:
    """List all entries: those that come along, and your own."""
    from bellcrank.machines.library import library

    known = library()
    print_entries(known, known.summaries, as_json=as_json)


@library.command()
def search(
    direction: Annotated[
        str | None, typer.Option(help="Where the output goes, like up-left.")
    ] = None,
    columns: Annotated[int | None, typer.Option(help="Size of the task.")] = None,
    kind: Annotated[str | None, typer.Option(help="free, loaded, light or own.")] = None,
    spring: Annotated[
        float, typer.Option(help="At the mean output: efficiencies are against it.")
    ] = 0.0,
    efficiency: Annotated[float | None, typer.Option(help="At rest, at least.")] = None,
    stiffness: Annotated[float | None, typer.Option(help="Of the input, at most.")] = None,
    output_stiffness: Annotated[float | None, typer.Option(help="At least.")] = None,
    better: Annotated[
        bool, typer.Option("--better", help="Only what beats the plain lever.")
    ] = False,
    clear: Annotated[
        bool, typer.Option("--clear", help="Only what has no struts that touch when it moves.")
    ] = False,
    sort: Annotated[
        str, typer.Option(help="efficiency, stiffness, output-stiffness, work, gain or size.")
    ] = "efficiency",
    as_json: AsJson = False,
) -> None:
    """Find entries that are as you want them, the best first; lattice units."""
    from bellcrank.machines.library import library

    known = library()
    found = known.search(
        direction=direction,
        columns=columns,
        kind=kind,
        spring=spring,
        efficiency=efficiency,
        stiffness=stiffness,
        output_stiffness=output_stiffness,
        better=better,
        clear=clear,
        sort=sort,
    )
    print_entries(known, found, as_json=as_json, spring=spring)


@library.command()
def show(
    name: Name,
    out: Annotated[
        Path | None, typer.Option(help="Draw it, at rest and moved (png, svg, pdf).")
    ] = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Say all that is known of an entry: its two-port, validation, lever, provenance."""
    from bellcrank.machines.library import library
    from bellcrank.machines.library.files import entry_to_dict

    if out is not None:
        from bellcrank.model.storage import check_folder
        from bellcrank.plots.saving import check_target

        check_target(out, overwrite=overwrite)
        check_folder(out)
    known = library()
    entry = known.find(name)
    if as_json:
        print_json(json.dumps(entry_to_dict(entry), indent=1))
    else:
        print_entry(entry, known.path(entry.name))
    if out is not None:
        from bellcrank.plots import draw_motion
        from bellcrank.workflows import motion_of

        announce_compilation()
        draw_motion(motion_of(entry.design), out, title=entry.name, overwrite=overwrite)
        notes.print(f"wrote {plain(out)}")


@library.command()
def add(
    design: DesignName,
    points: Annotated[int, typer.Option(help="Along the curves of the two-port.")] = 20,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Measure a design of yours, and keep it in your own folder of the library."""
    from bellcrank.machines.library import measure, user_folder, write_entry
    from bellcrank.machines.library.entry import name_of
    from bellcrank.machines.library.files import entry_to_dict
    from bellcrank.model.storage import already_exists
    from bellcrank.storage.files import make_folder

    chosen = design_named(design)
    if points < 1:
        raise InvalidSettings(f"--points: expected at least one, got {points}")
    make_folder(user_folder())
    target = user_folder() / f"{name_of(chosen)}.json"
    if target.exists() and not overwrite:
        raise already_exists(target)
    announce_compilation()
    entry = measure(chosen, points=points)
    path = write_entry(entry, user_folder(), overwrite=overwrite)
    if as_json:
        print_json(json.dumps(entry_to_dict(entry), indent=1))
    else:
        print_entry(entry, path)
    notes.print(f"kept {plain(entry.name)}")


@library.command()
def make(
    directions: Annotated[
        str | None, typer.Option(help="With commas between. \\[all eight]")
    ] = None,
    columns: Annotated[str | None, typer.Option(help="Sizes. \\[9,7,12]")] = None,
    kinds: Annotated[str | None, typer.Option(help="\\[free,loaded,light]")] = None,
    steps: Annotated[int, typer.Option(help="Proposals of each chain.")] = 20_000,
    chains: Annotated[int, typer.Option(help="For each entry.")] = 4,
    seed: Annotated[int, typer.Option(help="Of all random numbers.")] = 0,
    workers: Annotated[
        int | None, typer.Option(help="Chains at the same time. \\[all cores]")
    ] = None,
    again: Annotated[
        bool, typer.Option("--again", help="Search for what is there too; keep the better one.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the entries. \\[your own of the library]")
    ] = None,
) -> None:
    """Search for entries and measure them; goes on where it was stopped or killed."""
    from bellcrank.cli.design import stopping_on_interrupt
    from bellcrank.machines.library import Order, user_folder
    from bellcrank.machines.library import make as make_entries

    if workers is not None and workers < 1:
        raise InvalidSettings(f"workers: expected at least 1, got {workers}")
    given = {
        "directions": directions and _words(directions),
        "columns": columns and _numbers("--columns", columns),
        "kinds": kinds and _words(kinds),
    }
    chosen: dict[str, Any] = {key: value for key, value in given.items() if value}
    order = Order(steps=steps, chains=chains, seed=seed, **chosen)
    folder = out or user_folder()
    announce_compilation()
    done = 0
    start = time.monotonic()
    with stopping_on_interrupt() as stop, MakingProgress(order) as progress:
        for made in make_entries(
            order, folder, workers=workers, again=again, tell=progress, stop=stop
        ):
            progress.finish(made, time.monotonic() - start)
            done += 1
            if stop.is_set():
                break
    if done < len(order.tasks):
        words = shlex.join(["bellcrank", *sys.argv[1:]])
        notes.print(f"Stopped; what is done is kept. Go on with the same words: {plain(words)}")
        sys.exit(INTERRUPTED)
    notes.print(f"entries are in {plain(folder)}")


@library.command()
def index(
    out: Annotated[Path, typer.Option(help="Folder to write it into.")],
    entries: Annotated[
        Path | None, typer.Option(help="Only those of this folder. \\[the whole library]")
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Write an index of the library: a page to browse (index.html) and one to read (README.md)."""
    from bellcrank.machines.library import Library
    from bellcrank.machines.library import library as whole
    from bellcrank.machines.library.index import write_pages

    known = whole() if entries is None else Library((entries,))
    warn(known)
    if not len(known):
        raise InvalidSettings(f"{entries}: no entries of a library are there")
    announce_compilation()
    for path in write_pages(known, out, overwrite=overwrite):
        notes.print(f"wrote {plain(path)}")


def _words(text: str) -> tuple[str, ...]:
    """Read names with commas between them, each once."""
    return tuple(dict.fromkeys(word.strip() for word in text.split(",")))


def _numbers(option: str, text: str) -> tuple[int, ...]:
    try:
        return tuple(dict.fromkeys(int(word) for word in text.split(",")))
    except ValueError:
        raise InvalidSettings(
            f"{option} {text}: expected whole numbers with commas between"
        ) from None
