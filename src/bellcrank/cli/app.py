"""The `bellcrank` command and how its errors end."""

from __future__ import annotations

import os
import sys

import typer

from bellcrank import __version__
from bellcrank.cli.console import notes
from bellcrank.errors import BellcrankError, CorruptRun, StorageError

BAD_INPUT = 2
FAILED = 1
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
    """Design mechanical metamaterial actuators: lattices of beams that turn a push into motion."""


def _load_commands() -> None:
    """Import the commands, each of which registers itself on `app`."""
    from bellcrank.cli import design, evaluate, plot, problems  # noqa: F401


def main() -> None:
    """Run the command line; a known error becomes one line and an exit code."""
    _load_commands()
    try:
        app()
    except BellcrankError as error:
        notes.print(f"[bold red]error:[/] {_plain(str(error))}", soft_wrap=True)
        sys.exit(FAILED if isinstance(error, (StorageError, CorruptRun)) else BAD_INPUT)
    except KeyboardInterrupt:
        notes.print("Interrupted.")
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(FAILED)
    except OSError as error:
        notes.print(f"[bold red]error:[/] {_plain(str(error))}", soft_wrap=True)
        sys.exit(FAILED)


def _plain(text: str) -> str:
    """Keep square brackets in a message from being read as markup."""
    return text.replace("[", r"\[")
