"""The state that each frame shows: easing and pauses."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

PAUSE = 0.04
"""Fraction of the frames in each pause: at the start, before and after the full stroke, at the
end."""


def stroke_schedule(frames: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Schedule the motion from rest to the full stroke and back, slow at both ends.

    The return is the reversed forward motion, so that the movie can be played in a loop.

    Parameters
    ----------
    frames
        At least 3.

    Returns
    -------
    part : (K,) float64
        Fractions of the stroke that are shown, from 0 to 1.
    order : (frames,) int64
        Index into `part` for each frame.

    Examples
    --------
    >>> part, order = stroke_schedule(9)
    >>> part.round(2).tolist(), order.tolist()
    ([0.0, 0.15, 0.5, 0.85, 1.0], [0, 1, 2, 3, 4, 3, 2, 1, 0])
    """
    half = (frames + 1) // 2
    pause = max(1, round(PAUSE * frames))
    last = half - 2 * pause + 1
    part = 0.5 - 0.5 * np.cos(np.pi * np.arange(last + 1) / last)
    forward = np.clip(np.arange(half) - pause + 1, 0, last)
    return part, np.concatenate([forward, forward[: frames // 2][::-1]])
