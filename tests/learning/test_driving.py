"""Search driven by networks: what is offered is checked, compared and kept."""

from __future__ import annotations

import json
import math
import threading
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidModel, InvalidSettings, OutputExists, UnknownName
from bellcrank.learning.driven import OFFERS, Driven, Made, median
from bellcrank.learning.driving import DrivingProgress, drive
from bellcrank.learning.driving_files import keep_driven, picture_of
from bellcrank.learning.driving_settings import Driving
from bellcrank.learning.scoring import Judge, NetworkScorer, Truth
from bellcrank.learning.stretches import Confirmer
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status
from bellcrank.model import find_problem, read_design, unpack_mask
from bellcrank.search.populations import start_population
from bellcrank.search.scorers import MechanicsScorer
from bellcrank.surrogate.predictor import Predictor

from .tiny import tiny_dataset, tiny_model, tiny_problem

if TYPE_CHECKING:
    from pathlib import Path

SETTINGS = Driving(chains=4, steps=120, checked=3, seed=2)


def ensemble(count: int = 1) -> Predictor:
    return Predictor(tiny_problem(), [tiny_model(k) for k in range(count)], device="cpu")


def mask_of(made: Made) -> np.ndarray:
    return unpack_mask(made.mask, tiny_problem().lattice.beam_count)


@pytest.fixture(scope="module")
def driven() -> Driven:
    return drive(tiny_problem(), ensemble(), SETTINGS, training=tiny_dataset())


def test_all_that_is_offered_is_checked_by_the_mechanics(driven: Driven) -> None:
    evaluator = SpringEvaluator(tiny_problem())
    assert len(driven.by_network) == len(driven.by_mechanics) == 4 * len(OFFERS)
    for made in (*driven.by_network, *driven.by_mechanics):
        response = evaluator.evaluate(mask_of(made), VERIFICATION_INCREMENT)
        assert made.truth.status == response.status.label
        sound = response.status is Status.CONVERGED
        assert made.truth.efficiency == (response.efficiency if sound else None)


def test_what_is_said_of_a_design_is_what_the_network_says_of_it(driven: Driven) -> None:
    masks = np.array([mask_of(made) for made in driven.by_network])
    said = ensemble().predict(masks).efficiency
    assert np.allclose([made.predicted for made in driven.by_network], said, atol=1e-5)
    assert all(made.predicted is None for made in driven.by_mechanics)


def test_a_checked_design_is_the_best_of_its_chain(driven: Driven) -> None:
    for by_network in (True, False):
        final, predicted, checked = (
            driven.offered(offer, by_network=by_network) for offer in OFFERS
        )
        for last, first, best in zip(final, predicted, checked, strict=True):
            assert last.chain == first.chain == best.chain
            assert best.truth.rank >= max(last.truth.rank, first.truth.rank)
    for first, other in zip(driven.offered("predicted"), driven.offered("final"), strict=True):
        assert first.predicted >= other.predicted - 1e-5


def test_distances_are_to_the_nearest_training_design(driven: Driven) -> None:
    known = np.unpackbits(tiny_dataset().packed, axis=1)
    for made in driven.by_network:
        packed = np.unpackbits(np.frombuffer(bytes.fromhex(made.mask), np.uint8))
        assert made.distance == (known != packed).sum(axis=1).min()


def test_the_same_seed_makes_the_same_designs(driven: Driven) -> None:
    again = drive(tiny_problem(), ensemble(), replace(SETTINGS, compare=False))
    assert [made.mask for made in again.by_network] == [made.mask for made in driven.by_network]
    assert again.by_mechanics == ()
    assert all(made.distance is None for made in again.by_network)
    other = drive(tiny_problem(), ensemble(), replace(SETTINGS, compare=False, seed=3))
    assert [made.mask for made in other.by_network] != [made.mask for made in again.by_network]


def test_a_cautious_ensemble_takes_off_what_it_disputes() -> None:
    masks = np.unpackbits(tiny_dataset().packed[:20], axis=1)
    masks = masks[:, : tiny_problem().lattice.beam_count].astype(bool)
    several = ensemble(3)
    said = several.predict(masks)
    score = NetworkScorer(several, caution=2.0).score(masks)
    assert np.allclose(score, said.efficiency - 2.0 * said.spread)
    made = drive(tiny_problem(), several, replace(SETTINGS, steps=40, caution=1.0, compare=False))
    assert all(each.spread is not None for each in made.by_network)


def test_a_stopped_search_checks_what_it_has() -> None:
    stop = threading.Event()
    told: list[DrivingProgress] = []

    def tell(progress: DrivingProgress) -> None:
        told.append(progress)
        if progress.done == 30:
            stop.set()

    driven = drive(tiny_problem(), ensemble(), SETTINGS, tell=tell, stop=stop)
    assert (driven.steps, driven.stopped, driven.by_mechanics) == (30, True, ())
    assert len(driven.by_network) == 4 * len(OFFERS)
    assert {progress.what for progress in told} == {"searching", "checking"}


def test_the_folder_holds_record_design_and_picture(driven: Driven, tmp_path: Path) -> None:
    keep_driven(driven, tmp_path / "made")
    record = json.loads((tmp_path / "made" / "driven.json").read_text())
    assert record == json.loads(json.dumps(driven.to_dict()))
    assert record["schema"] == "bellcrank/driven/1"
    assert record["settings"]["search"]["search"] == "paper"
    assert record["effort"]["network"]["scored"] == [120] * 4
    assert record["effort"]["mechanics"]["responses"] == [120] * 4
    assert set(record["provenance"]) >= {"version", "commit", "seed"}
    design = read_design(tmp_path / "made" / "design.json")
    assert design.efficiency == max(made.truth.rank for made in driven.by_network)
    assert design.provenance["found"]["by"].startswith("search driven by a network, checked")
    response = SpringEvaluator(tiny_problem()).evaluate(design.mask, VERIFICATION_INCREMENT)
    assert response.efficiency == design.efficiency
    assert (tmp_path / "made" / "driven.png").stat().st_size > 10_000
    with pytest.raises(OutputExists):
        keep_driven(driven, tmp_path / "made")


def failing(driven: Driven, failures: int) -> Driven:
    """The same, with the first so many designs of the networks snapping."""
    made = [
        replace(each, truth=Truth("snapped", None)) if number < failures * len(OFFERS) else each
        for number, each in enumerate(driven.by_network)
    ]
    return replace(driven, by_network=tuple(made))


def test_designs_that_snap_count_as_failed(driven: Driven, tmp_path: Path) -> None:
    some = failing(driven, 1)
    assert some.summary()["final"]["network_failed"] == 1
    sound = sorted(made.truth.rank for made in some.offered("final")[1:])
    assert some.summary()["final"]["network"] == (sound[0] + sound[1]) / 2
    none = failing(driven, 4)
    assert none.best is None
    assert none.summary()["checked"]["network"] is None
    keep_driven(none, tmp_path / "none")
    assert not (tmp_path / "none" / "design.json").exists()
    assert np.isnan(picture_of(none).true).all()


def test_medians_count_failures_as_the_worst() -> None:
    assert median([3.0, -math.inf, 1.0]) == 1.0
    assert median([3.0, -math.inf, -math.inf]) is None
    assert median([]) is None


def test_a_judge_is_not_asked_twice_about_a_design(monkeypatch: pytest.MonkeyPatch) -> None:
    judge = Judge(tiny_problem())
    packed = np.packbits(tiny_problem().initial)
    first = judge.truth(packed)
    monkeypatch.setattr(judge, "_evaluator", None)
    assert judge.truth(packed) == first


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({"chains": 0}, InvalidSettings, "chains: expected a whole number of at least 1"),
        ({"steps": 0}, InvalidSettings, "steps: "),
        ({"checked": 0}, InvalidSettings, "checked: expected at least 1 design"),
        ({"confirm": -1}, InvalidSettings, "confirm: expected a number of steps"),
        ({"search": {"moves": ["swap"]}}, InvalidSettings, "moves: a search driven by networks"),
        ({"search": {"hot": -1.0}}, InvalidSettings, "hot: expected a temperature above 0"),
        ({"search": {"schedule": "odd"}}, UnknownName, "unknown schedule 'odd'"),
    ],
)
def test_impossible_settings_are_refused(
    given: dict[str, object], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        Driving(**given)


@pytest.mark.parametrize("caution", [-1.0, math.nan, math.inf])
def test_impossible_caution_is_refused(caution: float) -> None:
    with pytest.raises(InvalidSettings, match="caution: expected at least 0"):
        NetworkScorer(ensemble(2), caution)


def test_caution_needs_several_networks() -> None:
    with pytest.raises(InvalidSettings, match="there is only one"):
        drive(tiny_problem(), ensemble(), replace(SETTINGS, caution=1.0))


def test_training_designs_for_another_problem_are_refused() -> None:
    crane = find_problem("crane")
    packed = np.packbits(crane.initial[None], axis=1)
    other = type(tiny_dataset())(crane, packed, np.zeros(1), np.zeros(1))
    with pytest.raises(InvalidModel, match="'crane'"):
        drive(tiny_problem(), ensemble(), SETTINGS, training=other)


def test_stretches_that_lower_the_true_efficiency_are_taken_back() -> None:
    cold = {"schedule": "constant", "cold": 1e-9}
    settings = replace(SETTINGS, confirm=5, compare=False, search=cold, steps=60)
    evaluator, problem = SpringEvaluator(tiny_problem()), tiny_problem()
    at_start = evaluator.evaluate(problem.initial).efficiency
    driven = drive(problem, ensemble(), settings)
    assert driven.network.responses == (12,) * 4
    finals = [made.truth.rank for made in driven.offered("final")]
    assert min(finals) >= at_start - 1e-7
    unconfirmed = drive(problem, ensemble(), replace(settings, confirm=0))
    assert unconfirmed.network.responses == (0,) * 4
    assert median(finals) >= median(made.truth.rank for made in unconfirmed.offered("final"))


def test_a_confirmer_keeps_to_metropolis_rule() -> None:
    """A right scorer is confirmed as often as the rule says, a design without response never."""
    problem = tiny_problem()
    rule = replace(SETTINGS, chains=400).rule
    scorer = MechanicsScorer(SpringEvaluator(problem))
    start = start_population(problem, scorer, rule)
    worse = start.masks.copy()
    chances = []
    for beam in problem.designable:
        flipped = problem.initial.copy()
        flipped[beam] ^= True
        cost = math.exp(-float(scorer.score(flipped[None])[0]))
        chances.append((math.exp(min(0.0, (start.cost[0] - cost) / 0.06)), beam))
    chance, beam = min(chances, key=lambda each: abs(each[0] - 0.5))
    assert 0.2 < chance < 0.9
    worse[:, beam] ^= True
    confirmer = Confirmer.at(SpringEvaluator(problem), rule, 1, start)
    after = confirmer.confirm(replace(start, step=10, masks=worse))
    kept = (after.masks == worse).all(axis=1)
    assert abs(kept.mean() - chance) < 4.0 * math.sqrt(chance * (1.0 - chance) / 400)
    assert np.array_equal(after.masks[~kept], start.masks[~kept])
    assert confirmer.taken_back == (~kept).sum()
    assert np.allclose(confirmer.cost, np.where(kept, confirmer.cost[kept][0], start.cost))
