"""A movie on disk: format by suffix, never over another file, never half a file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.model.storage import write_bytes
from bellcrank.plots.movies.settings import MovieSettings, check_movie, format_of
from bellcrank.plots.movies.stage import Stage

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

    from bellcrank.plots.movies.records import Movie


def film(
    movie: Movie,
    path: str | os.PathLike[str],
    settings: MovieSettings | None = None,
    *,
    overwrite: bool = False,
    tell: Callable[[int], None] = lambda _done: None,
) -> None:
    """Draw all frames of a movie and write them.

    Parameters
    ----------
    movie
        With as many frames as wanted.
    path
        Where to; the suffix mp4 or gif chooses the format.
    settings
        Of these, frames per second and size are used.
    overwrite
        Whether to replace what is there.
    tell
        Called with the number of frames drawn.

    Raises
    ------
    InvalidSettings
        If the suffix names no format, or what writes it is not installed.
    OutputExists, StorageError
        If there is such a file, or it cannot be written.
    """
    target = check_movie(path, overwrite=overwrite)
    chosen = settings or MovieSettings()
    stage = Stage(movie, chosen.size)
    content = format_of(target).encode(stage, chosen.fps, tell)
    write_bytes(target, content, overwrite=overwrite)
