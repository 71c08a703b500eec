"""Movie files: the registry of formats, settings, and writing."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bellcrank.errors import InvalidSettings
from bellcrank.model.storage import already_exists, write_bytes
from bellcrank.plots.movies import gif, mp4
from bellcrank.plots.movies.figure import MovieFigure

if TYPE_CHECKING:
    from collections.abc import Callable

    from bellcrank.plots.movies.records import FrameSource, Movie

MIN_SIDE, MAX_SIDE = 96, 7680
"""Limits of the width and the height, pixels."""
MIN_FRAMES, MAX_FRAMES = 3, 36_000
MAX_FPS = 120


@dataclass(frozen=True, slots=True)
class Format:
    """A movie format.

    Parameters
    ----------
    fps, size
        Default frame rate and size in pixels.
    require
        Function that raises `InvalidSettings` if a package is missing.
    check
        Function ``(fps, size)`` that raises `InvalidSettings` if the format does not support
        them.
    encode
        Function ``(frames, fps, progress)`` that returns the content of the file; `progress` is
        called with the number of encoded frames.
    """

    fps: int
    size: tuple[int, int]
    require: Callable[[], object]
    check: Callable[[int, tuple[int, int]], None]
    encode: Callable[[FrameSource, int, Callable[[int], None]], bytes]


formats: dict[str, Format] = {
    ".mp4": Format(30, (1920, 1080), mp4.require_encoder, mp4.check, mp4.encode),
    ".gif": Format(25, (960, 540), gif.require_pillow, gif.check, gif.encode),
}
"""Movie formats by suffix."""


@dataclass(frozen=True, slots=True)
class MovieSettings:
    """Length, frame rate and size of a movie.

    Parameters
    ----------
    seconds
        Length.
    fps
        Frames per second, 1 to 120.
    size
        Width and height in pixels.

    Raises
    ------
    InvalidSettings
        If a value is out of range.

    Examples
    --------
    >>> MovieSettings().frames
    150
    """

    seconds: float = 5.0
    fps: int = 30
    size: tuple[int, int] = (1920, 1080)

    def __post_init__(self) -> None:
        if not 0.0 < self.seconds < math.inf:
            raise InvalidSettings(f"seconds: expected a number above 0, got {self.seconds!r}")
        if not 1 <= self.fps <= MAX_FPS:
            raise InvalidSettings(
                f"fps: expected a whole number from 1 to {MAX_FPS}, got {self.fps!r}"
            )
        if not MIN_FRAMES <= self.frames <= MAX_FRAMES:
            raise InvalidSettings(
                f"seconds: {self.seconds:g} s at {self.fps} frames per second make "
                f"{self.frames} frames; expected {MIN_FRAMES} to {MAX_FRAMES}"
            )
        if not all(MIN_SIDE <= side <= MAX_SIDE for side in self.size):
            raise InvalidSettings(
                f"size: expected {MIN_SIDE} to {MAX_SIDE} pixels each way, "
                f"got {self.size[0]}x{self.size[1]}"
            )

    @property
    def frames(self) -> int:
        """Number of frames."""
        return round(self.seconds * self.fps)


def movie_settings(
    path: str | os.PathLike[str],
    seconds: float = 5.0,
    fps: int | None = None,
    size: tuple[int, int] | None = None,
) -> MovieSettings:
    """Return the settings for a file, with the defaults of its format.

    Raises
    ------
    InvalidSettings
        If the suffix is unknown, a value is out of range, or the format does not support it.

    Examples
    --------
    >>> movie_settings("crane.gif", seconds=2.0)
    MovieSettings(seconds=2.0, fps=25, size=(960, 540))
    """
    kind = format_of(path)
    chosen = MovieSettings(
        seconds,
        kind.fps if fps is None else fps,
        kind.size if size is None else size,
    )
    kind.check(chosen.fps, chosen.size)
    return chosen


def check_movie(path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Check before any computation that a movie can be written.

    Raises
    ------
    InvalidSettings
        If the suffix is neither mp4 nor gif, or a required package is not installed.
    OutputExists
        If the file exists and `overwrite` is not set.

    Examples
    --------
    >>> check_movie("motion.avi")
    Traceback (most recent call last):
        ...
    bellcrank.errors.InvalidSettings: motion.avi: expected a movie name ending in .mp4, .gif
    """
    target = Path(path)
    format_of(target).require()
    if not overwrite and os.path.lexists(target):
        raise already_exists(target)
    return target


def format_of(path: str | os.PathLike[str]) -> Format:
    """Return the format that belongs to the suffix of a path.

    Raises
    ------
    InvalidSettings
        If the suffix is unknown.
    """
    target = Path(path)
    if target.suffix.lower() not in formats:
        raise InvalidSettings(f"{target}: expected a movie name ending in {', '.join(formats)}")
    return formats[target.suffix.lower()]


def write_movie(
    movie: Movie,
    path: str | os.PathLike[str],
    settings: MovieSettings | None = None,
    *,
    overwrite: bool = False,
    progress: Callable[[int], None] = lambda _done: None,
) -> None:
    """Draw all frames of a movie and write the file.

    Parameters
    ----------
    movie
        Content; its order has one entry for each frame.
    path
        Output file; the suffix mp4 or gif selects the format.
    settings
        Frame rate and size.
    overwrite
        Whether an existing file is replaced.
    progress
        Called with the number of frames drawn.

    Raises
    ------
    InvalidSettings
        If the suffix is unknown, or a required package is not installed.
    OutputExists, StorageError
        If the file exists or cannot be written.
    """
    target = check_movie(path, overwrite=overwrite)
    chosen = settings or MovieSettings()
    frames = MovieFigure(movie, chosen.size)
    content = format_of(target).encode(frames, chosen.fps, progress)
    write_bytes(target, content, overwrite=overwrite)
