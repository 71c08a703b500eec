"""The formats of movies: by suffix, what is usual for each, and who writes it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from bellcrank.plots.movies import gif, mp4

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray


class Pictures(Protocol):
    """Whatever can draw the frames of a movie."""

    @property
    def size(self) -> tuple[int, int]:
        """Pixels across and up."""

    @property
    def order(self) -> NDArray[np.int64]:
        """(F,) the state that each frame shows; equal states are equal pictures."""

    def draw(self, state: int) -> NDArray[np.uint8]:
        """Return (height, width, 4) red, green, blue and opacity; the caller's to keep."""


@dataclass(frozen=True, slots=True)
class Format:
    """A format.

    Parameters
    ----------
    fps, size
        What is usual.
    require
        Raises `InvalidSettings` if what writes it is not installed.
    check
        ``(fps, size)``: raises `InvalidSettings` if the format cannot do that.
    encode
        ``(pictures, fps, tell)`` to the content of the file; `tell` is called with the number
        of frames done.
    """

    fps: int
    size: tuple[int, int]
    require: Callable[[], object]
    check: Callable[[int, tuple[int, int]], None]
    encode: Callable[[Pictures, int, Callable[[int], None]], bytes]


formats: dict[str, Format] = {
    ".mp4": Format(30, (1920, 1080), mp4.require_encoder, mp4.check, mp4.encode),
    ".gif": Format(25, (960, 540), gif.require_pillow, gif.check, gif.encode),
}
"""By suffix."""
