"""Where words go: results to standard output, everything else to standard error."""

from __future__ import annotations

import sys

from rich.console import Console
from rich.markup import escape

results = Console(highlight=False, soft_wrap=True, emoji=False)
notes = Console(stderr=True, highlight=False, soft_wrap=True, emoji=False)


def announce_compilation() -> None:
    """Say that the first use compiles, so that nobody thinks it hangs."""
    from bellcrank.mechanics.kernels._compile import kernels_are_compiled

    if not kernels_are_compiled():
        notes.print("Compiling the kernels for this machine, once; this takes about half a minute.")


def plain(text: object) -> str:
    """Keep square brackets in a name or message from being read as markup."""
    return escape(str(text))


def print_json(text: str) -> None:
    """Print machine-readable output, untouched by any formatting."""
    sys.stdout.write(text + "\n")
