"""Which designs a network learns from, which ones it is tested on, and how often it sees each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidDataset, InvalidSettings

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.surrogate.dataset import Dataset

BINS = 50
"""Of the histogram that resampling makes flat."""
TAILS = 1e-4
"""Fraction of the designs at either end that go to the outermost bins."""


@dataclass(frozen=True, slots=True, eq=False)
class Split:
    """Rows to train with and rows held out, of different runs.

    Parameters
    ----------
    training, held_out : int64
        Indices of rows.
    """

    training: NDArray[np.int64]
    held_out: NDArray[np.int64]

    def some_held_out(self, most: int | None, seed: int) -> NDArray[np.int64]:
        """Return held-out rows, at most so many: the same whenever as many are asked for.

        Parameters
        ----------
        most
            None for all.
        seed
            Names which.
        """
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
            f"all {len(data)} designs come from one run, so that none can be held out to test "
            f"on; build a dataset of at least 2 runs"
        )
    count = min(max(round(fraction * len(runs)), 1), len(runs) - 1)
    chosen = np.random.default_rng(seed).permutation(runs)[:count]
    is_held_out = np.isin(data.run, chosen)
    return Split(np.flatnonzero(~is_held_out), np.flatnonzero(is_held_out))


def thinned(rows: NDArray[np.int64], most: int) -> NDArray[np.int64]:
    """Return every second, third, ... of some rows, so that they are not too many.

    Examples
    --------
    >>> thinned(np.arange(7), 3).tolist()
    [0, 3, 6]
    """
    return rows[:: -(-len(rows) // most)]


def flattening_chances(efficiency: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return chances that make the distribution of efficiencies flat when rows are drawn by them.

    Parameters
    ----------
    efficiency : (n,)

    Returns
    -------
    (n,) float64
        Of sum 1: the same for each filled bin of a histogram, shared among its rows.
    """
    low, high = np.quantile(efficiency, [TAILS, 1.0 - TAILS])
    place = (efficiency - low) / max(high - low, 1e-12) * BINS
    bin_of = np.clip(place, 0, BINS - 1).astype(np.int64)
    count = np.bincount(bin_of, minlength=BINS)
    chance = 1.0 / count[bin_of]
    return np.asarray(chance / chance.sum())


@dataclass(frozen=True, slots=True)
class Overlap:
    """How much of what is held out is not new.

    Parameters
    ----------
    designs
        Rows of the dataset.
    distinct
        Different designs among them.
    held_out
        Rows held out.
    repeated
        Of these, designs that are among the training rows too.
    """

    designs: int
    distinct: int
    held_out: int
    repeated: int


def overlap(data: Dataset, split: Split) -> Overlap:
    """Count designs that occur more than once, and those on both sides of a split."""
    words = np.ascontiguousarray(data.packed).view([("", np.uint8, data.packed.shape[1])]).ravel()
    _, name = np.unique(words, return_inverse=True)
    known = np.zeros(int(name.max()) + 1, np.bool_)
    known[name[split.training]] = True
    repeated = int(known[name[split.held_out]].sum())
    return Overlap(len(data), len(known), len(split.held_out), repeated)
