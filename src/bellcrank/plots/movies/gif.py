"""GIF encoding by Pillow: one palette for all frames, without dithering, in an endless loop."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from bellcrank.plots.movies.records import FrameSource

MAX_FPS = 50
"""Largest frame rate that browsers show; they slow down faster animations."""
COLOURS, FREQUENT = 255, 32
"""Size of the palette, and number of the most frequent colours that are taken unchanged."""
MIN_DISTANCE = 10
"""Smallest distance of a palette colour to the most frequent ones, which Pillow can resolve."""
SAMPLES = 6
"""Number of states from which the palette is taken."""


def require_pillow() -> None:
    """Check that Pillow is installed.

    Raises
    ------
    InvalidSettings
    """
    _image()


def check(fps: int, _size: tuple[int, int]) -> None:
    """Check that browsers show the frame rate.

    Raises
    ------
    InvalidSettings
    """
    if fps > MAX_FPS:
        raise InvalidSettings(f"fps: expected at most {MAX_FPS} for a GIF, got {fps}")


def durations(frames: int, fps: int) -> list[int]:
    """Return the milliseconds of each frame: multiples of 10 ms with the correct sum.

    Examples
    --------
    >>> durations(6, 30)
    [30, 40, 30, 30, 40, 30]
    """
    ends = np.round(np.arange(frames + 1) * 100 / fps).astype(int)
    return [10 * int(length) for length in np.diff(ends)]


def encode(source: FrameSource, fps: int, progress: Callable[[int], None]) -> bytes:
    """Encode all frames.

    Raises
    ------
    InvalidSettings
        If Pillow is not installed.
    """
    module = _image()
    order = source.order.tolist()
    states = sorted(set(order))
    samples = states[:: max(1, len(states) // SAMPLES)] + states[-1:]
    palette = _palette(module, [source.draw(state) for state in samples])
    known: dict[int, Any] = {}

    def frames() -> Iterator[Any]:
        for number, state in enumerate(order):
            if state not in known:
                picture = module.fromarray(source.draw(state)[:, :, :3])
                known[state] = picture.quantize(palette=palette, dither=module.Dither.NONE)
            progress(number + 1)
            # Pillow stores the frame position in the picture, so each frame is a copy.
            yield known[state].copy()

    sequence = frames()
    content = BytesIO()
    next(sequence).save(
        content,
        format="GIF",
        save_all=True,
        append_images=sequence,
        duration=durations(len(order), fps),
        loop=0,
        optimize=False,
        disposal=1,
    )
    return content.getvalue()


def _palette(module: Any, samples: list[NDArray[np.uint8]]) -> Any:
    """Return a picture whose palette suits all samples.

    The most frequent colours (background, text) are kept unchanged. Every other colour has
    weight one, so that a small highlighted region is represented beside a large background.
    """
    weights = np.array([65536, 256, 1])
    codes = np.concatenate([(one[:, :, :3] @ weights).ravel() for one in samples])
    codes, counts = np.unique(codes, return_counts=True)
    colours = _bands(codes)
    frequent: list[int] = []
    far = np.ones(len(codes), dtype=bool)
    for index in np.argsort(-counts, kind="stable").tolist():
        if len(frequent) < FREQUENT and far[index]:
            frequent.append(index)
            far &= np.abs(colours - colours[index]).max(axis=1) >= MIN_DISTANCE
    entries = colours[frequent].ravel().tolist()
    if far.any():
        mixed = module.fromarray(colours[None, far].astype(np.uint8)).quantize(
            COLOURS - FREQUENT, method=module.Quantize.MEDIANCUT, dither=module.Dither.NONE
        )
        entries += mixed.getpalette()
    palette = module.new("P", (1, 1))
    palette.putpalette(entries[: 3 * COLOURS])
    return palette


def _bands(codes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return (n, 3) red, green and blue of 24-bit colours."""
    return np.stack([codes >> 16, codes >> 8 & 255, codes & 255], axis=-1)


def _image() -> Any:
    """Return the module PIL.Image.

    Raises
    ------
    InvalidSettings
        If Pillow is not installed.
    """
    try:
        from PIL import Image
    except ImportError as missing:
        raise InvalidSettings(
            "movies in GIF need Pillow; install it with: pip install pillow"
        ) from missing
    return Image
