"""How long, how often and how large; and which files can be written at all."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path

from bellcrank.errors import InvalidSettings
from bellcrank.model.storage import already_exists
from bellcrank.plots.movies.formats import Format, formats

SMALLEST, LARGEST = 96, 7680
"""Pixels along a side."""
FEWEST, MOST = 3, 36_000
"""Frames."""
FASTEST = 120


@dataclass(frozen=True, slots=True)
class MovieSettings:
    """How long, how often and how large.

    Parameters
    ----------
    seconds
        Length.
    fps
        Frames in a second, 1 to 120.
    size
        Pixels across and up.

    Raises
    ------
    InvalidSettings
        If one makes no sense.

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
        if not 1 <= self.fps <= FASTEST:
            raise InvalidSettings(
                f"fps: expected a whole number from 1 to {FASTEST}, got {self.fps!r}"
            )
        if not FEWEST <= self.frames <= MOST:
            raise InvalidSettings(
                f"seconds: {self.seconds:g} s at {self.fps} frames per second make "
                f"{self.frames} frames; expected {FEWEST} to {MOST}"
            )
        if not all(SMALLEST <= side <= LARGEST for side in self.size):
            raise InvalidSettings(
                f"size: expected {SMALLEST} to {LARGEST} pixels each way, "
                f"got {self.size[0]}x{self.size[1]}"
            )

    @property
    def frames(self) -> int:
        """How many there are."""
        return round(self.seconds * self.fps)


def movie_settings(
    path: str | os.PathLike[str],
    seconds: float = 5.0,
    fps: int | None = None,
    size: tuple[int, int] | None = None,
) -> MovieSettings:
    """Return settings for a file; what is not asked for is chosen by its kind.

    Raises
    ------
    InvalidSettings
        If the suffix names no format, something makes no sense, or the format cannot do it.

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
    """Refuse a movie that could not be written anyway, before anything is computed.

    Raises
    ------
    InvalidSettings
        If the suffix is neither mp4 nor gif, or what writes it is not installed.
    OutputExists
        If there is something of that name and `overwrite` is not set.

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
    """Return the format that the suffix of a path names.

    Raises
    ------
    InvalidSettings
        If it names none.
    """
    target = Path(path)
    if target.suffix.lower() not in formats:
        raise InvalidSettings(f"{target}: expected a movie name ending in {', '.join(formats)}")
    return formats[target.suffix.lower()]
