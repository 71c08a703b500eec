"""What every registered network promises, and that the paper's is the one of Keras."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
import torch

from bellcrank.errors import UnknownName
from bellcrank.surrogate.models import ResNet50, models
from bellcrank.surrogate.trained_model import architecture_of
from bellcrank.surrogate.views import views

KERAS_WITHOUT_TOP = 23_587_712
"""Parameters of keras.applications.ResNet50(include_top=False), as its summary gives them."""
KERAS_TRAINABLE = 23_534_592
HEAD = 2048 + 1

if TYPE_CHECKING:
    from bellcrank.model import Problem


@pytest.fixture(params=list(models))
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def test_a_network_maps_a_batch_to_as_many_numbers_and_learns_from_them(
    name: str, problem: Problem
) -> None:
    architecture = models[name]
    view = views[architecture.view](problem)
    torch.manual_seed(0)
    network = architecture.build(view.shape)
    for parameter in network.parameters():
        assert parameter.dtype == torch.float32
    output = network.train()(torch.rand(3, *view.shape))
    assert output.shape == (3,)
    torch.mean((output - torch.tensor([1.0, -1.0, 0.5])) ** 2).backward()
    for parameter_name, parameter in network.named_parameters():
        assert parameter.grad is not None, parameter_name
        assert torch.isfinite(parameter.grad).all(), parameter_name
    moved = sum(float(each.grad.abs().sum()) > 0.0 for each in network.parameters())  # type: ignore[union-attr]
    assert moved > 0.9 * len(list(network.parameters())) - 1


def test_weights_loaded_into_another_instance_predict_the_same(name: str, problem: Problem) -> None:
    architecture = models[name]
    view = views[architecture.view](problem)
    one, other = architecture.build(view.shape), architecture.build(view.shape)
    inputs = torch.rand(2, *view.shape)
    one.train()(inputs)  # so that the running figures are not those of the start
    other.load_state_dict(one.state_dict())
    with torch.inference_mode():
        assert torch.equal(one.eval()(inputs), other.eval()(inputs))


def test_a_single_design_is_a_batch_too(name: str, problem: Problem) -> None:
    view = views[models[name].view](problem)
    network = models[name].build(view.shape).eval()
    inputs = torch.rand(3, *view.shape)
    with torch.inference_mode():
        whole = network(inputs)
        single = torch.cat([network(each[None]) for each in inputs])
    assert np.allclose(whole, single, atol=1e-5)


def test_the_paper_s_network_has_the_parameters_of_keras() -> None:
    network = ResNet50((1, 128, 192))
    trainable = sum(each.numel() for each in network.parameters())
    statistics = sum(
        each.numel() for name, each in network.named_buffers() if "num_batches" not in name
    )
    assert trainable == KERAS_TRAINABLE + HEAD
    assert trainable + statistics == KERAS_WITHOUT_TOP + HEAD
    norms = [each for each in network.modules() if isinstance(each, torch.nn.BatchNorm2d)]
    convolutions = [each for each in network.modules() if isinstance(each, torch.nn.Conv2d)]
    assert len(norms) == len(convolutions) == 53
    assert {(each.eps, each.momentum) for each in norms} == {(1.001e-5, 0.01)}
    assert all(each.bias is not None and not each.bias.any() for each in convolutions)
    strided = [each.kernel_size for each in convolutions if each.stride == (2, 2)]
    assert strided == [(7, 7)] + 6 * [(1, 1)]


def test_the_slim_network_is_small(problem: Problem) -> None:
    network = models["resnet18-w16"].build((1, 128, 192))
    size = sum(each.numel() * each.element_size() for each in network.state_dict().values())
    assert size < 3e6


def test_an_unknown_network_names_the_known_ones() -> None:
    with pytest.raises(UnknownName, match=r"unknown model 'vgg'; known: .*resnet50"):
        architecture_of("vgg")
