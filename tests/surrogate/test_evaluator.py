"""A network replaces the mechanics in any search."""

from __future__ import annotations

import numpy as np
import pytest

from bellcrank.mechanics import Status
from bellcrank.search import HoppingSettings, MetropolisSettings, chain_blocks
from bellcrank.surrogate.evaluator import NetworkEvaluator
from bellcrank.surrogate.predictor import Predictor

from .tiny import tiny_model, tiny_problem


@pytest.fixture(scope="module")
def evaluator() -> NetworkEvaluator:
    return NetworkEvaluator(Predictor(tiny_problem(), tiny_model(), device="cpu"))


def test_a_response_is_the_prediction_and_claims_nothing_else(evaluator: NetworkEvaluator) -> None:
    mask = tiny_problem().initial
    response = evaluator.evaluate(mask, 0.1, warm_start=True, lower_bound=5.0)
    assert response.status is Status.CONVERGED
    assert response.efficiency == evaluator.predictor.predict(mask[None])[0]
    assert np.isnan(response.energy)
    assert np.isnan(response.displacement).all()


def test_predicted_flips_are_differences_of_predictions(evaluator: NetworkEvaluator) -> None:
    mask = tiny_problem().initial
    flips = evaluator.predict_flips(mask)
    assert np.array_equal(flips.beams, tiny_problem().designable)
    before = evaluator.evaluate(mask).efficiency
    for number in (0, 7, len(flips.beams) - 1):
        flipped = mask.copy()
        flipped[flips.beams[number]] ^= True
        change = evaluator.evaluate(flipped).efficiency - before
        assert flips.change[number] == pytest.approx(change, abs=1e-5)


@pytest.mark.parametrize(
    "settings", [MetropolisSettings(steps=120), HoppingSettings(steps=60)], ids=["paper", "hopping"]
)
def test_a_search_with_a_network_records_its_predictions(
    evaluator: NetworkEvaluator, settings: MetropolisSettings | HoppingSettings
) -> None:
    beams = tiny_problem().lattice.beam_count
    seen = 0
    for _, rows in chain_blocks(evaluator, settings, 0):
        chosen = np.isfinite(rows.efficiency)
        masks = np.unpackbits(rows.mask[chosen], axis=1, count=beams).astype(bool)
        predicted = evaluator.predictor.predict(masks)
        assert np.allclose(rows.efficiency[chosen], predicted, atol=1e-5)
        seen += int(chosen.sum())
    assert seen > 20
