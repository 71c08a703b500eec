"""Attribution by a network and by mechanics, against direct evaluation."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread
from scipy.stats import spearmanr

from bellcrank.errors import InvalidModel, InvalidSettings, OutputExists
from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import find_problem, human_design
from bellcrank.surrogate.models import models
from bellcrank.surrogate.trained_model import TrainedModel
from bellcrank.surrogate.views import views
from reproduction.networks.attribution import (
    INKS,
    attribute,
    occlude,
    rank_correlation,
    sample_map,
    spans,
)
from reproduction.networks.attribution_picture import draw_attribution

torch = pytest.importorskip("torch")

CANVAS = {"width": 72, "height": 48, "line": 1.5}
KINDS = ("mlp", "resnet18-w16")


def random_model(problem, kind, seed=0):
    """A network with random weights and random running averages."""
    architecture = models[kind]
    options = CANVAS if architecture.view == "picture" else {}
    view = views[architecture.view](problem, **options)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        network = architecture.build(view.shape)
        for module in network.modules():
            if isinstance(module, torch.nn.BatchNorm1d | torch.nn.BatchNorm2d):
                module.running_mean.normal_(0.0, 0.1)
                module.running_var.uniform_(0.5, 1.5)
    return TrainedModel(
        architecture=kind, problem=problem, view=view, mean=0.3, deviation=2.0,
        network=network.eval(),
    )  # fmt: skip


@pytest.fixture(scope="module")
def crane():
    return find_problem("crane")


@pytest.fixture(scope="module")
def human():
    return human_design("crane")


@pytest.fixture(scope="module")
def by_kind(crane):
    return {kind: random_model(crane, kind) for kind in KINDS}


@pytest.fixture(scope="module")
def explained(by_kind, human):
    return attribute(by_kind["resnet18-w16"], human, device="cpu")


def test_a_white_block_on_white_paper_changes_nothing(by_kind, crane):
    model = by_kind["resnet18-w16"]
    mask = crane.initial.copy()
    mask[crane.designable] = False
    found = occlude(model, np.packbits(mask), 6, ink=INKS["white"], device="cpu")
    picture = model.view.arrays(np.packbits(mask)[None])[0, 0]
    empty = np.array(
        [[not picture[row, column].any() for column in spans(72, 6)] for row in spans(48, 6)]
    )
    assert found.shape == empty.shape == (8, 12)
    assert 0 < empty.sum() < empty.size
    assert (found[empty] == 0.0).all()
    assert (np.abs(found[~empty]) > 0.0).all()


@pytest.mark.parametrize("ink", INKS.values())
def test_a_map_is_the_change_of_the_prediction_for_each_altered_picture(by_kind, human, ink):
    model = by_kind["resnet18-w16"]
    packed = np.packbits(human.mask)
    found = occlude(model, packed, 8, ink=ink, device="cpu")
    picture = model.view.arrays(packed[None]).astype(np.float32) / 255.0

    def predict(values):
        with torch.inference_mode():
            return float(model.network(torch.from_numpy(values)))

    for row, column in ((0, 0), (2, 4), (5, 8), (3, 3)):
        altered = picture.copy()
        top, left = 8 * row + 4 - 6, 8 * column + 4 - 6  # a side of 12 around pixel 8 i + 4
        altered[:, :, max(top, 0) : top + 12, max(left, 0) : left + 12] = ink / 255.0
        expected = model.deviation * (predict(altered) - predict(picture))
        assert found[row, column] == pytest.approx(expected, abs=1e-5)


def test_maps_are_sampled_at_the_positions_of_the_block():
    values = np.arange(12.0).reshape(3, 4)
    x, y = np.meshgrid(np.arange(2.0, 16.0, 4.0), 12 - np.arange(2.0, 12.0, 4.0))
    points = np.stack([x.ravel(), y.ravel()], axis=1)
    assert np.allclose(sample_map(values, 4, points, 12), values.ravel())


def test_maps_lie_where_the_lattice_is(explained, crane):
    positions = crane.lattice.positions
    assert (explained.low < positions.min(axis=0)).all()
    assert (explained.high > positions.max(axis=0)).all()
    # The canvas is centred: as much paper on the left as on the right, up to a stride.
    unit = (explained.high - explained.low)[0] / (4 * explained.maps["white"].shape[1])
    assert np.allclose(
        positions.min(axis=0) - explained.low, explained.high - positions.max(axis=0), atol=1e-6
    )
    assert (np.ptp(positions, axis=0) / unit < [72, 48]).all()


def test_networks_without_pictures_and_small_pictures_are_refused(by_kind, crane, human):
    with pytest.raises(InvalidSettings, match="'mlp'"):
        occlude(by_kind["mlp"], np.packbits(human.mask))
    with pytest.raises(InvalidSettings, match="'mlp'"):
        attribute(by_kind["mlp"], human)
    view = views["picture"](crane, width=16, height=10, line=1.0, margin=0.0)
    with pytest.raises(InvalidSettings, match="at least 12 pixels, got 16 x 10"):
        attribute(replace(by_kind["resnet18-w16"], view=view), human)


@pytest.mark.parametrize("stride", [0, -1])
def test_a_stride_is_positive(by_kind, human, stride):
    with pytest.raises(InvalidSettings, match="stride: expected at least 1 pixel"):
        attribute(by_kind["resnet18-w16"], human, stride=stride)


def test_exact_effects_are_those_of_the_evaluator(explained, human):
    evaluator = SpringEvaluator(human.problem)
    assert explained.efficiency == evaluator.evaluate(human.mask).efficiency
    for index in range(0, len(explained.beams), 9):
        flipped = human.mask.copy()
        flipped[explained.beams[index]] ^= True
        response = evaluator.evaluate(flipped)
        if response.is_admissible:
            change = response.efficiency - explained.efficiency
            assert explained.changes["exact"][index] == pytest.approx(change, abs=1e-7)
        else:
            assert np.isnan(explained.changes["exact"][index])
    evaluator.evaluate(human.mask)
    assert np.array_equal(explained.changes["low_rank"], evaluator.predict_flips(human.mask).change)


def test_predicted_effects_of_flips_are_differences_of_predictions(explained, by_kind, human):
    model = by_kind["resnet18-w16"]
    flipped = human.mask.copy()
    flipped[explained.beams[7]] ^= True
    predicted = model.predict(np.packbits([human.mask, flipped], axis=1), device="cpu")
    assert explained.predicted == pytest.approx(predicted[0], abs=1e-5)
    assert explained.changes["network"][7] == pytest.approx(predicted[1] - predicted[0], abs=1e-5)


def test_correlations_agree_with_scipy(explained):
    found = explained.correlations()
    present, everywhere = explained.present, np.ones(len(explained.beams), bool)
    compared = {
        "white": (explained.changes["white"], present),
        "black": (explained.changes["black"], ~present),
        "network": (explained.changes["network"], everywhere),
        "low_rank": (explained.changes["low_rank"], everywhere),
    }
    assert set(found) == set(compared)
    for name, (values, chosen) in compared.items():
        known = chosen & np.isfinite(values) & np.isfinite(explained.changes["exact"])
        expected = spearmanr(values[known], explained.changes["exact"][known])[0]
        assert found[name] == pytest.approx(expected)
    assert np.isnan(rank_correlation(np.ones(1), np.ones(1)))


def test_an_attribution_is_plain_data(explained, human):
    found = json.loads(json.dumps(explained.to_dict(), allow_nan=False))
    assert found["mask"] == human.mask_hex
    assert {len(values) for values in found["changes"].values()} == {len(found["beams"])} == {203}
    assert {name: len(rows) for name, rows in found["maps"].items()} == {"white": 12, "black": 12}
    assert set(found["correlations"]) == {"white", "black", "network", "low_rank"}


def test_a_design_without_a_response_cannot_be_explained(by_kind, crane, monkeypatch):
    real = SpringEvaluator.evaluate

    def snapping(self, mask, largest_increment=1.0, **options):
        found = real(self, mask, largest_increment, **options)
        return replace(found, status=Status.SNAPPED)

    monkeypatch.setattr(SpringEvaluator, "evaluate", snapping)
    with pytest.raises(InvalidSettings, match="'crane'"):
        attribute(by_kind["resnet18-w16"], crane.full_design(), device="cpu")


def test_another_problem_is_refused(by_kind):
    with pytest.raises(InvalidModel, match="'crane'"):
        attribute(by_kind["mlp"], find_problem("anti-parallel").full_design())


def test_changes_of_zero_can_be_drawn_and_nothing_is_cut_off(explained, tmp_path):
    draw_attribution(explained, tmp_path / "all.png")
    still = replace(
        explained,
        changes={name: np.zeros_like(each) for name, each in explained.changes.items()},
        maps={name: np.zeros_like(each) for name, each in explained.maps.items()},
    )
    draw_attribution(still, tmp_path / "flat.svg")
    assert (tmp_path / "flat.svg").read_bytes().startswith(b"<?xml")
    picture = imread(tmp_path / "all.png")[..., :3]
    assert picture.min() < 0.2
    for edge in (picture[:8], picture[-8:], picture[:, :8], picture[:, -8:]):
        assert edge.min() == 1.0


def test_pictures_are_neither_misnamed_nor_replaced(explained, tmp_path):
    with pytest.raises(InvalidSettings, match="ending in"):
        draw_attribution(explained, tmp_path / "a.jpg")
    taken = tmp_path / "a.png"
    taken.write_text("mine")
    with pytest.raises(OutputExists):
        draw_attribution(explained, taken)
    assert taken.read_text() == "mine"
