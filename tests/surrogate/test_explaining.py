from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import pearsonr, spearmanr

from bellcrank.errors import InvalidDataset, InvalidModel, InvalidProblem, InvalidSettings
from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import Design, Lattice, find_problem, human_design
from bellcrank.surrogate.agreement import agreement, rank_correlation
from bellcrank.surrogate.dataset import Dataset
from bellcrank.surrogate.explaining import SUBSETS, explain
from bellcrank.surrogate.flips import (
    compare_flips,
    flip_accuracy,
    flip_effects,
    held_out_designs,
    screening_accuracy,
)
from bellcrank.surrogate.models import models
from bellcrank.surrogate.occlusion import BLACK, WHITE, Block, occlude, sample_map
from bellcrank.surrogate.regions import Region, Thresholds, overlap_of_regions, regions_of
from bellcrank.surrogate.relaxing import relaxations, value_and_gradient
from bellcrank.surrogate.trained import TrainedModel
from bellcrank.surrogate.views import views

torch = pytest.importorskip("torch")

CANVAS = {"width": 72, "height": 48, "line": 1.5}
SHIFT = np.array([3.0, -2.0])
KINDS = ("mlp", "grid", "resnet18-w16")


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
    return TrainedModel(kind, problem, view, 0.3, 2.0, network=network.eval())


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
    return explain(by_kind["resnet18-w16"], human, device="cpu")


@pytest.mark.parametrize("kind", KINDS)
def test_the_gradient_is_that_of_finite_differences(crane, kind):
    model = random_model(crane, kind)
    model.network.double()
    rng = np.random.default_rng(5)
    presence = rng.uniform(0.1, 0.9, crane.lattice.beam_count)
    _, gradient = value_and_gradient(model, presence, device="cpu")
    step = 1e-6
    for beam in rng.choice(crane.designable, 8, replace=False):
        ends = []
        for sign in (1.0, -1.0):
            moved = presence.copy()
            moved[beam] += sign * step
            ends.append(value_and_gradient(model, moved, device="cpu")[0])
        slope = (ends[0] - ends[1]) / (2.0 * step)
        # Differences of values of order 1 in float64 leave 1e-16 / 1e-6; a kink of a rectifier
        # between the two ends is as unlikely as the step is small.
        assert gradient[beam] == pytest.approx(slope, rel=1e-4, abs=1e-7)


@pytest.mark.parametrize("kind", KINDS)
def test_the_gradient_at_a_design_is_one_sided_and_starts_at_its_prediction(by_kind, human, kind):
    model = by_kind[kind]
    value, _ = value_and_gradient(model, human.mask, device="cpu")
    said = model.predict(np.packbits(human.mask)[None], device="cpu")[0]
    # Pictures of designs are rounded to 256 greys, those of parts of beams are not.
    assert value == pytest.approx(said, abs=0.03 if kind == "resnet18-w16" else 1e-4)


def test_a_relaxed_picture_of_a_design_is_its_picture(by_kind, human):
    view = by_kind["resnet18-w16"].view
    relaxed = relaxations["picture"](view).see(human.mask.astype(np.float64))
    drawn = view.look(np.packbits(human.mask)[None])[0] * view.scale
    assert np.abs(relaxed - drawn).max() < 0.51 / 255 + 1e-5


def test_a_pixel_that_one_beam_covers_shows_what_lies_below_when_that_beam_goes(by_kind):
    relaxed = relaxations["picture"](by_kind["resnet18-w16"].view)
    relaxed.beam = np.array([0, 1, 2, 0])
    relaxed.pixel = np.array([0, 0, 1, 1])
    relaxed.coverage = np.array([1.0, 0.25, 1.0, 1.0])
    relaxed.beams = 3
    slope = np.ones(relaxed.shape)
    found = relaxed.trace_back(np.ones(3), slope)
    # Pixel 0: beam 0 covers all, beam 1 a quarter; pixel 1: two beams cover all of it.
    assert found.tolist() == [0.75, 0.0, 0.0]


@pytest.mark.parametrize("wrong", [np.full(352, 1.5), np.full(352, np.nan), np.zeros(10)])
def test_presence_is_a_number_from_0_to_1_for_each_beam(by_kind, wrong):
    with pytest.raises(InvalidSettings, match="expected 352 numbers from 0 to 1"):
        value_and_gradient(by_kind["mlp"], wrong)


def test_a_white_block_on_white_paper_changes_nothing(by_kind, crane):
    model = by_kind["resnet18-w16"]
    mask = crane.initial.copy()
    mask[crane.designable] = False
    block = Block(size=6, stride=3)
    found = occlude(model, np.packbits(mask), block, ink=WHITE, device="cpu")
    picture = model.view.look(np.packbits(mask)[None])[0, 0]
    rows, columns = block.middles(48), block.middles(72)
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
    picture = model.view.look(packed[None]).astype(np.float32) / 255.0

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
    x, y = np.meshgrid(block.middles(16), 12 - block.middles(12))
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
    for kind in ("mlp", "grid"):
        with pytest.raises(InvalidSettings, match="blocks can hide parts of pictures only"):
            occlude(by_kind[kind], np.packbits(human.mask))
        with pytest.raises(InvalidSettings, match=r"looks at (bits|grid)"):
            explain(by_kind[kind], human, Block())


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
    assert np.array_equal(explained.screened, evaluator.predict_flips(human.mask).change)


def test_what_the_network_says_of_flips_is_what_it_predicts(explained, by_kind, human):
    model = by_kind["resnet18-w16"]
    flipped = human.mask.copy()
    flipped[explained.beams[7]] ^= True
    said = model.predict(np.packbits([human.mask, flipped], axis=1), device="cpu")
    assert explained.predicted == pytest.approx(said[0], abs=1e-5)
    assert explained.network[7] == pytest.approx(said[1] - said[0], abs=1e-5)


def test_correlations_agree_with_scipy(explained):
    told = explained.correlations()
    assert set(told) == {"screening", "network", "gradient", "occlusion", "white", "black"}
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


def test_ranks_of_equals_are_shared():
    rng = np.random.default_rng(1)
    first, second = rng.integers(0, 5, (2, 60)).astype(float)
    assert rank_correlation(first, second) == pytest.approx(spearmanr(first, second)[0])


def test_the_fitting_block_is_white_on_beams_and_black_beside_them(explained):
    seen, fitting = explained.occlusion, explained.measures()["occlusion"]
    assert np.array_equal(fitting[explained.present], seen.white_at[explained.present])
    assert np.array_equal(fitting[~explained.present], seen.black_at[~explained.present])


def test_flips_of_present_beams_go_against_the_gradient(explained):
    assert np.array_equal(
        explained.slope[explained.present], -explained.gradient[explained.present]
    )
    assert np.array_equal(
        explained.slope[~explained.present], explained.gradient[~explained.present]
    )


def test_an_explanation_is_plain_data(explained, by_kind, human):
    told = json.loads(json.dumps(explained.to_dict(), allow_nan=False))
    assert told["mask"] == human.mask_hex
    assert len(told["exact"]) == len(told["gradient"]) == len(told["beams"]) == 203
    assert len(told["occlusion"]["white"]) == 12
    assert set(told["correlations"]["network"]["all"]) == {
        "pearson", "spearman", "recall", "count",
    }  # fmt: skip
    without = explain(by_kind["mlp"], human, device="cpu").to_dict()
    assert without["occlusion"] is None
    assert "white" not in without["foreseen"]


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
    found = explain(by_kind["resnet18-w16"], Design(other, human.mask[order]), device="cpu")
    there = np.searchsorted(explained.beams, order[found.beams])
    assert np.allclose(found.exact, explained.exact[there], atol=1e-7)
    assert np.allclose(found.network, explained.network[there], atol=1e-5)
    assert np.allclose(found.gradient, explained.gradient[there], atol=1e-5)
    assert np.allclose(found.occlusion.black_at, explained.occlusion.black_at[there], atol=1e-5)
    assert np.allclose(found.occlusion.low, explained.occlusion.low + SHIFT)


def test_regions_are_fractions_of_the_function_that_is_there():
    change = np.array([-2.0, -1.0, -0.11, -0.09, 0.0, 0.11, np.nan])
    expected = ["vital", "vital", "useful", "neutral", "neutral", "adverse", "unstable"]
    assert [Region(each).label for each in regions_of(change, 2.0)] == expected
    assert np.array_equal(regions_of(-change, -2.0), regions_of(change, 2.0))
    strict = regions_of(change, 2.0, Thresholds(vital=0.9, neutral=0.001))
    assert [Region(each).label for each in strict[:4]] == ["vital", "useful", "useful", "useful"]


def test_a_design_that_does_nothing_has_regions_too():
    assert regions_of(np.array([0.0, 0.001, -0.1]), 0.0).tolist() == [
        Region.NEUTRAL, Region.NEUTRAL, Region.VITAL,
    ]  # fmt: skip


def test_thresholds_are_in_order():
    with pytest.raises(InvalidSettings, match="0 < neutral < vital"):
        Thresholds(vital=0.1, neutral=0.2)
    with pytest.raises(InvalidSettings, match="least"):
        Thresholds(least=0.0)


def test_overlap_of_regions_is_that_of_sets():
    first, second = np.array([0, 0, 1, 2]), np.array([0, 1, 1, 2])
    found = overlap_of_regions(first, second)
    assert (found["vital"], found["useful"], found["neutral"]) == (0.5, 0.5, 1.0)
    assert found["adverse"] is None


def test_flips_of_several_designs_are_judged_one_by_one(by_kind, crane, human):
    masks = np.array([crane.initial, human.mask])
    effects = flip_effects(crane, masks)
    found = flip_accuracy(by_kind["mlp"], crane, masks, effects)
    alone = flip_accuracy(by_kind["mlp"], crane, masks[1:])
    assert found.designs == 2
    assert found.spearman[1] == pytest.approx(alone.spearman[0])
    told = found.to_dict()
    assert told["pearson"]["mean"] == pytest.approx(np.mean(found.pearson))
    assert told["pearson"]["spread"] == pytest.approx(np.std(found.pearson, ddof=1))
    screening = screening_accuracy(effects)
    assert screening.spearman.min() > 0.95
    assert screening.recall.min() > 0.9


def test_a_perfect_forecast_is_told_so(crane):
    effects = flip_effects(crane, crane.initial[None])
    found = compare_flips(effects.exact, effects.exact)
    assert found.pearson[0] == found.spearman[0] == pytest.approx(1.0)
    assert found.recall[0] == 1.0
    assert found.flips == 203


def test_masks_must_fit_the_problem(crane):
    with pytest.raises(InvalidProblem, match=r"expected shape \(designs, 352\)"):
        flip_effects(crane, np.ones((2, 351), bool))


def test_a_design_without_a_response_cannot_be_explained(by_kind, crane, monkeypatch):
    real = SpringEvaluator.respond

    def snapping(self, mask, largest_increment=1.0):
        return replace(real(self, mask, largest_increment), status=Status.SNAPPED)

    monkeypatch.setattr(SpringEvaluator, "respond", snapping)
    with pytest.raises(InvalidSettings, match="design 0 of 'crane' has no efficiency"):
        explain(by_kind["mlp"], crane.full_design())


def test_another_problem_is_refused(by_kind):
    with pytest.raises(InvalidModel, match="the model has learnt 'crane'"):
        explain(by_kind["mlp"], find_problem("anti-parallel").full_design())


def test_held_out_designs_are_accepted_and_of_as_many_runs_as_there_are(crane):
    rng = np.random.default_rng(0)
    masks = np.repeat(crane.initial[None], 40, axis=0)
    masks[:, crane.designable[:40]] ^= np.eye(40, dtype=bool)
    run = np.repeat(np.arange(4), 10)
    accepted = np.arange(40) % 2 == 0
    data = Dataset(crane, np.packbits(masks, axis=1), np.zeros(40), run, accepted=accepted)
    rows = np.arange(10, 40)
    drawn = held_out_designs(data, rows, 3, rng)
    which = [int(np.flatnonzero((masks == mask).all(axis=1))[0]) for mask in drawn]
    assert sorted(run[which]) == [1, 2, 3]
    assert accepted[which].all()
    assert len(held_out_designs(data, rows, 99, rng)) == 15
    with pytest.raises(InvalidDataset, match="no accepted design"):
        held_out_designs(data, rows[~accepted[rows]], 3, rng)
