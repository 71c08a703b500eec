"""`bellcrank study`: reproduction of the figures and tables of the paper."""

from __future__ import annotations

import json
import time
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.box import SIMPLE
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from bellcrank.cli.app import app
from bellcrank.cli.checkout import require_reproduction
from bellcrank.cli.console import announce_compilation, notes, plain, print_json, results
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

ALL, LIST, PAGE = "all", "list", "page"
FOLDER = Path("studies")
PAGE_FILE = "paper.md"


@app.command()
def study(
    name: Annotated[
        str,
        typer.Argument(
            help="Name of a study; [b]list[/] prints the names, [b]all[/] runs all studies, "
            "[b]page[/] writes the comparison page from the records in --out."
        ),
    ],
    quick: Annotated[bool, typer.Option("--quick", help="Run with reduced settings.")] = False,
    out: Annotated[
        Path, typer.Option(help="Folder for NAME.json, NAME.png and raw results.")
    ] = FOLDER,
    workers: Annotated[int | None, typer.Option(help="Number of threads. \\[all cores]")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the records.")] = False,
) -> None:
    """Reproduce figures and tables of the paper. Needs a checkout of the source repository.

    Rerun the same command to resume an interrupted study.
    """
    require_reproduction()
    from reproduction import run_study, studies

    if workers is not None and workers < 1:
        raise InvalidSettings(f"--workers: expected at least one, got {workers}")
    if name == LIST:
        _print_list(as_json=as_json)
        return
    if name == PAGE:
        _write_page(out)
        return
    chosen = studies.names() if name == ALL else [studies[name].name]
    announce_compilation()
    records = []
    for each in chosen:
        began = time.perf_counter()
        with _progress(each) as progress:
            record = run_study(each, out, quick=quick, workers=workers, progress=progress)
        records.append(record)
        if not as_json:
            _print(record)
        seconds = time.perf_counter() - began
        notes.print(f"wrote {plain(out / each)}.json and .png ({seconds:.0f} s)")
    if as_json:
        print_json(json.dumps(records if name == ALL else records[0], indent=1))


@contextmanager
def _progress(name: str) -> Iterator[Callable[[str, int, int], None]]:
    """Show the progress of a study on standard error."""
    columns = (
        TextColumn("{task.description}"), BarColumn(bar_width=24), MofNCompleteColumn(),
        TimeElapsedColumn(),
    )  # fmt: skip
    with Progress(*columns, console=notes, transient=True) as shown:
        tasks: dict[str, Any] = {}

        def report(activity: str, done: int, total: int) -> None:
            if activity not in tasks:
                tasks[activity] = shown.add_task(f"{name}: {activity}", total=total)
            shown.update(tasks[activity], completed=done)

        yield report


def _print_list(*, as_json: bool) -> None:
    from reproduction import studies

    if as_json:
        rows = [
            {"name": each.name, "title": each.title, "after": each.after}
            for each in studies.values()
        ]
        print_json(json.dumps(rows, indent=1))
        return
    table = Table("name", "study", "part of the paper", box=SIMPLE)
    for each in studies.values():
        table.add_row(each.name, each.title, each.after)
    results.print(table)


def _print(record: Mapping[str, Any]) -> None:
    """Print the comparison with the paper, or with another reference."""
    from reproduction import studies

    results.print(f"[b]{plain(record['title'])}[/] ({record['mode']}; {plain(record['runs'])})")
    of_paper = studies[record["study"]].page == "paper"
    table = Table("quantity", "paper" if of_paper else "reference", "bellcrank", box=SIMPLE)
    for row in record["comparison"]:
        table.add_row(plain(row["what"]), plain(row["paper"] or "–"), plain(row["ours"]))
    results.print(table)


def _write_page(out: Path) -> None:
    """Write the comparison page from the records in a folder, and update their pictures."""
    from bellcrank.model.storage import write_text
    from reproduction.page import page_of
    from reproduction.records import read_records, refresh

    names = read_records(out)
    if not names:
        raise InvalidSettings(
            f"{out}: no records of studies in this folder; run bellcrank study all --out {out}"
        )
    records = {name: refresh(out / f"{name}.json") for name in names}
    page = out.parent / PAGE_FILE
    write_text(page, page_of(records, pictures=f"{out.name}/"), overwrite=True)
    notes.print(f"wrote {plain(page)}")
