"""`bellcrank animate`: movies of designs that move, and of searches."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from bellcrank.cli.app import app
from bellcrank.cli.arguments import design_named
from bellcrank.cli.console import announce_compilation, notes, plain
from bellcrank.cli.live import Live
from bellcrank.errors import InvalidSettings

SECONDS = 5.0
"""Of a motion."""
SEARCH_SECONDS = 10.0
"""Of a search."""


class MovieProgress(Live):
    """Shows how far a movie is, in the responses it needs and in its frames."""

    def __init__(self) -> None:
        super().__init__("filming", None)

    def __call__(self, what: str, done: int, total: int) -> None:
        """Take in the news."""
        figures = f"{what} {done} of {total}"
        self._show(done, total, figures, f"filming: {figures}")


@app.command()
def animate(
    what: Annotated[
        str,
        typer.Argument(
            help="A design file or folder, human:NAME, machine:NAME, a problem; with --search "
            "the folder of a run."
        ),
    ],
    out: Annotated[Path, typer.Argument(metavar="FILE", help="Movie to write (mp4, gif).")],
    compare: Annotated[
        str | None, typer.Option(help="Second design, filmed beside the first.")
    ] = None,
    search: Annotated[
        bool, typer.Option("--search", help="How the design of a run came about.")
    ] = False,
    seconds: Annotated[
        float | None,
        typer.Option(help="Length.", show_default=f"{SECONDS:g}, with --search {SEARCH_SECONDS:g}"),
    ] = None,
    fps: Annotated[
        int | None, typer.Option(help="Frames per second.", show_default="30, GIF 25")
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(metavar="WxH", help="Pixels.", show_default="1920x1080, GIF 960x540"),
    ] = None,
    magnify: Annotated[float, typer.Option(help="Draw the motion so many times its size.")] = 1.0,
    objective: Annotated[
        str | None, typer.Option(help="displacement, directional:N or force.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the movie.")] = False,
) -> None:
    """Film a design from rest to its full stroke and back, or the search that found one."""
    from bellcrank.plots.movies import check_movie, movie_settings
    from bellcrank.workflows.animate import MotionOptions, animate_motion
    from bellcrank.workflows.animate_search import animate_search

    if search and (compare is not None or objective is not None):
        raise InvalidSettings(
            "--search films one run, by its own objective; leave out --compare and --objective"
        )
    usual = SEARCH_SECONDS if search else SECONDS
    settings = movie_settings(
        out, usual if seconds is None else seconds, fps, None if size is None else _size(size)
    )
    options = MotionOptions(objective, magnify)
    check_movie(out, overwrite=overwrite)
    names = [what] if compare is None else [what, compare]
    designs = [] if search else [(name, design_named(name)) for name in names]
    announce_compilation()
    with MovieProgress() as progress:
        if search:
            animate_search(
                Path(what), out, settings, magnify=magnify, overwrite=overwrite, progress=progress
            )
        else:
            animate_motion(designs, out, settings, options, overwrite=overwrite, progress=progress)
    notes.print(f"wrote {plain(out)}")


def _size(text: str) -> tuple[int, int]:
    """Read pixels across and up.

    Raises
    ------
    InvalidSettings

    Examples
    --------
    >>> _size("1280x720")
    (1280, 720)
    """
    found = re.fullmatch(r"(\d{1,6})[x×](\d{1,6})", text)
    if found is None:
        raise InvalidSettings(f"size: expected pixels like 1920x1080, got {text!r}")
    return int(found[1]), int(found[2])
