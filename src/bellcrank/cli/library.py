"""`bellcrank library`: elementary actuators, by name."""

from __future__ import annotations

import json
import shlex
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bellcrank.cli.app import INTERRUPTED, app
from bellcrank.cli.arguments import DesignName, design_in_model, design_named
from bellcrank.cli.console import announce_compilation, notes, plain, print_json
from bellcrank.cli.library_view import (
    MakingProgress,
    print_entries,
    print_entry,
    warn,
)
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from bellcrank.part.units import Quantity

library = typer.Typer(
    name="library",
    help="Library of elementary actuators.",
    rich_markup_mode="rich",
)
app.add_typer(library)

NAME = typer.Argument(help="Entry: its name, a unique beginning of it, or its hash.")
Name = Annotated[str, NAME]
KIND_HELP = "straight-10g, straight-50g, straight-100g, straight-200g or own (your designs)."
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace existing files.")]


@library.command("list")
def list_(as_json: AsJson = False) -> None:
    """List all entries, bundled and your own."""
    from bellcrank.machines.library import library

    known = library()
    print_entries(known, known.summaries, as_json=as_json)


@library.command()
def search(
    direction: Annotated[
        str | None, typer.Option(help="Output direction, for example up-left.")
    ] = None,
    columns: Annotated[int | None, typer.Option(help="Size of the lattice.")] = None,
    kind: Annotated[str | None, typer.Option(help=KIND_HELP)] = None,
    spring: Annotated[float, typer.Option(help="Stiffness of a spring at the output.")] = 0.0,
    efficiency: Annotated[float | None, typer.Option(help="Minimum efficiency at rest.")] = None,
    stiffness: Annotated[float | None, typer.Option(help="Maximum input stiffness.")] = None,
    output_stiffness: Annotated[float | None, typer.Option(help="Minimum stiffness.")] = None,
    gain: Annotated[
        float | None, typer.Option(help="Minimum efficiency of the part at full stroke.")
    ] = None,
    travel: Annotated[
        str | None, typer.Option(help="Minimum travel of the part, for example 8mm.")
    ] = None,
    off_axis: Annotated[
        str | None, typer.Option(help="Maximum off-axis motion of the part, for example 5%.")
    ] = None,
    rotation: Annotated[
        str | None, typer.Option(help="Maximum rotation of the output, for example 5deg.")
    ] = None,
    payload: Annotated[
        str | None,
        typer.Option(help="Minimum load that halves the travel, for example 50g or 0.5N."),
    ] = None,
    blocked_force: Annotated[
        str | None, typer.Option(help="Minimum force of the held output, for example 1N.")
    ] = None,
    sag: Annotated[
        str | None, typer.Option(help="Maximum sag under the own weight, for example 1mm.")
    ] = None,
    no_warnings: Annotated[
        bool,
        typer.Option("--no-warnings", help="Only entries without contact or loss of stability."),
    ] = False,
    sort: Annotated[
        str,
        typer.Option(
            help="gain, travel, off-axis, payload, efficiency (at rest, against the spring), "
            "stiffness, output-stiffness, work or size."
        ),
    ] = "gain",
    as_json: AsJson = False,
) -> None:
    """Search for entries, the best first; lattice units, and those of the part where given."""
    from bellcrank.machines.library import library
    from bellcrank.part import read_quantity

    texts: list[tuple[str, str, str | None, Quantity]] = [
        ("travel_mm", "--travel", travel, "length"),
        ("off_axis", "--off-axis", off_axis, "ratio"),
        ("rotation_deg", "--rotation", rotation, "angle"),
        ("payload_N", "--payload", payload, "load"),
        ("blocked_force_N", "--blocked-force", blocked_force, "load"),
        ("sag_mm", "--sag", sag, "length"),
    ]
    part = {
        name: read_quantity(option, text, quantity)
        for name, option, text, quantity in texts
        if text is not None
    }
    if gain is not None:
        part["gain"] = gain
    known = library()
    found = known.search(
        direction=direction,
        columns=columns,
        kind=kind,
        spring=spring,
        efficiency=efficiency,
        stiffness=stiffness,
        output_stiffness=output_stiffness,
        no_warnings=no_warnings,
        part=part,
        sort=sort,
    )
    print_entries(known, found, as_json=as_json, spring=spring)


@library.command()
def show(
    name: Name,
    out: Annotated[
        Path | None, typer.Option(help="Picture at rest and moved (png, svg, pdf).")
    ] = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Show an entry: figures of the part, two-port, origin."""
    from bellcrank.machines.library import entry_to_dict, library

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
        from bellcrank.workflows.pictures import motion_of

        announce_compilation()
        draw_motion(motion_of(entry.design), out, title=entry.name, overwrite=overwrite)
        notes.print(f"wrote {plain(out)}")


@library.command()
def add(
    design: DesignName,
    points: Annotated[int, typer.Option(help="Number of increments of the stroke.")] = 20,
    model: Annotated[
        str, typer.Option(help="Mechanical model in which it is measured: frames or springs.")
    ] = "frames",
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Measure a design, and add it to your folder of the library."""
    from bellcrank.machines.library import entry_to_dict, user_folder, write_entry
    from bellcrank.machines.library.entry import name_of
    from bellcrank.model.storage import already_exists
    from bellcrank.storage.files import make_folder
    from bellcrank.workflows.library_measurement import measure

    chosen = design_in_model(design_named(design), model)
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
    notes.print(f"added {plain(entry.name)}")


@library.command()
def make(
    directions: Annotated[
        str | None, typer.Option(help="Directions, separated by commas. \\[all eight]")
    ] = None,
    columns: Annotated[str | None, typer.Option(help="Sizes of the lattice. \\[9,7,12]")] = None,
    kinds: Annotated[str | None, typer.Option(help="Kinds. \\[all four]")] = None,
    steps: Annotated[int, typer.Option(help="Proposals per chain.")] = 20_000,
    chains: Annotated[int, typer.Option(help="Chains per entry.")] = 4,
    seed: Annotated[int, typer.Option(help="Seed of the random numbers.")] = 0,
    workers: Annotated[
        int | None, typer.Option(help="Chains that run at the same time. \\[all cores]")
    ] = None,
    again: Annotated[
        bool, typer.Option("--again", help="Search for existing entries too, and keep the better.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the entries. \\[your folder of the library]")
    ] = None,
) -> None:
    """Search for entries and measure them; rerun the same command to resume."""
    from bellcrank.cli.stopping import stopping_on_interrupt
    from bellcrank.machines.library import user_folder
    from bellcrank.machines.library.tasks import MakeSettings
    from bellcrank.workflows.library_making import make as make_entries

    if workers is not None and workers < 1:
        raise InvalidSettings(f"workers: expected at least 1, got {workers}")
    given = {
        "directions": directions and _names(directions),
        "columns": columns and _numbers("--columns", columns),
        "kinds": kinds and _names(kinds),
    }
    chosen: dict[str, Any] = {key: value for key, value in given.items() if value}
    settings = MakeSettings(steps=steps, chains=chains, seed=seed, **chosen)
    folder = out or user_folder()
    announce_compilation()
    done = 0
    start = time.monotonic()
    with stopping_on_interrupt() as stop, MakingProgress(settings) as progress:
        for outcome in make_entries(
            settings, folder, workers=workers, again=again, report=progress, stop=stop
        ):
            progress.finish(outcome, time.monotonic() - start)
            done += 1
            if stop.is_set():
                break
    if done < len(settings.tasks):
        command = shlex.join(["bellcrank", *sys.argv[1:]])
        notes.print(f"Stopped. Rerun the same command to resume: {plain(command)}")
        sys.exit(INTERRUPTED)
    notes.print(f"entries are in {plain(folder)}")


@library.command()
def index(
    out: Annotated[Path, typer.Option(help="Folder to write to.")],
    entries: Annotated[
        Path | None, typer.Option(help="Folder of entries. \\[the whole library]")
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Write a page of the library, README.md, with a drawing of each entry."""
    from bellcrank.machines.library import Library
    from bellcrank.machines.library import library as whole
    from bellcrank.machines.library.pages import write_page

    known = whole() if entries is None else Library((entries,))
    warn(known)
    if not len(known):
        raise InvalidSettings(f"{entries}: expected a folder of library entries, found none")
    announce_compilation()
    notes.print(f"wrote {plain(write_page(known, out, overwrite=overwrite))}")


def _names(text: str) -> tuple[str, ...]:
    """Split names separated by commas, each once."""
    return tuple(dict.fromkeys(word.strip() for word in text.split(",")))


def _numbers(option: str, text: str) -> tuple[int, ...]:
    try:
        return tuple(dict.fromkeys(int(word) for word in text.split(",")))
    except ValueError:
        raise InvalidSettings(f"{option} {text}: expected integers separated by commas") from None
