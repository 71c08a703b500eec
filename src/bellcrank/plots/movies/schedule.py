"""The state that each frame shows: easing, pauses, and the selection of designs of a search."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

PAUSE = 0.04
"""Fraction of the frames in each pause: at the start, before and after the full stroke, at the
end."""
OPENING, ENDING = 0.06, 0.16
"""Fractions of the frames that show the first and the last design of a search."""
MAX_RATE = 8.0
"""Largest number of designs per second."""


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


def max_states(frames: int, fps: int) -> int:
    """Return the largest number of designs that the movie of a search shows.

    Examples
    --------
    >>> max_states(300, 30)
    80
    """
    return max(2, min(round(MAX_RATE * frames / fps), int((1.0 - OPENING - ENDING) * frames)))


def search_schedule(frames: int, states: int) -> NDArray[np.int64]:
    """Assign the designs of a search to frames; the first and the last are shown longer.

    Parameters
    ----------
    frames, states
        At least 3, and 1 to `max_states`.

    Returns
    -------
    (frames,) int64, not decreasing

    Examples
    --------
    >>> search_schedule(12, 4).tolist()
    [0, 1, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3]
    """
    opening, ending = max(1, round(OPENING * frames)), max(1, round(ENDING * frames))
    between = np.arange(frames - opening - ending)
    inner = max(states - 2, 0)
    middle = between * inner // max(len(between), 1) + min(inner, 1)
    last = np.full(ending, states - 1)
    return np.concatenate([np.zeros(opening, np.int64), middle, last])


def pick_states(
    efficiency: NDArray[np.float64], step: NDArray[np.int64], count: int
) -> NDArray[np.int64]:
    """Select designs of a chain, both early changes and improvements.

    The designs are equally spaced in the mean of two measures of progress: the logarithm of the
    step and the efficiency gained so far.

    Parameters
    ----------
    efficiency : (n,) float64
        Efficiencies of the designs in order, n >= 1, all finite.
    step : (n,) int64
        Step at which each was found, not decreasing.
    count
        Largest number of designs, at least 2.

    Returns
    -------
    (k,) int64
        Indices in order; the first and the last design are among them.

    Examples
    --------
    >>> pick_states(np.array([0.0, 0.1, 0.1, 0.9, 1.0]), np.array([0, 1, 2, 50, 100]), 3).tolist()
    [0, 3, 4]
    """
    designs = len(efficiency)
    if designs <= count:
        return np.arange(designs)
    gained = np.maximum.accumulate(efficiency) - efficiency[0]
    late = np.log1p(step - step[0])
    progress = np.zeros(designs)
    for measure in (gained, late):
        if measure[-1] > 0.0:
            progress += measure / measure[-1]
    aims = np.linspace(progress[0], progress[-1], count)
    found = np.searchsorted(progress, aims - 1e-12)
    return np.unique(np.concatenate([[0], np.minimum(found, designs - 1), [designs - 1]]))
