"""Search with a network: offered designs are verified by the mechanics, compared and stored."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank.errors import InvalidModel, InvalidSettings, OutputExists
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status
from bellcrank.model import find_problem, read_design, unpack_mask
from bellcrank.search import chain_blocks
from bellcrank.surrogate.evaluator import NetworkEvaluator
from bellcrank.surrogate.predictor import Predictor
from reproduction.networks.surrogate_search import (
    FIRST_CHAIN,
    OFFERS,
    SurrogateSearchSettings,
    median,
    medians_of,
    rank,
    run_surrogate_search,
    smallest_distances,
)
from reproduction.networks.surrogate_search_files import sheet_of, write_surrogate_search
from tests.surrogate.tiny import tiny_dataset, tiny_model, tiny_problem

if TYPE_CHECKING:
    from pathlib import Path

SETTINGS = SurrogateSearchSettings(chains=4, steps=120, verified=3, seed=2)
Record = dict[str, Any]


def predictor() -> Predictor:
    return Predictor(tiny_problem(), tiny_model(), device="cpu")


def mask_of(design: Record) -> np.ndarray:
    return unpack_mask(design["mask"], tiny_problem().lattice.beam_count)


def offered(record: Record, rule: str, by: str = "network") -> list[Record]:
    return [design for design in record[f"by_{by}"] if design["offer"] == rule]


@pytest.fixture(scope="module")
def record() -> Record:
    return run_surrogate_search(tiny_problem(), predictor(), SETTINGS, training=tiny_dataset())


def test_all_offered_designs_are_verified_by_the_mechanics(record: Record) -> None:
    evaluator = SpringEvaluator(tiny_problem())
    assert len(record["by_network"]) == len(record["by_mechanics"]) == 4 * len(OFFERS)
    for design in (*record["by_network"], *record["by_mechanics"]):
        response = evaluator.evaluate(mask_of(design), VERIFICATION_INCREMENT)
        assert design["status"] == response.status.label
        stable = response.status is Status.CONVERGED
        assert design["efficiency"] == (response.efficiency if stable else None)


def test_chains_are_those_of_the_metropolis_search(record: Record) -> None:
    for name, evaluator in (
        ("network", NetworkEvaluator(predictor())),
        ("mechanics", SpringEvaluator(tiny_problem())),
    ):
        for number, design in enumerate(offered(record, "final", name), FIRST_CHAIN):
            *_, (state, _) = chain_blocks(evaluator, SETTINGS.metropolis, number)
            assert (design["chain"], design["mask"]) == (number, state.to_dict()["mask"])


def test_predictions_are_those_of_the_network(record: Record) -> None:
    predicted = predictor().predict(np.array([mask_of(each) for each in record["by_network"]]))
    assert np.allclose([each["predicted"] for each in record["by_network"]], predicted, atol=1e-5)
    assert all("predicted" not in each for each in record["by_mechanics"])


def test_a_verified_design_is_the_best_of_its_chain(record: Record) -> None:
    for name, evaluator in (
        ("network", NetworkEvaluator(predictor())),
        ("mechanics", SpringEvaluator(tiny_problem())),
    ):
        judge = SpringEvaluator(tiny_problem())
        final, verified = offered(record, "final", name), offered(record, "verified", name)
        for last, best in zip(final, verified, strict=True):
            assert last["chain"] == best["chain"]
            assert rank(best) >= rank(last)
        # The design that the chain evaluated as the best is among the verified ones.
        _, mask = max(
            (float(rows.efficiency[row]), rows.mask[row].tobytes().hex())
            for _, rows in chain_blocks(evaluator, SETTINGS.metropolis, FIRST_CHAIN)
            for row in np.flatnonzero(rows.status == int(Status.CONVERGED))
        )
        found = judge.evaluate(mask_of({"mask": mask}), VERIFICATION_INCREMENT)
        if found.status is Status.CONVERGED:
            assert rank(verified[0]) >= found.efficiency


def test_distances_are_to_the_nearest_training_design(record: Record) -> None:
    known = np.unpackbits(tiny_dataset().packed, axis=1)
    for design in record["by_network"]:
        packed = np.unpackbits(np.frombuffer(bytes.fromhex(design["mask"]), np.uint8))
        assert design["distance"] == (known != packed).sum(axis=1).min()


@pytest.mark.parametrize("beams", [3, 64, 203, 352])
def test_distances_agree_with_counting_beam_by_beam(beams: int) -> None:
    rng = np.random.default_rng(beams)
    known = rng.random((200, beams)) < 0.6
    made = rng.random((25, beams)) < 0.6
    made[3] = known[150]
    counted = (made[:, None] != known[None]).sum(axis=2).min(axis=1)
    found = smallest_distances(np.packbits(made, axis=1), np.packbits(known, axis=1))
    assert found.tolist() == counted.tolist()
    assert found[3] == 0
    assert smallest_distances(np.empty((0, 5), np.uint8), np.zeros((2, 5), np.uint8)).shape == (0,)


def test_the_seed_determines_the_designs(record: Record) -> None:
    alone = replace(SETTINGS, compare=False)
    again = run_surrogate_search(tiny_problem(), predictor(), alone)
    masks = [each["mask"] for each in again["by_network"]]
    assert masks == [each["mask"] for each in record["by_network"]]
    assert again["by_mechanics"] == []
    assert all(each["distance"] is None for each in again["by_network"])
    other = run_surrogate_search(tiny_problem(), predictor(), replace(alone, seed=3))
    assert [each["mask"] for each in other["by_network"]] != masks


def test_the_folder_holds_record_design_and_picture(record: Record, tmp_path: Path) -> None:
    write_surrogate_search(record, tiny_problem(), tmp_path / "made")
    written = json.loads((tmp_path / "made" / "surrogate-search.json").read_text())
    assert written == json.loads(json.dumps(record))
    assert written["schema"] == "bellcrank/surrogate-search/1"
    assert written["settings"]["search"]["search"] == "paper"
    assert set(written["provenance"]) >= {"version", "commit", "seed"}
    design = read_design(tmp_path / "made" / "design.json")
    assert design.efficiency == max(map(rank, record["by_network"]))
    response = SpringEvaluator(tiny_problem()).evaluate(design.mask, VERIFICATION_INCREMENT)
    assert response.efficiency == design.efficiency
    assert (tmp_path / "made" / "surrogate-search.png").stat().st_size > 10_000
    with pytest.raises(OutputExists):
        write_surrogate_search(record, tiny_problem(), tmp_path / "made")


def failing(record: Record, failures: int) -> Record:
    """The same record with the first designs of the network snapping."""
    designs = [
        {**each, "status": "snapped", "efficiency": None}
        if number < failures * len(OFFERS)
        else each
        for number, each in enumerate(record["by_network"])
    ]
    return {**record, "by_network": designs}


def medians(record: Record, rule: str) -> Record:
    return medians_of({name: record[f"by_{name}"] for name in ("network", "mechanics")}, rule)


def test_designs_that_snap_count_as_failed(record: Record, tmp_path: Path) -> None:
    assert medians(record, "final") == record["medians"]["final"]
    some = failing(record, 1)
    assert medians(some, "final")["network_failed"] == 1
    stable = sorted(map(rank, offered(some, "final")[1:]))
    assert medians(some, "final")["network"] == (stable[0] + stable[1]) / 2
    none = failing(record, 4)
    assert medians(none, "verified")["network"] is None
    write_surrogate_search(none, tiny_problem(), tmp_path / "none")
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
