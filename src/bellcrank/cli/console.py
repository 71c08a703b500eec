"""Output: results to standard output, notes to standard error."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from bellcrank.provenance import other_version

if TYPE_CHECKING:
    from bellcrank.model import Problem

WIDE = 160
"""Width of tables in files and pipes, in characters."""


def _width() -> int | None:
    """Return the width of standard output: that of the terminal, if it is one (None)."""
    return None if sys.stdout.isatty() or "COLUMNS" in os.environ else WIDE


results = Console(highlight=False, soft_wrap=True, emoji=False, width=_width())
notes = Console(stderr=True, highlight=False, soft_wrap=True, emoji=False)


def announce_compilation() -> None:
    """Print a note if the kernels will be compiled, which delays the first use."""
    from bellcrank.mechanics.kernels._compile import kernels_are_compiled

    if not kernels_are_compiled():
        notes.print("Compiling the kernels for this machine, once; this takes half a minute.")


def warn_of_another_version(started: Mapping[str, Any], what: str) -> None:
    """Print a note if something is resumed that another version started."""
    if version := other_version(started):
        notes.print(
            f"[yellow]note:[/] this {what} was started with another version ({plain(version)}); "
            "its results may differ from those of that version."
        )


def warn_of_other_stiffness(own: Problem, trained: Problem, done: str) -> None:
    """Print a note if a network was trained with another model or stiffness than a design's."""
    there, here = trained.stiffness, own.stiffness
    if own.section != trained.section:
        notes.print(
            f"[yellow]note:[/] the design is a frame; it is {done} with springs of stiffness "
            f"{there.bond:g} and {there.angle:g}, the model of the training set."
        )
    elif (here.bond, here.angle) != (there.bond, there.angle):
        notes.print(
            f"[yellow]note:[/] the springs of the design have stiffness {here.bond:g} and "
            f"{here.angle:g}; it is {done} with {there.bond:g} and {there.angle:g}, those of the "
            "training set."
        )


def plain(text: object) -> str:
    """Return a text with its square brackets escaped, so that they are not markup."""
    return escape(str(text))


def number_of(count: int, what: str) -> str:
    """Return a count with its noun.

    Examples
    --------
    >>> number_of(1, "file"), number_of(12, "file")
    ('1 file', '12 files')
    """
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def print_json(text: str) -> None:
    """Print machine-readable output without formatting."""
    sys.stdout.write(text + "\n")


def text_grid(rows: list[list[str]]) -> Table:
    """Return rows of texts as a table; efficiencies and items that are missed are bold."""
    grid = Table.grid(padding=(0, 2))
    for _ in next(iter(rows), ()):
        grid.add_column(overflow="fold")
    for name, *values in rows:
        bold = name.startswith("efficiency (") or "NO" in values
        grid.add_row(
            plain(name), *(f"[bold]{plain(each)}[/]" if bold else plain(each) for each in values)
        )
    return grid
