"""Search with a network: offered designs are verified by the mechanics, compared and stored."""

from __future__ import annotations

import json
import math
import threading
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidModel, InvalidSettings, OutputExists, UnknownName
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status
from bellcrank.model import find_problem, read_design, unpack_mask
from bellcrank.search import chain_blocks
from bellcrank.surrogate.evaluator import NetworkEvaluator
from bellcrank.surrogate.predictor import Predictor
from reproduction.networks.surrogate_search import (
    FIRST_CHAIN,
    OFFERS,
    OfferedDesign,
    SurrogateSearchProgress,
    SurrogateSearchResult,
    SurrogateSearchSettings,
    median,
    run_surrogate_search,
)
from reproduction.networks.surrogate_search_files import sheet_of, write_surrogate_search
from tests.surrogate.tiny import tiny_dataset, tiny_model, tiny_problem

if TYPE_CHECKING:
    from pathlib import Path

SETTINGS = SurrogateSearchSettings(chains=4, steps=120, verified=3, seed=2)


def predictor() -> Predictor:
    return Predictor(tiny_problem(), tiny_model(), device="cpu")


def mask_of(design: OfferedDesign) -> np.ndarray:
    return unpack_mask(design.mask, tiny_problem().lattice.beam_count)


@pytest.fixture(scope="module")
def result() -> SurrogateSearchResult:
    return run_surrogate_search(tiny_problem(), predictor(), SETTINGS, training=tiny_dataset())


def test_all_offered_designs_are_verified_by_the_mechanics(result: SurrogateSearchResult) -> None:
    evaluator = SpringEvaluator(tiny_problem())
    assert len(result.by_network) == len(result.by_mechanics) == 4 * len(OFFERS)
    for design in (*result.by_network, *result.by_mechanics):
        response = evaluator.evaluate(mask_of(design), VERIFICATION_INCREMENT)
        assert design.status == response.status.label
        stable = response.status is Status.CONVERGED
        assert design.efficiency == (response.efficiency if stable else None)


def test_chains_are_those_of_the_metropolis_search(result: SurrogateSearchResult) -> None:
    for name, evaluator in (
        ("network", NetworkEvaluator(predictor())),
        ("mechanics", SpringEvaluator(tiny_problem())),
    ):
        final = result.offered("final", by_network=name == "network")
        for number, design in enumerate(final, FIRST_CHAIN):
            *_, (state, _) = chain_blocks(evaluator, SETTINGS.metropolis, number)
            assert state.mask == design.mask


def test_predictions_are_those_of_the_network(result: SurrogateSearchResult) -> None:
    masks = np.array([mask_of(design) for design in result.by_network])
    predicted = predictor().predict(masks)
    assert np.allclose([design.predicted for design in result.by_network], predicted, atol=1e-5)
    assert all(design.predicted is None for design in result.by_mechanics)


def test_a_verified_design_is_the_best_of_its_chain(result: SurrogateSearchResult) -> None:
    for by_network in (True, False):
        final, predicted, verified = (
            result.offered(offer, by_network=by_network) for offer in OFFERS
        )
        for last, first, best in zip(final, predicted, verified, strict=True):
            assert last.chain == first.chain == best.chain
            assert best.rank >= max(last.rank, first.rank)
    for first, last in zip(result.offered("predicted"), result.offered("final"), strict=True):
        assert first.predicted >= last.predicted - 1e-5


def test_distances_are_to_the_nearest_training_design(result: SurrogateSearchResult) -> None:
    known = np.unpackbits(tiny_dataset().packed, axis=1)
    for design in result.by_network:
        packed = np.unpackbits(np.frombuffer(bytes.fromhex(design.mask), np.uint8))
        assert design.distance == (known != packed).sum(axis=1).min()


def test_the_seed_determines_the_designs(result: SurrogateSearchResult) -> None:
    alone = replace(SETTINGS, compare=False)
    again = run_surrogate_search(tiny_problem(), predictor(), alone)
    assert [each.mask for each in again.by_network] == [each.mask for each in result.by_network]
    assert again.by_mechanics == ()
    assert all(each.distance is None for each in again.by_network)
    other = run_surrogate_search(tiny_problem(), predictor(), replace(alone, seed=3))
    assert [each.mask for each in other.by_network] != [each.mask for each in again.by_network]


def test_a_stopped_search_verifies_the_designs_found_so_far() -> None:
    stop = threading.Event()
    reports: list[SurrogateSearchProgress] = []

    def report(progress: SurrogateSearchProgress) -> None:
        reports.append(progress)
        if progress.stage == "searching" and progress.done == 2:
            stop.set()

    found = run_surrogate_search(tiny_problem(), predictor(), SETTINGS, report=report, stop=stop)
    assert (found.stopped, found.by_mechanics) == (True, ())
    assert 2 * len(OFFERS) <= len(found.by_network) < 4 * len(OFFERS)
    assert {progress.stage for progress in reports} == {"searching", "verifying"}


def test_the_folder_holds_record_design_and_picture(
    result: SurrogateSearchResult, tmp_path: Path
) -> None:
    write_surrogate_search(result, tmp_path / "made")
    record = json.loads((tmp_path / "made" / "surrogate-search.json").read_text())
    assert record == json.loads(json.dumps(result.to_dict()))
    assert record["schema"] == "bellcrank/surrogate-search/1"
    assert record["settings"]["search"]["search"] == "paper"
    assert set(record["provenance"]) >= {"version", "commit", "seed"}
    design = read_design(tmp_path / "made" / "design.json")
    assert design.efficiency == max(each.rank for each in result.by_network)
    response = SpringEvaluator(tiny_problem()).evaluate(design.mask, VERIFICATION_INCREMENT)
    assert response.efficiency == design.efficiency
    assert (tmp_path / "made" / "surrogate-search.png").stat().st_size > 10_000
    with pytest.raises(OutputExists):
        write_surrogate_search(result, tmp_path / "made")


def failing(result: SurrogateSearchResult, failures: int) -> SurrogateSearchResult:
    """The same result with the first designs of the network snapping."""
    designs = [
        replace(each, status="snapped", efficiency=None)
        if number < failures * len(OFFERS)
        else each
        for number, each in enumerate(result.by_network)
    ]
    return replace(result, by_network=tuple(designs))


def test_designs_that_snap_count_as_failed(result: SurrogateSearchResult, tmp_path: Path) -> None:
    some = failing(result, 1)
    assert some.medians()["final"]["network_failed"] == 1
    stable = sorted(each.rank for each in some.offered("final")[1:])
    assert some.medians()["final"]["network"] == (stable[0] + stable[1]) / 2
    none = failing(result, 4)
    assert none.best is None
    assert none.medians()["verified"]["network"] is None
    write_surrogate_search(none, tmp_path / "none")
    assert not (tmp_path / "none" / "design.json").exists()
    assert "4 without" in sheet_of(none).charts[1].note[0]


def test_medians_count_failures_as_the_worst() -> None:
    assert median([3.0, -math.inf, 1.0]) == 1.0
    assert median([3.0, -math.inf, -math.inf]) is None
    assert median([]) is None


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({"chains": 0}, InvalidSettings, "chains: "),
        ({"steps": 0}, InvalidSettings, "steps: "),
        ({"verified": 0}, InvalidSettings, "verified: "),
        ({"verified": True}, InvalidSettings, "verified: "),
        ({"search": {"moves": ["swap"]}}, InvalidSettings, "moves: "),
        ({"search": {"hot": -1.0}}, InvalidSettings, "hot: "),
        ({"search": {"schedule": "odd"}}, UnknownName, "'odd'"),
    ],
)
def test_invalid_settings_are_refused(
    given: dict[str, object], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        SurrogateSearchSettings(**given)


def test_a_dataset_of_another_problem_is_refused() -> None:
    crane = find_problem("crane")
    packed = np.packbits(crane.initial[None], axis=1)
    other = type(tiny_dataset())(crane, packed, np.zeros(1), np.zeros(1))
    with pytest.raises(InvalidModel, match="'crane'"):
        run_surrogate_search(tiny_problem(), predictor(), SETTINGS, training=other)
