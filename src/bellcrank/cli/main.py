"""Entry point of the command line, and conversion of errors to messages and exit codes."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import NoReturn, cast

import typer

from bellcrank.cli.app import BAD_INPUT, FAILED, INTERRUPTED, NOT_MET, app
from bellcrank.cli.console import notes, plain
from bellcrank.errors import BellcrankError, CorruptRun, NoDesignFound, RunFailed, StorageError

COMMANDS = {
    "design": "design",
    "evaluate": "evaluate",
    "characterise": "characterise",
    "validate": "validate",
    "refine": "refine",
    "tolerance": "tolerance",
    "export": "export",
    "measure": "measure",
    "print": "print_part",
    "card": "card",
    "plot": "plot",
    "animate": "animate",
    "campaign": "campaign",
    "dataset": "dataset",
    "train": "train",
    "predict": "predict",
    "explain": "explain",
    "surrogate-search": "surrogate_search",
    "machine": "machine",
    "library": "library",
    "study": "study",
    "problems": "problems",
    "serve": "serve",
}
"""Module of this folder that registers each command."""
FAILURES = (StorageError, CorruptRun, RunFailed)
"""Errors that are not caused by the input."""


UsageError = cast("type[typer.BadParameter]", typer.BadParameter.__base__)
"""Error of typer for an unreadable command line; typer exports only a subclass."""


def register_commands(name: str | None = None) -> None:
    """Import the module of one command, or of all commands without a known name."""
    known = name is not None and name in COMMANDS
    for module in [COMMANDS[str(name)]] if known else COMMANDS.values():
        import_module(f"bellcrank.cli.{module}")


def main() -> None:
    """Run the command line; a known error becomes one line and an exit code."""
    register_commands(sys.argv[1] if len(sys.argv) > 1 else None)
    try:
        code = app(sys.argv[1:] or ["--help"], standalone_mode=False)
        if code == INTERRUPTED:
            notes.print("Interrupted.")
        sys.exit(code or 0)
    except UsageError as error:
        _refuse(f"{error.format_message().rstrip('.')}; see bellcrank --help", BAD_INPUT)
    except NoDesignFound as error:
        _refuse(str(error), NOT_MET)
    except BellcrankError as error:
        _refuse(str(error), FAILED if isinstance(error, FAILURES) else BAD_INPUT)
    except KeyboardInterrupt:
        notes.print("Interrupted.")
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(FAILED)
    except OSError as error:
        _refuse(str(error), FAILED)


def _refuse(message: str, code: int) -> NoReturn:
    """Print an error in one line and exit."""
    notes.print(f"[bold red]error:[/] {plain(message)}")
    sys.exit(code)
