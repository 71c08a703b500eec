"""GIF by Pillow: one palette for all frames, without dithering, in an endless loop."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from bellcrank.plots.movies.formats import Pictures

FASTEST = 50
"""Frames in a second that browsers show; they slow down what is faster."""
COLOURS, COMMON = 255, 32
"""In the palette, and how many of them are taken as they are."""
APART = 10
"""Least distance of a colour to the common ones, between which Pillow cannot tell otherwise."""
SAMPLES = 6
"""States from which the palette is taken."""


def require_pillow() -> None:
    """Refuse if there is no Pillow.

    Raises
    ------
    InvalidSettings
    """
    _image()


def check(fps: int, _size: tuple[int, int]) -> None:
    """Refuse what no browser shows at its speed.

    Raises
    ------
    InvalidSettings
    """
    if fps > FASTEST:
        raise InvalidSettings(f"fps: expected at most {FASTEST} for a GIF, got {fps}")


def durations(frames: int, fps: int) -> list[int]:
    """Return milliseconds of each frame: whole hundredths of a second, right in the sum.

    Examples
    --------
    >>> durations(6, 30)
    [30, 40, 30, 30, 40, 30]
    """
    ends = np.round(np.arange(frames + 1) * 100 / fps).astype(int)
    return [10 * int(length) for length in np.diff(ends)]


def encode(pictures: Pictures, fps: int, tell: Callable[[int], None]) -> bytes:
    """Encode all frames.

    Raises
    ------
    InvalidSettings
        If there is no Pillow.
    """
    module = _image()
    order = pictures.order.tolist()
    states = sorted(set(order))
    samples = states[:: max(1, len(states) // SAMPLES)] + states[-1:]
    palette = _palette(module, [pictures.draw(state) for state in samples])
    known: dict[int, Any] = {}

    def frames() -> Iterator[Any]:
        for number, state in enumerate(order):
            if state not in known:
                picture = module.fromarray(pictures.draw(state)[:, :, :3])
                known[state] = picture.quantize(palette=palette, dither=module.Dither.NONE)
            tell(number + 1)
            # A copy, since what is written notes in the picture where it stands.
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

    The most frequent colours, those of ground and letters, stay as they are. Of all others each
    counts once, so that a small hot spot has its own beside a large quiet ground.
    """
    weights = np.array([65536, 256, 1])
    codes = np.concatenate([(one[:, :, :3] @ weights).ravel() for one in samples])
    codes, counts = np.unique(codes, return_counts=True)
    colours = _bands(codes)
    common: list[int] = []
    far = np.ones(len(codes), dtype=bool)
    for index in np.argsort(-counts, kind="stable").tolist():
        if len(common) < COMMON and far[index]:
            common.append(index)
            far &= np.abs(colours - colours[index]).max(axis=1) >= APART
    entries = colours[common].ravel().tolist()
    if far.any():
        mixed = module.fromarray(colours[None, far].astype(np.uint8)).quantize(
            COLOURS - COMMON, method=module.Quantize.MEDIANCUT, dither=module.Dither.NONE
        )
        entries += mixed.getpalette()
    palette = module.new("P", (1, 1))
    palette.putpalette(entries[: 3 * COLOURS])
    return palette


def _bands(codes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return (n, 3) red, green and blue of colours as numbers of 24 bits."""
    return np.stack([codes >> 16, codes >> 8 & 255, codes & 255], axis=-1)


def _image() -> Any:
    """Return the module PIL.Image.

    Raises
    ------
    InvalidSettings
        If it is not installed.
    """
    try:
        from PIL import Image
    except ImportError as missing:
        raise InvalidSettings(
            "movies in GIF need Pillow; install it with: pip install pillow"
        ) from missing
    return Image
