"""Where the command line starts, and how its errors end."""

from __future__ import annotations

import os
import sys
from typing import NoReturn, cast

import typer

from bellcrank.cli import (
    animate,
    campaign,
    card,
    characterise,
    dataset,
    design,
    evaluate,
    explain,
    export,
    library,
    machine,
    plot,
    predict,
    print_part,
    problems,
    serve,
    study,
    surrogate_search,
    train,
    validate,
)
from bellcrank.cli.app import BAD_INPUT, FAILED, INTERRUPTED, NOT_MET, app
from bellcrank.cli.console import notes, plain
from bellcrank.errors import BellcrankError, CorruptRun, NoDesignFound, RunFailed, StorageError

COMMANDS = (
    design,
    evaluate,
    characterise,
    validate,
    export,
    print_part,
    card,
    plot,
    animate,
    campaign,
    dataset,
    train,
    predict,
    explain,
    surrogate_search,
    machine,
    library,
    study,
    problems,
    serve,
)
"""Modules that register a command."""
FAILURES = (StorageError, CorruptRun, RunFailed)
"""What is not the fault of who typed the command."""


UsageError = cast("type[typer.BadParameter]", typer.BadParameter.__base__)
"""What typer raises for a command line that it cannot read; it exports only this child."""


def main() -> None:
    """Run the command line; a known error becomes one line and an exit code."""
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
    """Say what is wrong in one line, and leave."""
    notes.print(f"[bold red]error:[/] {plain(message)}")
    sys.exit(code)
