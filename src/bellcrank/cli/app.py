"""The `bellcrank` command; each module of this folder registers a subcommand."""

from __future__ import annotations

import sys

import typer

from bellcrank import __version__

FAILED = 1
BAD_INPUT = 2
NOT_MET = 3
"""The search ended without a design that meets the specification."""
INTERRUPTED = 130

app = typer.Typer(
    name="bellcrank",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        sys.stdout.write(f"bellcrank {__version__}\n")
        raise typer.Exit


@app.callback()
def bellcrank(
    version: bool = typer.Option(
        False, "--version", callback=_print_version, is_eager=True, help="Print the version."
    ),
) -> None:
    """Design compliant mechanisms: printable lattices of beams that turn a push into motion."""
