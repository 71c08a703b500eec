from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bellcrank.plots.downsampling import downsample


def test_a_million_points_become_a_few_thousand_and_keep_every_peak():
    rng = np.random.default_rng(2)
    y = rng.normal(size=1_000_000)
    peaks = rng.choice(len(y), 40, replace=False)
    y[peaks] += np.where(rng.random(40) < 0.5, 50.0, -50.0)
    kept = downsample(np.arange(1e6), y)
    assert len(kept) <= 6000
    assert y[kept].max() == y.max()
    assert y[kept].min() == y.min()


@given(st.integers(0, 10_000), st.integers(1, 30))
def test_each_column_keeps_its_ends_and_extremes(seed, columns):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 600))
    x = np.sort(rng.random(count))
    y = rng.normal(size=count)
    kept = downsample(x, y, columns)
    assert np.all(np.diff(kept) > 0)
    if count <= 4 * columns:
        assert len(kept) == count
        return
    assert len(kept) <= 4 * columns
    share = (x - x[0]) / (x[-1] - x[0]) * columns
    column = np.minimum(share.astype(int), columns - 1)
    for one in np.unique(column):
        members = np.flatnonzero(column == one)
        chosen = np.intersect1d(members, kept)
        assert {members[0], members[-1]} <= set(chosen)
        assert y[chosen].min() == y[members].min()
        assert y[chosen].max() == y[members].max()


def test_gaps_survive():
    y = np.zeros(10_000)
    y[5000:5003] = np.nan
    kept = downsample(np.arange(1e4), y, columns=50)
    assert np.isnan(y[kept]).any()
    assert {4999, 5003} <= set(kept)


def test_extremes_next_to_gaps_survive():
    y = np.full(10_000, np.nan)
    y[::7] = 1.0
    y[7007] = 9.0
    y[7014] = -9.0
    kept = downsample(np.arange(1e4), y, columns=20)
    assert {7007, 7014} <= set(kept)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_short_curves_are_left_alone(count):
    assert len(downsample(np.zeros(count), np.zeros(count), columns=1)) == count


def test_a_curve_without_width_keeps_its_extremes():
    y = np.sin(np.arange(100.0))
    kept = downsample(np.ones(100), y, columns=3)
    assert {int(y.argmax()), int(y.argmin())} <= set(kept)
