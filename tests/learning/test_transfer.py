from __future__ import annotations

import numpy as np
import pytest

from bellcrank.errors import InvalidDataset, InvalidModel, InvalidSettings
from bellcrank.learning.transfer import TransferSettings, carry_over, try_transfer
from bellcrank.model import find_problem
from bellcrank.surrogate.dataset import Dataset
from bellcrank.surrogate.models import models
from bellcrank.surrogate.recipes import Recipe
from bellcrank.surrogate.trained import TrainedModel
from bellcrank.surrogate.views import views

torch = pytest.importorskip("torch")

RECIPE = Recipe(
    model="resnet18-w16", epochs=1, batch=16, epoch_size=48, resampling=False, precision="float32"
)


def ignorant(kind, **canvas):
    small = find_problem("scaling-8")
    view = views[models[kind].view](small, **canvas)
    torch.manual_seed(0)
    network = models[kind].build(view.shape).eval()
    return TrainedModel(kind, small, view, 0.0, 1.0, network=network)


@pytest.fixture(scope="module")
def source():
    return ignorant("resnet18-w16", width=48, height=32, line=1.0, margin=1.0)


@pytest.fixture(scope="module")
def data():
    large = find_problem("scaling-9")
    rng = np.random.default_rng(0)
    masks = np.repeat(large.initial[None], 96, axis=0)
    masks[:, large.designable] = rng.random((96, len(large.designable))) < 0.9
    lacking = masks.sum(axis=1) / 100.0
    return Dataset(large, np.packbits(masks, axis=1), lacking, np.repeat(np.arange(8), 12))


@pytest.mark.parametrize("small", ["scaling-8", "scaling-12"])
def test_a_canvas_to_scale_has_as_many_pixels_to_a_beam(small):
    known, other = find_problem(small), find_problem("scaling-10")
    view = views["picture"](known)
    network = models["resnet18-w16"].build(view.shape)
    model = TrainedModel("resnet18-w16", known, view, 0.0, 1.0, network=network)

    def pixels(view, problem):
        placed = view.renderer.canvas.place(problem.lattice.positions)
        ends = placed[problem.lattice.beams]
        return np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))

    there = pixels(view, known)
    assert pixels(carry_over(model, other, "scale").view, other) == pytest.approx(there, rel=0.02)
    canvas = carry_over(model, other, "canvas").view
    assert canvas.shape == view.shape
    assert abs(pixels(canvas, other) / there - 1.0) > 0.1


def test_the_weights_are_the_same(source):
    carried = carry_over(source, find_problem("scaling-9"), "scale")
    for name, value in source.network.state_dict().items():
        assert torch.equal(value, carried.network.state_dict()[name])


def test_every_trial_is_made_in_both_ways(source, data):
    settings = TransferSettings(few=(48,), recipe=RECIPE, flips=1)
    before = {name: value.clone() for name, value in source.network.state_dict().items()}
    trials = list(try_transfer(source, data, settings, device="cpu"))
    assert [(each.fit, each.how, each.designs) for each in trials] == [
        (fit, how, count)
        for fit in ("canvas", "scale")
        for how, count in (("as it is", 0), ("going on", 48), ("afresh", 48))
    ]
    told = [each.to_dict() for each in trials]
    assert all(each["count"] == 24 and each["flips"]["designs"] == 1 for each in told)
    assert len({each["rms_error"] for each in told}) == 6
    for name, value in source.network.state_dict().items():
        assert torch.equal(value, before[name])


def test_what_cannot_be_carried_over_is_refused(source, data):
    other = find_problem("scaling-9")
    with pytest.raises(InvalidSettings, match="pictures only"):
        carry_over(ignorant("mlp"), other)
    with pytest.raises(InvalidSettings, match="expected one of canvas, scale"):
        carry_over(source, other, "stretched")
    with pytest.raises(InvalidSettings, match="'stretched'"):
        TransferSettings(fits=("stretched",))
    with pytest.raises(InvalidSettings, match="at least a batch"):
        TransferSettings(few=(8,), recipe=RECIPE)
    with pytest.raises(InvalidDataset, match="1000 designs are wanted"):
        next(try_transfer(source, data, TransferSettings(few=(1000,), recipe=RECIPE)))


def test_weights_that_depend_on_the_size_of_pictures_are_refused(monkeypatch):
    from bellcrank.surrogate.models import Architecture
    from bellcrank.surrogate.models.grid import GridNet

    monkeypatch.setitem(models._entries, "flat", Architecture("picture", GridNet, ""))
    model = ignorant("flat", width=32, height=24, line=1.0, margin=1.0)
    with pytest.raises(InvalidModel, match="depend on the size"):
        carry_over(model, find_problem("scaling-9"), "scale")
