"""The mean of networks, which the bundled one is."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from tests.surrogate.helpers import untrained, weights
from tests.surrogate.tiny import tiny_problem
from tools.mean_network import mean_of

if TYPE_CHECKING:
    from bellcrank.surrogate.trained_model import TrainedModel


def networks() -> tuple[TrainedModel, TrainedModel]:
    one, two = (untrained(tiny_problem(), seed=seed) for seed in (0, 1))
    return replace(one, record={"name": "one"}), replace(two, record={"name": "two"})


def test_the_mean_of_two_networks_has_the_mean_of_each_weight() -> None:
    one, two = networks()
    first, second = weights(one), weights(two)
    mean = mean_of([one, two])
    assert mean.record == {"name": "two", "mean_of": [{"name": "one"}]}
    for name, value in weights(mean).items():
        assert value == pytest.approx(0.5 * (first[name] + second[name]), abs=1e-6)
    assert any((first[name] != second[name]).any() for name in first)


def test_networks_of_another_scale_have_no_mean() -> None:
    one, two = networks()
    with pytest.raises(ValueError, match="expected networks of one architecture"):
        mean_of([replace(one, deviation=2.0 * one.deviation), two])
