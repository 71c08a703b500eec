"""What is learnt from, what is tested on, and how often each design is seen."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.stats import chisquare

from bellcrank.errors import InvalidSettings
from bellcrank.surrogate.recipes import Recipe
from bellcrank.surrogate.splitting import (
    BINS,
    overlap,
    rows_of_epoch,
    split_by_run,
    uniform_weights,
)

from .helpers import flat_bins

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.surrogate.dataset import Dataset

DRAWN = 50_000


@pytest.mark.parametrize("fraction", [0.01, 0.25, 0.5, 0.99])
@pytest.mark.parametrize("seed", range(5))
def test_no_run_is_on_both_sides_and_each_side_has_one(
    data: Dataset, fraction: float, seed: int
) -> None:
    split = split_by_run(data, fraction, seed)
    ours, theirs = (set(data.run[rows].tolist()) for rows in (split.training, split.held_out))
    assert ours
    assert theirs
    assert not ours & theirs
    both = np.concatenate([split.training, split.held_out])
    assert np.array_equal(np.sort(both), np.arange(len(data)))
    assert len(theirs) == min(max(round(8 * fraction), 1), 7)


def test_the_seed_decides_what_is_held_out(data: Dataset) -> None:
    held_out = [tuple(split_by_run(data, 0.25, seed).held_out) for seed in (0, 0, 1, 2, 3)]
    assert held_out[0] == held_out[1]
    assert len(set(held_out)) > 2


@pytest.mark.parametrize("fraction", [0.0, 1.0, -0.1, float("nan")])
def test_a_fraction_that_is_none_is_refused(data: Dataset, fraction: float) -> None:
    with pytest.raises(InvalidSettings, match="expected a fraction between 0 and 1"):
        split_by_run(data, fraction, 0)


def test_repeated_designs_are_counted_as_by_brute_force(
    data: Dataset, rng: np.random.Generator
) -> None:
    drawn = data.take(np.sort(rng.integers(0, 60, 200)))
    mixed = replace(drawn, run=np.sort(rng.integers(0, 6, 200)))
    split = split_by_run(mixed, 0.4, 1)
    masks = [row.tobytes() for row in mixed.packed]
    known = {masks[row] for row in split.training}
    found = overlap(mixed, split)
    assert found["repeated"] == sum(masks[row] in known for row in split.held_out) > 0
    assert found["distinct"] == len(set(masks)) < 60
    assert (found["designs"], found["held_out"]) == (200, len(split.held_out))


def peaked(rng: np.random.Generator) -> NDArray[np.float64]:
    """Efficiencies as searches leave them: a peak at the start, and thin tails either side."""
    return np.concatenate([rng.normal(-0.06, 0.05, 8000), rng.normal(0.0, 0.8, 2000)])


def p_value(efficiency: NDArray[np.float64], rows: NDArray[np.int64]) -> float:
    """Chance of counts at least as uneven, over the filled bins, if drawing were flat."""
    edges, filled = flat_bins(efficiency, BINS)
    counts = np.histogram(efficiency[rows], edges)[0][filled]
    return float(chisquare(counts).pvalue)


def test_resampling_makes_the_distribution_of_efficiencies_flat(rng: np.random.Generator) -> None:
    efficiency = peaked(rng)
    rows = np.arange(len(efficiency))
    recipe = Recipe(resampling=True)
    values = [
        p_value(efficiency, rows_of_epoch(recipe, epoch, rows, efficiency, DRAWN))
        for epoch in range(20)
    ]
    assert min(values) > 1e-4
    assert 0.2 < np.mean(values) < 0.8  # of a right test they are uniform; 5 sigma is 0.32


def test_drawing_all_rows_alike_does_not(rng: np.random.Generator) -> None:
    efficiency = peaked(rng)
    rows = np.arange(len(efficiency))
    drawn = rows_of_epoch(Recipe(resampling=False), 0, rows, efficiency, DRAWN)
    assert p_value(efficiency, drawn) < 1e-12


def test_rows_of_one_bin_are_drawn_alike(rng: np.random.Generator) -> None:
    efficiency = peaked(rng)
    chance = uniform_weights(efficiency)
    edges, _ = flat_bins(efficiency, BINS)
    bin_of = np.digitize(efficiency, edges)
    assert chance.sum() == pytest.approx(1.0)
    for number in np.unique(bin_of):
        same = chance[bin_of == number]
        assert np.ptp(same) < 1e-15
        assert same.sum() == pytest.approx(1.0 / len(np.unique(bin_of)))


def test_efficiencies_that_are_nearly_all_the_same_can_be_drawn() -> None:
    efficiency = np.zeros(100_000)
    efficiency[:2] = [1e9, -1e9]
    chance = uniform_weights(efficiency)
    assert chance.sum() == pytest.approx(1.0)
    assert chance[0] == pytest.approx(0.5)


def test_without_resampling_an_epoch_sees_each_row_once(data: Dataset) -> None:
    rows = np.arange(100, 200)
    plain = Recipe(resampling=False)
    seen = rows_of_epoch(plain, 0, rows, data.efficiency[rows], 100)
    assert np.array_equal(np.sort(seen), rows)
    more = rows_of_epoch(plain, 0, rows, data.efficiency[rows], 250)
    assert np.array_equal(more[:100], seen)
    assert np.array_equal(
        np.bincount(more, minlength=200)[100:].clip(2, 3), np.bincount(more)[100:]
    )


def test_epochs_and_seeds_have_streams_of_their_own(data: Dataset) -> None:
    rows = np.arange(50)
    orders = {
        tuple(rows_of_epoch(Recipe(seed=seed), epoch, rows, data.efficiency[:50], 50))
        for seed in (0, 1)
        for epoch in (0, 1)
    }
    assert len(orders) == 4
