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
        str, typer.Option(help="Address; addresses other than loopback require a token.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port; 0 for any free port.")] = 8642,
    folder: Annotated[
        Path | None,
        typer.Option(help="Folder of the runs; default: in the data folder of the user."),
    ] = None,
    token: Annotated[str | None, typer.Option(help="Token required from clients.")] = None,
    searches: Annotated[
        int | None, typer.Option(help="Searches at the same time; default: one for each processor.")
    ] = None,
    show: Annotated[bool, typer.Option("--open", help="Open the page in a browser.")] = False,
) -> None:
    """Serve a page on which to define a task, follow its search and download the part."""
    try:
        from bellcrank.web.security import is_loopback
        from bellcrank.web.serving import ServerSettings, default_folder
        from bellcrank.web.serving import serve as run
    except ModuleNotFoundError as error:  # pragma: no cover - without the extra
        raise _missing(error) from None

    settings = ServerSettings(
        folder=folder or default_folder(), host=host, port=port, token=token, searches=searches
    )

    def announce(address: str) -> None:
        notes.print(f"bellcrank is at [bold]{plain(address)}[/]")
        notes.print(
            f"runs are stored in {plain(settings.folder)}; Ctrl-C ends the server and pauses them"
        )
        if not is_loopback(host):
            notes.print(
                "others reach it by plain HTTP, which can be read on the way: use it in a network "
                "that you trust, or behind a proxy with TLS"
            )
        if show:
            typer.launch(address)

    try:
        run(settings, announce)
    except ModuleNotFoundError as error:
        raise _missing(error) from None


def _missing(error: ModuleNotFoundError) -> InvalidSettings:
    return InvalidSettings(
        f"the browser interface needs {error.name}, which is not installed; "
        "pip install 'bellcrank[web]'"
    )
