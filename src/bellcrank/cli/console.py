"""Where words go: results to standard output, everything else to standard error."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.markup import escape

from bellcrank.provenance import other_version

if TYPE_CHECKING:
    from bellcrank.model import Problem

results = Console(highlight=False, soft_wrap=True, emoji=False)
notes = Console(stderr=True, highlight=False, soft_wrap=True, emoji=False)


def announce_compilation() -> None:
    """Say that the first use compiles, so that nobody thinks it hangs."""
    from bellcrank.mechanics.kernels._compile import kernels_are_compiled

    if not kernels_are_compiled():
        notes.print("Compiling the kernels for this machine, once; this takes about half a minute.")


def warn_of_another_version(begun: Mapping[str, Any], what: str) -> None:
    """Say that what is resumed may not end as it would have, if it was begun elsewhere."""
    if version := other_version(begun):
        notes.print(
            f"[yellow]note:[/] this {what} was begun with another version ({plain(version)}); "
            "what follows may differ from what it would have found."
        )


def warn_of_other_stiffness(own: Problem, learnt: Problem, done: str) -> None:
    """Say that a network was asked about other springs than a design has, if it was."""
    there, here = learnt.stiffness, own.stiffness
    if (here.bond, here.angle) != (there.bond, there.angle):
        notes.print(
            f"[yellow]note:[/] the design's springs have stiffness {here.bond:g} and "
            f"{here.angle:g}, for the part that it was made for; it is {done} with {there.bond:g} "
            f"and {there.angle:g}, which the network has learnt."
        )


def plain(text: object) -> str:
    """Keep square brackets in a name or message from being read as markup."""
    return escape(str(text))


def number_of(count: int, what: str) -> str:
    """Return how many there are, in words.

    Examples
    --------
    >>> number_of(1, "file"), number_of(12, "file")
    ('1 file', '12 files')
    """
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def print_json(text: str) -> None:
    """Print machine-readable output, untouched by any formatting."""
    sys.stdout.write(text + "\n")
