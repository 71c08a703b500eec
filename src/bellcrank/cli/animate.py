"""`bellcrank animate`: movies of designs that move."""

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
"""Default length."""


class MovieProgress(Live):
    """Shows the progress of a movie: responses computed, then frames drawn."""

    def __init__(self) -> None:
        super().__init__("movie", None)

    def __call__(self, what: str, done: int, total: int) -> None:
        """Show the numbers of finished and of all steps of an activity."""
        figures = f"{what} {done} of {total}"
        self._show(done, total, figures, f"movie: {figures}")


@app.command()
def animate(
    what: Annotated[
        str,
        typer.Argument(help="A design file or folder, human:NAME, machine:NAME, a problem."),
    ],
    out: Annotated[Path, typer.Argument(metavar="FILE", help="Movie to write (mp4, gif).")],
    compare: Annotated[
        str | None, typer.Option(help="Second design, shown beside the first.")
    ] = None,
    seconds: Annotated[float, typer.Option(help="Length.")] = SECONDS,
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
    """Make a movie of a design that moves from rest to its full stroke and back."""
    from bellcrank.plots.movies import check_movie, movie_settings
    from bellcrank.workflows.animate import MotionOptions, animate_motion

    settings = movie_settings(out, seconds, fps, None if size is None else _size(size))
    options = MotionOptions(objective, magnify)
    check_movie(out, overwrite=overwrite)
    names = [what] if compare is None else [what, compare]
    designs = [(name, design_named(name)) for name in names]
    announce_compilation()
    with MovieProgress() as progress:
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
