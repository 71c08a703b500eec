"""Attribution by a network and by mechanics, against direct evaluation."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread
from scipy.stats import pearsonr, spearmanr

from bellcrank.errors import InvalidModel, InvalidSettings, OutputExists
from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import Design, Lattice, find_problem, human_design
from bellcrank.surrogate.models import models
from bellcrank.surrogate.trained_model import TrainedModel
from bellcrank.surrogate.views import views
from reproduction.networks.attribution import (
    BLACK,
    SUBSETS,
    WHITE,
    Block,
    Region,
    agreement,
    attribute,
    occlude,
    overlap_of_regions,
    regions_of,
    sample_map,
)
from reproduction.networks.attribution_picture import draw_attribution, symmetric_ticks

torch = pytest.importorskip("torch")

CANVAS = {"width": 72, "height": 48, "line": 1.5}
SHIFT = np.array([3.0, -2.0])
KINDS = ("mlp", "resnet18-w16")


def random_model(problem, kind, seed=0):
    """A network that has learnt nothing, whose running figures are not those of a fresh one."""
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
    block = Block(size=6, stride=3)
    found = occlude(model, np.packbits(mask), block, ink=WHITE, device="cpu")
    picture = model.view.arrays(np.packbits(mask)[None])[0, 0]
    rows, columns = block.centres(48), block.centres(72)
    empty = np.array(
        [[not picture[block.span(r, 48), block.span(c, 72)].any() for c in columns] for r in rows]
    )
    assert found.shape == empty.shape == (16, 24)
    assert 0 < empty.sum() < empty.size
    assert (found[empty] == 0.0).all()
    assert (np.abs(found[~empty]) > 0.0).all()


@pytest.mark.parametrize("ink", [WHITE, BLACK])
def test_a_map_is_what_the_network_says_of_each_altered_picture(by_kind, human, ink):
    model, block = by_kind["resnet18-w16"], Block(size=9, stride=8)
    packed = np.packbits(human.mask)
    found = occlude(model, packed, block, ink=ink, device="cpu")
    picture = model.view.arrays(packed[None]).astype(np.float32) / 255.0

    def ask(values):
        with torch.inference_mode():
            return float(model.network(torch.from_numpy(values)))

    for row, column in ((0, 0), (2, 4), (5, 8), (3, 3)):
        altered = picture.copy()
        top, left = 8 * row + 4 - 4, 8 * column + 4 - 4  # a side of 9 around pixel 8 i + 4
        altered[:, :, top : top + 9, left : left + 9] = ink / 255.0
        expected = model.deviation * (ask(altered) - ask(picture))
        assert found[row, column] == pytest.approx(expected, abs=1e-5)


def test_maps_are_read_at_the_places_of_the_block(by_kind):
    block = Block(size=4, stride=4)
    values = np.arange(12.0).reshape(3, 4)
    x, y = np.meshgrid(block.centres(16), 12 - block.centres(12))
    places = np.stack([x.ravel(), y.ravel()], axis=1)
    assert np.allclose(sample_map(values, block, places, 12), values.ravel())


def test_maps_lie_where_the_lattice_is(explained, crane):
    seen = explained.occlusion
    positions = crane.lattice.positions
    assert (seen.low < positions.min(axis=0)).all()
    assert (seen.high > positions.max(axis=0)).all()
    # The canvas is centred: as much paper on the left as on the right, up to a stride.
    unit = (seen.high - seen.low)[0] / (seen.block.stride * seen.white.shape[1])
    assert np.allclose(
        positions.min(axis=0) - seen.low, seen.high - positions.max(axis=0), atol=1e-6
    )
    placed = np.ptp(crane.lattice.positions, axis=0) / unit
    assert (placed < [72, 48]).all()


def test_networks_that_see_no_pictures_cannot_be_occluded(by_kind, human):
    with pytest.raises(InvalidSettings, match="'mlp'"):
        occlude(by_kind["mlp"], np.packbits(human.mask), Block())
    with pytest.raises(InvalidSettings, match="'mlp'"):
        attribute(by_kind["mlp"], human, Block())


@pytest.mark.parametrize(("size", "stride"), [(0, 4), (12, 0), (-1, 1)])
def test_blocks_have_a_size(size, stride):
    with pytest.raises(InvalidSettings, match="expected at least 1 pixel"):
        Block(size, stride)


def test_a_block_larger_than_the_picture_is_refused(by_kind, human):
    with pytest.raises(InvalidSettings, match="at most 48 pixels"):
        occlude(by_kind["resnet18-w16"], np.packbits(human.mask), Block(49))


def test_exact_effects_are_those_of_the_evaluator(explained, human):
    evaluator = SpringEvaluator(human.problem)
    assert explained.efficiency == evaluator.evaluate(human.mask).efficiency
    for place in range(0, len(explained.beams), 9):
        flipped = human.mask.copy()
        flipped[explained.beams[place]] ^= True
        response = evaluator.evaluate(flipped)
        assert explained.status[place] == response.status
        if response.is_admissible:
            change = response.efficiency - explained.efficiency
            assert explained.exact[place] == pytest.approx(change, abs=1e-7)
        else:
            assert np.isnan(explained.exact[place])
    evaluator.evaluate(human.mask)
    assert np.array_equal(explained.low_rank, evaluator.predict_flips(human.mask).change)


def test_what_the_network_says_of_flips_is_what_it_predicts(explained, by_kind, human):
    model = by_kind["resnet18-w16"]
    flipped = human.mask.copy()
    flipped[explained.beams[7]] ^= True
    said = model.predict(np.packbits([human.mask, flipped], axis=1), device="cpu")
    assert explained.predicted == pytest.approx(said[0], abs=1e-5)
    assert explained.network[7] == pytest.approx(said[1] - said[0], abs=1e-5)


def test_correlations_agree_with_scipy(explained):
    told = explained.correlations()
    assert set(told) == {"low_rank", "network", "occlusion", "white", "black"}
    chosen = {"all": slice(None), "present": explained.present, "absent": ~explained.present}
    for name, values in explained.measures().items():
        for subset in SUBSETS:
            guess, truth = values[chosen[subset]], explained.exact[chosen[subset]]
            known = np.isfinite(guess) & np.isfinite(truth)
            found = told[name][subset]
            assert found.count == known.sum()
            assert found.pearson == pytest.approx(pearsonr(guess[known], truth[known])[0])
            assert found.spearman == pytest.approx(spearmanr(guess[known], truth[known])[0])


def test_recall_counts_the_best_flips_that_were_named():
    exact = np.arange(120.0)
    foreseen = exact.copy()
    foreseen[105:] = -1.0
    assert agreement(foreseen, exact).recall == 0.5
    # The best 30 of fewer than four times as many are found by guessing.
    assert np.isnan(agreement(exact[:119], exact[:119]).recall)
    assert np.isnan(agreement(exact[:1], exact[:1]).pearson)


def test_the_fitting_block_is_white_on_beams_and_black_beside_them(explained):
    seen, fitting = explained.occlusion, explained.measures()["occlusion"]
    assert np.array_equal(fitting[explained.present], seen.white_at[explained.present])
    assert np.array_equal(fitting[~explained.present], seen.black_at[~explained.present])


def test_an_explanation_is_plain_data(explained, by_kind, human):
    told = json.loads(json.dumps(explained.to_dict(), allow_nan=False))
    assert told["mask"] == human.mask_hex
    assert len(told["exact"]) == len(told["measures"]["network"]) == len(told["beams"]) == 203
    assert len(told["occlusion"]["white"]) == 12
    assert set(told["correlations"]["network"]["all"]) == {
        "pearson", "spearman", "recall", "count",
    }  # fmt: skip
    without = attribute(by_kind["mlp"], human, device="cpu").to_dict()
    assert without["occlusion"] is None
    assert "white" not in without["measures"]


def test_numbering_and_place_of_the_lattice_do_not_matter(explained, by_kind, crane, human):
    beams = crane.lattice.beam_count
    order = np.random.default_rng(2).permutation(beams)  # new beam i is old beam order[i]
    number = np.argsort(order)
    lattice = Lattice(crane.lattice.positions + SHIFT, crane.lattice.beams[order])
    other = replace(
        crane,
        lattice=lattice,
        initial=crane.initial[order],
        designable=np.sort(number[crane.designable]),
    )
    found = attribute(by_kind["resnet18-w16"], Design(other, human.mask[order]), device="cpu")
    there = np.searchsorted(explained.beams, order[found.beams])
    assert np.allclose(found.exact, explained.exact[there], atol=1e-7)
    assert np.allclose(found.network, explained.network[there], atol=1e-5)
    assert np.allclose(found.occlusion.black_at, explained.occlusion.black_at[there], atol=1e-5)
    assert np.allclose(found.occlusion.low, explained.occlusion.low + SHIFT)


def test_regions_are_fractions_of_the_function_that_is_there():
    change = np.array([-2.0, -1.0, -0.11, -0.09, 0.0, 0.11, np.nan])
    expected = ["vital", "vital", "useful", "neutral", "neutral", "adverse", "unstable"]
    assert [Region(each).label for each in regions_of(change, 2.0)] == expected
    assert np.array_equal(regions_of(-change, -2.0), regions_of(change, 2.0))


def test_a_design_that_does_nothing_has_regions_too():
    assert regions_of(np.array([0.0, 0.001, -0.1]), 0.0).tolist() == [
        Region.NEUTRAL, Region.NEUTRAL, Region.VITAL,
    ]  # fmt: skip


def test_overlap_of_regions_is_that_of_sets():
    first, second = np.array([0, 0, 1, 2]), np.array([0, 1, 1, 2])
    found = overlap_of_regions(first, second)
    assert (found["vital"], found["useful"], found["neutral"]) == (0.5, 0.5, 1.0)
    assert found["adverse"] is None


def test_a_design_without_a_response_cannot_be_explained(by_kind, crane, monkeypatch):
    real = SpringEvaluator.evaluate

    def snapping(self, mask, largest_increment=1.0, **options):
        found = real(self, mask, largest_increment, **options)
        return replace(found, status=Status.SNAPPED)

    monkeypatch.setattr(SpringEvaluator, "evaluate", snapping)
    with pytest.raises(InvalidSettings, match="'crane'"):
        attribute(by_kind["mlp"], crane.full_design(), device="cpu")


def test_another_problem_is_refused(by_kind):
    with pytest.raises(InvalidModel, match="'crane'"):
        attribute(by_kind["mlp"], find_problem("anti-parallel").full_design())


def test_changes_of_zero_can_be_drawn_and_nothing_is_cut_off(explained, tmp_path):
    draw_attribution(explained, tmp_path / "all.png")
    flat = np.zeros(len(explained.beams))
    still = replace(explained, exact=flat, network=flat, occlusion=None)
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


@pytest.mark.parametrize(
    ("largest", "least", "expected"),
    [
        (2.0, 0.02, [-1.0, -0.1, 0.0, 0.1, 1.0]),
        (1.0, 0.01, [-1.0, -0.1, -0.01, 0.0, 0.01, 0.1, 1.0]),
        (3e-4, 3e-6, [-1e-4, -1e-5, 0.0, 1e-5, 1e-4]),
    ],
)
def test_ticks_are_powers_of_ten_on_both_sides(largest, least, expected):
    assert symmetric_ticks(largest, least) == pytest.approx(expected)
