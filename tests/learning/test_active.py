"""Active learning: what is proposed, labelled and learnt."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bellcrank.errors import InvalidDataset, InvalidModel, InvalidSettings
from bellcrank.learning import proposing
from bellcrank.learning.active import learn_actively
from bellcrank.learning.knowledge import Knowledge, begin_learning
from bellcrank.learning.proposing import ActiveSettings, label_designs, propose_designs
from bellcrank.mechanics import Response, SpringEvaluator, Status
from bellcrank.surrogate.predictor import Predictor
from tests.surrogate.helpers import moved

from .tiny import RECIPE, tiny_dataset, tiny_model, tiny_problem

SETTINGS = ActiveSettings(chains=5, steps=60, disputed=6, best=4, seed=9)


def knowledge(members: int = 2) -> Knowledge:
    return begin_learning(tiny_dataset(), RECIPE, [tiny_model(k) for k in range(members)])


def predictor(members: int) -> Predictor:
    return Predictor(tiny_problem(), [tiny_model(k) for k in range(members)], device="cpu")


@pytest.mark.parametrize("members", [1, 3])
def test_each_chain_proposes_different_designs(members: int) -> None:
    chosen = propose_designs(predictor(members), SETTINGS)
    assert [len(designs) for designs in chosen] == [10] * 5
    assert all(len(np.unique(designs, axis=0)) == 10 for designs in chosen)


def test_the_most_disputed_and_the_best_are_chosen() -> None:
    beams = tiny_problem().lattice.beam_count
    several = predictor(3)
    (everything,) = propose_designs(several, replace(SETTINGS, chains=1, disputed=60, best=0))
    (chosen,) = propose_designs(several, replace(SETTINGS, chains=1))
    said = several.predict(np.unpackbits(everything, axis=1, count=beams).astype(bool))
    place = {design.tobytes(): k for k, design in enumerate(everything)}
    rows = [place[design.tobytes()] for design in chosen]
    best = np.argsort(-said.efficiency)[:4]
    assert set(best) <= set(rows)
    left = np.setdiff1d(np.arange(len(everything)), best)
    disputed = left[np.argsort(-said.spread[left])[:6]]
    assert set(disputed) == set(rows) - set(best)


def test_labels_are_those_of_the_mechanics_and_each_chain_is_a_run() -> None:
    one = predictor(1)
    data = label_designs(one, propose_designs(one, SETTINGS), SETTINGS)
    evaluator = SpringEvaluator(tiny_problem())
    for packed, efficiency in zip(data.packed[::7], data.efficiency[::7], strict=True):
        mask = np.unpackbits(packed, count=tiny_problem().lattice.beam_count)
        assert evaluator.evaluate(mask.astype(bool)).efficiency == efficiency
    assert data.run_count == 5
    assert data.origin["active"]["seed"] == 9


def test_rounds_extend_the_data_and_keep_the_sides_of_the_split() -> None:
    first = knowledge()
    told = set()
    grown, found = learn_actively(
        first, SETTINGS, device="cpu", tell=lambda what, _done, _total: told.add(what)
    )
    assert told == {"searching", "labelling", "training"}
    again, _ = learn_actively(grown, replace(SETTINGS, seed=10), device="cpu")
    assert (first.rounds, grown.rounds, again.rounds) == (0, 1, 2)
    assert found.proposed == 50
    assert found.surprise.count == found.labelled == len(grown.data) - len(first.data)
    assert len(found.held_out) == len(grown.models) == 2
    assert grown.data.run_count == first.data.run_count + 5
    for before, after in ((first, grown), (grown, again)):
        assert np.array_equal(after.data.packed[: len(before.data)], before.data.packed)
        for side in ("training", "held_out"):
            old, new = getattr(before.split, side), getattr(after.split, side)
            assert np.array_equal(new[: len(old)], old)
    runs = again.data.run
    assert not set(runs[again.split.training]) & set(runs[again.split.held_out])
    assert sorted(np.concatenate([again.split.training, again.split.held_out])) == list(
        range(len(again.data))
    )


def test_a_warm_start_goes_on_from_the_weights() -> None:
    known = knowledge(1)
    barely = replace(known, recipe=replace(RECIPE, epochs=1, learning_rate=1e-12))
    settings = replace(SETTINGS, share=0.5)
    masks = known.data.packed[:50]
    before = known.models[0].predict(masks, device="cpu")
    warm, _ = learn_actively(barely, settings, device="cpu")
    cold, _ = learn_actively(barely, replace(settings, warm=False), device="cpu")
    close = np.abs(warm.models[0].predict(masks, device="cpu") - before).mean()
    far = np.abs(cold.models[0].predict(masks, device="cpu") - before).mean()
    assert close < 0.5 * far


def test_a_warm_start_of_another_kind_of_network_is_refused() -> None:
    known = replace(knowledge(1), recipe=replace(RECIPE, model="grid"))
    with pytest.raises(InvalidSettings, match="'grid' cannot go on from the weights of a 'mlp'"):
        learn_actively(known, SETTINGS, device="cpu")


@pytest.mark.parametrize("what", ["searching", "training"])
def test_a_stopped_round_is_none(what: str) -> None:
    seen = []
    ended = learn_actively(
        knowledge(1), SETTINGS, device="cpu",
        tell=lambda now, _done, _total: seen.append(now), stop=lambda: what in seen,
    )  # fmt: skip
    assert ended is None or what == "training"  # a short training may be over before it is asked


class Snapping(SpringEvaluator):
    """Finds that everything snaps."""

    def evaluate(self, mask: np.ndarray, largest_increment: float = 1.0, **start: Any) -> Response:
        return replace(super().evaluate(mask, largest_increment, **start), status=Status.SNAPPED)


def test_designs_that_all_snap_are_no_data(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(proposing, "SpringEvaluator", Snapping)
    chosen = [tiny_dataset().packed[:3]]
    with pytest.raises(InvalidDataset, match="none of 3 designs"):
        label_designs(predictor(1), chosen, SETTINGS)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"disputed": -1}, "disputed: expected a whole number of at least 0"),
        ({"best": 1.5}, "best: expected a whole number"),
        ({"best": "many"}, "best: expected a whole number"),
        ({"disputed": 0, "best": 0}, "disputed, best: expected at least one design to label"),
        ({"share": 1.0}, "share: expected from 0 to below 1"),
        ({"share": "half"}, "share: expected from 0 to below 1"),
        ({"caution": -1.0}, "caution: expected at least 0"),
        ({"caution": "some"}, "caution: expected at least 0"),
        ({"warm": 1}, "warm: expected true or false"),
        ({"chains": 0}, "chains: "),
        ({"steps": "all"}, "steps: "),
        ({"seed": -1}, "seed: "),
        ({"epochs": 0}, "epochs: "),
        ({"epoch_size": 1}, "epoch_size: "),
        ({"learning_rate": 0.0}, "learning_rate: "),
    ],
)
def test_impossible_rounds_are_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidSettings, match=f"^{message}"):
        ActiveSettings(**given)


def test_settings_come_back_from_plain_data_and_know_their_keys() -> None:
    assert ActiveSettings.from_dict(SETTINGS.to_dict()) == SETTINGS
    with pytest.raises(InvalidSettings, match=r"^stride: no such key in a round; it has: .*chains"):
        ActiveSettings.from_dict({"stride": 2})


def test_a_round_changes_of_the_recipe_what_its_settings_say() -> None:
    changed = ActiveSettings(epochs=7, epoch_size=128, learning_rate=0.5).adapt(RECIPE)
    assert changed == replace(RECIPE, epochs=7, epoch_size=128, learning_rate=0.5)
    assert ActiveSettings().adapt(RECIPE) == RECIPE
    with pytest.raises(InvalidSettings, match="epoch_size: expected a whole number of at least 64"):
        ActiveSettings(epoch_size=32).adapt(RECIPE)


def test_networks_that_number_beams_otherwise_cannot_learn_on() -> None:
    given, old_beam = moved(tiny_problem())
    masks = np.unpackbits(tiny_dataset().packed, axis=1, count=len(old_beam))[:, old_beam]
    renumbered = replace(tiny_dataset(), problem=given, packed=np.packbits(masks, axis=1))
    with pytest.raises(InvalidModel, match="with other numbers of the beams"):
        begin_learning(renumbered, RECIPE, [tiny_model()])
