"""Exact searches: networks screen, the mechanics decides, and all is counted."""

from __future__ import annotations

import json
import math
import threading
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.learning import driving
from bellcrank.learning.driven import OFFERS, Driven, Effort
from bellcrank.learning.driving import DrivingProgress, drive
from bellcrank.learning.driving_files import keep_driven, picture_of
from bellcrank.learning.driving_settings import FIRST_CHAIN, Driving
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status
from bellcrank.model import read_design, unpack_mask
from bellcrank.search import MetropolisSettings, chain_blocks
from bellcrank.search.screened import screened_blocks
from bellcrank.surrogate.predictor import Predictor

from .tiny import tiny_model, tiny_problem

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.search.screened import ScreenedState
    from bellcrank.storage import Proposals

STEPS = 270
SETTINGS = Driving(chains=3, steps=STEPS, checked=3, seed=2, exact=True, search={"doubt": 0.002})


class Weights:
    """A scorer in place of the networks, the same to the last bit in whatever batch."""

    def __init__(self, _predictor: Predictor, _caution: float) -> None:
        weight = np.random.default_rng(3).standard_normal(tiny_problem().lattice.beam_count)
        self.weight = np.round(6.4 * weight) / 64.0

    def score(self, masks: np.ndarray) -> np.ndarray:
        return masks @ self.weight


def network() -> Predictor:
    return Predictor(tiny_problem(), [tiny_model()], device="cpu")


@pytest.fixture(scope="module")
def driven() -> Driven:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(driving, "NetworkScorer", Weights)
        return drive(tiny_problem(), network(), SETTINGS)


@pytest.fixture(scope="module")
def alone() -> list[list[tuple[ScreenedState, Proposals]]]:
    """The same chains one after the other."""
    scorer, rule = Weights(network(), 0.0), SETTINGS.screened_rule
    return [
        list(screened_blocks(SpringEvaluator(tiny_problem()), scorer, rule, FIRST_CHAIN + row))
        for row in range(3)
    ]


def test_the_chains_are_those_of_delayed_acceptance(
    driven: Driven, alone: list[list[tuple[ScreenedState, Proposals]]]
) -> None:
    last = [blocks[-1][0] for blocks in alone]
    assert [made.mask for made in driven.offered("final")] == [state.mask for state in last]
    assert driven.network == Effort(
        (STEPS,) * 3,
        tuple(state.accepted for state in last),
        tuple(state.responses for state in last),
        tuple(state.scored for state in last),
    )
    assert all(0 < state.saved < STEPS for state in last)
    assert driven.network.scored == (STEPS + 2,) * 3  # and where each of two blocks begins


def test_a_chain_offers_the_best_that_the_mechanics_computed(
    driven: Driven, alone: list[list[tuple[ScreenedState, Proposals]]]
) -> None:
    for made, blocks in zip(driven.offered("predicted"), alone, strict=True):
        found = [rows.efficiency[rows.status == Status.CONVERGED] for _, rows in blocks]
        assert math.isclose(made.truth.rank, np.concatenate(found).max(), abs_tol=1e-6)
    for made, first, end in zip(
        *map(driven.offered, ("checked", *list(OFFERS)[1::-1])), strict=True
    ):
        assert made.truth.rank >= max(first.truth.rank, end.truth.rank)


def test_all_that_is_offered_is_checked_in_small_steps(driven: Driven) -> None:
    evaluator, beams = SpringEvaluator(tiny_problem()), tiny_problem().lattice.beam_count
    assert len(driven.by_network) == len(driven.by_mechanics) == 3 * len(OFFERS)
    for made in (*driven.by_network, *driven.by_mechanics):
        response = evaluator.evaluate(unpack_mask(made.mask, beams), VERIFICATION_INCREMENT)
        sound = response.status is Status.CONVERGED
        assert made.truth.efficiency == (response.efficiency if sound else None)
    masks = np.array([unpack_mask(made.mask, beams) for made in driven.by_network])
    said = network().predict(masks).efficiency
    assert np.allclose([made.predicted for made in driven.by_network], said, atol=1e-5)


def test_it_is_compared_with_plain_chains_of_the_same_rule(driven: Driven) -> None:
    rule = MetropolisSettings(steps=STEPS, chains=3, seed=2)
    last = []
    for chain in range(FIRST_CHAIN, FIRST_CHAIN + 3):
        *_, (state, _) = chain_blocks(SpringEvaluator(tiny_problem()), rule, chain)
        last.append(state)
    made = driven.offered("final", by_network=False)
    assert [each.mask for each in made] == [state.mask for state in last]
    assert driven.mechanics == Effort(
        (STEPS,) * 3, tuple(state.accepted for state in last), (STEPS,) * 3, (0,) * 3
    )
    assert set(driven.seconds) == {"network", "checking", "mechanics"}


def test_without_a_comparison_there_is_none() -> None:
    made = drive(tiny_problem(), network(), replace(SETTINGS, steps=20, compare=False))
    assert made.by_mechanics == ()
    assert made.mechanics is None
    assert made.to_dict()["effort"]["mechanics"] is None


def test_a_stopped_search_checks_what_it_has() -> None:
    stop = threading.Event()
    told: list[DrivingProgress] = []

    def tell(progress: DrivingProgress) -> None:
        told.append(progress)
        if progress.done == 30:
            stop.set()

    driven = drive(tiny_problem(), network(), SETTINGS, tell=tell, stop=stop)
    assert (driven.steps, driven.stopped, driven.by_mechanics) == (30, True, ())
    assert driven.network.steps == (30,) * 3
    assert len(driven.by_network) == 3 * len(OFFERS)
    figures = [each.figure for each in told if each.what == "searching" and each.done]
    finals = [made.truth.rank for made in driven.offered("final")]
    assert len(figures) == 30
    assert math.isclose(figures[-1], sorted(finals)[1], abs_tol=1e-6)


def test_the_folder_says_who_decided(driven: Driven, tmp_path: Path) -> None:
    keep_driven(driven, tmp_path / "made")
    record = json.loads((tmp_path / "made" / "driven.json").read_text())
    assert record == json.loads(json.dumps(driven.to_dict()))
    told = record["settings"]
    assert (told["exact"], told["search"]["search"]) == (True, "screened")
    assert (told["search"]["doubt"], told["search"]["lookahead"]) == (0.002, 1)
    assert record["effort"]["network"]["responses"] == list(driven.network.responses)
    assert record["effort"]["network"]["medians"] == driven.network.medians()
    design = read_design(tmp_path / "made" / "design.json")
    assert design.efficiency == max(made.truth.rank for made in driven.by_network)
    found = design.provenance["found"]
    assert found["by"] == "search by the mechanics, screened by a network"
    drawn = picture_of(driven, "predicted")
    assert drawn.exact
    assert drawn.title == "tiny by mechanics, screened by mlp"
    assert drawn.note == "3 chains of 270 steps; the best of each chain, as computed"
    assert (tmp_path / "made" / "driven.png").stat().st_size > 10_000


def test_medians_are_over_chains() -> None:
    told = Effort((10, 10, 20), (4, 6, 2), (9, 3, 5), (10, 10, 30)).medians()
    assert told == {"acceptance": 0.4, "responses": 5.0, "scored": 10.0}


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"confirm": 5}, "confirm: in an exact search the mechanics decides on every step"),
        ({"search": {"doubt": -1.0}}, "doubt: expected a cost of at least 0"),
        ({"search": {"doubt": "much"}}, "doubt: expected a cost of at least 0, got 'much'"),
        ({"search": {"doubt": True}}, "doubt: expected a cost"),
        ({"search": {"least_chance": None}}, "least_chance: expected a probability above 0"),
        ({"search": {"lookahead": 1.5}}, "lookahead: expected a whole number"),
        ({"search": {"moves": ["swap"]}}, "moves: .* only cost, .*, doubt, least_chance, look"),
        ({"exact": False, "search": {"doubt": 0.1}}, "doubt: how networks screen belongs to an"),
    ],
)
def test_impossible_settings_are_refused(given: dict[str, object], message: str) -> None:
    with pytest.raises(InvalidSettings, match=message):
        Driving(**{"exact": True, **given})
