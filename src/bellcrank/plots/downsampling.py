"""Downsampling of long curves for drawing without losing a peak."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def downsample(
    x: NDArray[np.float64], y: NDArray[np.float64], columns: int = 1500
) -> NDArray[np.int64]:
    """Select the points of a curve that determine its picture.

    The width is divided into columns, about as fine as the resolution of the picture. In each
    column the first and last point and those with the smallest and largest y are selected. At gaps,
    the points beside a run of values that are not finite are selected, with one point of the run.

    Parameters
    ----------
    x : (n,)
        Not decreasing; already transformed if the axis is not linear.
    y : (n,)
        Values; nan for gaps.
    columns
        Number of columns.

    Returns
    -------
    (k,) int64
        Indices in order; all indices if there are at most ``4 * columns``.

    Examples
    --------
    >>> y = np.zeros(100_000)
    >>> y[31_415] = 1.0
    >>> selected = downsample(np.arange(100_000.0), y, columns=100)
    >>> len(selected) <= 400, 31_415 in selected
    (True, True)
    """
    count = len(x)
    if count <= 4 * columns:
        return np.arange(count)
    column = np.minimum(
        ((x - x[0]) / ((x[-1] - x[0]) or 1.0) * columns).astype(np.int64), columns - 1
    )
    starts = np.flatnonzero(np.r_[True, column[1:] != column[:-1]])
    selected = [starts, np.r_[starts[1:], count] - 1]
    finite = np.isfinite(y)
    selected += [
        _first_extreme(np.where(finite, y, fill), starts, smallest=fill > 0)
        for fill in (np.inf, -np.inf)
    ]
    gaps = np.flatnonzero(finite[1:] != finite[:-1])
    # Alternating values can have as many gaps as points; then they are not selected.
    if len(gaps) <= 4 * columns:
        selected += [gaps, gaps + 1]
    return np.unique(np.concatenate(selected))


def _first_extreme(
    y: NDArray[np.float64], starts: NDArray[np.int64], *, smallest: bool
) -> NDArray[np.int64]:
    """Return the index of the first smallest (or largest) y of each column."""
    extreme = (np.minimum if smallest else np.maximum).reduceat(y, starts)
    sizes = np.diff(np.r_[starts, len(y)])
    hits = np.flatnonzero(y == np.repeat(extreme, sizes))
    owner = np.searchsorted(starts, hits, side="right") - 1
    _, first = np.unique(owner, return_index=True)
    found: NDArray[np.int64] = hits[first]
    return found
