"""`bellcrank serve`: the browser interface."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bellcrank.cli.app import app
from bellcrank.cli.console import notes, plain
from bellcrank.errors import InvalidSettings


@app.command()
def serve(
    host: Annotated[
        str, typer.Option(help="Address; any but this machine's own asks for a token.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port; 0 for any that is free.")] = 8642,
    folder: Annotated[
        Path | None, typer.Option(help="Where runs are kept; default: with your other data.")
    ] = None,
    token: Annotated[str | None, typer.Option(help="That visitors must know.")] = None,
    searches: Annotated[
        int | None, typer.Option(help="At the same time; default: one for each processor.")
    ] = None,
    show: Annotated[bool, typer.Option("--open", help="Open the page in a browser.")] = False,
) -> None:
    """Open a page on which to draw a task, watch it being designed, and take the part."""
    try:
        from bellcrank.web.serving import ServerSettings, default_folder
        from bellcrank.web.serving import serve as run
    except ModuleNotFoundError as error:  # pragma: no cover - where the extra is missing
        raise _missing(error) from None

    settings = ServerSettings(
        folder=folder or default_folder(), host=host, port=port, token=token, searches=searches
    )

    def tell(address: str) -> None:
        notes.print(f"bellcrank is at [bold]{plain(address)}[/]")
        notes.print(f"runs are kept in {plain(settings.folder)}; Ctrl-C ends the server, not them")
        if show:
            typer.launch(address)

    try:
        run(settings, tell)
    except ModuleNotFoundError as error:
        raise _missing(error) from None


def _missing(error: ModuleNotFoundError) -> InvalidSettings:
    return InvalidSettings(
        f"the browser interface needs {error.name}, which is not installed; "
        "pip install 'bellcrank[web]'"
    )
