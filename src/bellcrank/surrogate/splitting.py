"""Split of a dataset into training and held-out runs, and the order of training designs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidDataset, InvalidSettings

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.recipes import Recipe

BINS = 50
"""Bins of the histogram that resampling makes uniform."""
TAILS = 1e-4
"""Fraction of the designs at either end that belong to the outermost bins."""


@dataclass(frozen=True, slots=True, eq=False)
class Split:
    """Training rows and held-out rows, from different runs.

    Parameters
    ----------
    training, held_out : int64
        Indices of rows.
    """

    training: NDArray[np.int64]
    held_out: NDArray[np.int64]

    def some_held_out(self, most: int | None, seed: int) -> NDArray[np.int64]:
        """Return at most `most` held-out rows (None: all), drawn by a seed."""
        if most is None or len(self.held_out) <= most:
            return self.held_out
        rng = np.random.default_rng(seed)
        return np.sort(rng.choice(self.held_out, most, replace=False))


def split_by_run(data: Dataset, fraction: float, seed: int) -> Split:
    """Hold out a fraction of the runs, at least one.

    Raises
    ------
    InvalidDataset
        If there is only one run.
    InvalidSettings
        If the fraction is not between 0 and 1.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> from bellcrank.surrogate.dataset import Dataset
    >>> crane = find_problem("crane")
    >>> masks = np.packbits([crane.initial] * 8, axis=1)
    >>> data = Dataset(crane, masks, np.zeros(8), [0, 0, 1, 1, 2, 2, 3, 3])
    >>> split = split_by_run(data, 0.25, seed=0)
    >>> len(split.training), len(split.held_out), len(set(data.run[split.held_out]))
    (6, 2, 1)
    """
    if not 0.0 < fraction < 1.0:
        raise InvalidSettings(f"held_out: expected a fraction between 0 and 1, got {fraction}")
    runs = np.unique(data.run)
    if len(runs) < 2:
        raise InvalidDataset(
            f"all {len(data)} designs come from one run, so that none can be held out for a test; "
            f"build a dataset of at least 2 runs"
        )
    count = min(max(round(fraction * len(runs)), 1), len(runs) - 1)
    chosen = np.random.default_rng(seed).permutation(runs)[:count]
    is_held_out = np.isin(data.run, chosen)
    return Split(np.flatnonzero(~is_held_out), np.flatnonzero(is_held_out))


def rows_of_epoch(
    recipe: Recipe,
    epoch: int,
    rows: NDArray[np.int64],
    efficiency: NDArray[np.float64],
    count: int,
) -> NDArray[np.int64]:
    """Return the rows of an epoch in their order.

    Without resampling, epochs traverse the rows in a random order, each from where the last one
    ended, and all rows before any is repeated.

    Parameters
    ----------
    recipe
        Its seed and the epoch determine the random numbers.
    epoch
        From 0.
    rows
        Training rows.
    efficiency
        Efficiencies of these rows.
    count
        Number of rows to return.

    Examples
    --------
    >>> from bellcrank.surrogate.recipes import Recipe
    >>> plain = Recipe(resampling=False)
    >>> halves = [rows_of_epoch(plain, epoch, np.arange(4), np.zeros(4), 2) for epoch in (0, 1)]
    >>> sorted(np.concatenate(halves).tolist())
    [0, 1, 2, 3]
    """

    def stream(number: int) -> np.random.Generator:
        return np.random.default_rng(np.random.SeedSequence(recipe.seed, spawn_key=(number,)))

    if recipe.resampling:
        return np.asarray(stream(epoch).choice(rows, count, p=uniform_weights(efficiency)))
    start, stop = epoch * count, (epoch + 1) * count
    first, last = start // len(rows), (stop - 1) // len(rows)
    passes = np.concatenate([stream(each).permutation(rows) for each in range(first, last + 1)])
    return passes[start - first * len(rows) :][:count]


def uniform_weights(efficiency: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return probabilities of rows that make the distribution of drawn efficiencies uniform.

    Parameters
    ----------
    efficiency : (n,)

    Returns
    -------
    (n,) float64
        Equal for each filled bin of a histogram, divided equally among its rows; sum 1.
    """
    low, high = np.quantile(efficiency, [TAILS, 1.0 - TAILS])
    position = (efficiency - low) / max(high - low, 1e-12) * BINS
    bin_of = np.clip(position, 0, BINS - 1).astype(np.int64)
    count = np.bincount(bin_of, minlength=BINS)
    weight = 1.0 / count[bin_of]
    return np.asarray(weight / weight.sum())


def overlap(data: Dataset, split: Split) -> dict[str, int]:
    """Count repeated designs, and those on both sides of a split.

    Returns
    -------
    dict
        ``designs`` (rows), ``distinct`` (different designs), ``held_out`` (held-out rows) and
        ``repeated`` (held-out rows whose design is also a training row).
    """
    packed = np.ascontiguousarray(data.packed).view([("", np.uint8, data.packed.shape[1])]).ravel()
    _, name = np.unique(packed, return_inverse=True)
    known = np.zeros(int(name.max()) + 1, np.bool_)
    known[name[split.training]] = True
    repeated = int(known[name[split.held_out]].sum())
    return {
        "designs": len(data),
        "distinct": len(known),
        "held_out": len(split.held_out),
        "repeated": repeated,
    }
