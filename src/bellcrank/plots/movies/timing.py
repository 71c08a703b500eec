"""Which frame shows what: easing, stills, and which designs of a search are worth a look."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

STILL = 0.04
"""Part of the frames that the motion rests at the start, before and after its turn, at the end."""
OPENING, ENDING = 0.06, 0.16
"""Parts of the frames that the movie of a search dwells on its first and last design."""
PACE = 8.0
"""Most designs in a second."""


def stroke_schedule(frames: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Plan the way from rest to the full stroke and back, slow at both ends.

    The way back is the way there reversed, so that the movie can be played in a loop.

    Parameters
    ----------
    frames
        At least 3.

    Returns
    -------
    part : (K,) float64
        Parts of the stroke at which the design is seen, from 0 to 1.
    order : (frames,) int64
        Which of them each frame shows.

    Examples
    --------
    >>> part, order = stroke_schedule(9)
    >>> part.round(2).tolist(), order.tolist()
    ([0.0, 0.15, 0.5, 0.85, 1.0], [0, 1, 2, 3, 4, 3, 2, 1, 0])
    """
    half = (frames + 1) // 2
    still = max(1, round(STILL * frames))
    last = half - 2 * still + 1
    part = 0.5 - 0.5 * np.cos(np.pi * np.arange(last + 1) / last)
    way = np.clip(np.arange(half) - still + 1, 0, last)
    return part, np.concatenate([way, way[: frames // 2][::-1]])


def most_states(frames: int, fps: int) -> int:
    """Return how many designs a movie of a search can show so that the eye can follow.

    Examples
    --------
    >>> most_states(300, 30)
    80
    """
    return max(2, min(round(PACE * frames / fps), int((1.0 - OPENING - ENDING) * frames)))


def search_schedule(frames: int, states: int) -> NDArray[np.int64]:
    """Give each design of a search its frames; the first and the last have more.

    Parameters
    ----------
    frames, states
        At least 3, and 1 to `most_states`.

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
    efficiency: NDArray[np.float64], step: NDArray[np.int64], most: int
) -> NDArray[np.int64]:
    """Choose designs of a chain that tell its story: early changes, and those that gain.

    Equally spaced in the mean of two measures of progress, the logarithm of the step and the
    efficiency gained so far.

    Parameters
    ----------
    efficiency : (n,) float64
        Of the designs of a chain in order, n >= 1, all finite.
    step : (n,) int64
        When each was found, not decreasing.
    most
        How many at most, at least 2.

    Returns
    -------
    (k,) int64
        Indices in order; the first and the last design are among them.

    Examples
    --------
    >>> pick_states(np.array([0.0, 0.1, 0.1, 0.9, 1.0]), np.array([0, 1, 2, 50, 100]), 3).tolist()
    [0, 3, 4]
    """
    count = len(efficiency)
    if count <= most:
        return np.arange(count)
    gained = np.maximum.accumulate(efficiency) - efficiency[0]
    late = np.log1p(step - step[0])
    progress = np.zeros(count)
    for measure in (gained, late):
        if measure[-1] > 0.0:
            progress += measure / measure[-1]
    aims = np.linspace(progress[0], progress[-1], most)
    found = np.searchsorted(progress, aims - 1e-12)
    return np.unique(np.concatenate([[0], np.minimum(found, count - 1), [count - 1]]))
