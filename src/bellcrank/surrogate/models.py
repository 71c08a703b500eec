"""Network architectures: the paper's ResNet50, a slim ResNet-18 and a perceptron.

Each maps a float batch (n, *shape) of its view to (n,) standardised efficiencies.

References
----------
S. Bonfanti et al., Nat. Commun. 11, 4162 (2020), Methods; K. He, X. Zhang, S. Ren, J. Sun,
"Deep residual learning for image recognition", CVPR 2016; keras.applications, ``ResNet50``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import torch
from torch import Tensor, nn

from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable

PERCEPTRON_WIDTHS = (512, 512, 256)
SLIM_WIDTH = 16
SLIM_BLOCKS = (2, 2, 2, 2)
KERAS_EPSILON = 1.001e-5
KERAS_MOMENTUM = 0.01
STAGES = ((64, 3), (128, 4), (256, 6), (512, 3))
"""Channels inside the blocks of each stage of ResNet50, and number of blocks."""
EXPANSION = 4


@dataclass(frozen=True, slots=True)
class Architecture:
    """A network architecture.

    Parameters
    ----------
    view
        Name of its input in the registry of views.
    build
        Function from the shape of one input, without the batch, to a network with initial
        weights.
    """

    view: str
    build: Callable[[tuple[int, ...]], nn.Module]


models: Registry[Architecture] = Registry("model")


def read_out(head: nn.Linear, features: Tensor) -> Tensor:
    """Map features (n, k) to (n,) in the precision of the weights, without autocast.

    A flip changes an efficiency by a few thousandths of its standard deviation, which bfloat16
    cannot resolve near 1.
    """
    with torch.autocast(features.device.type, enabled=False):
        output: Tensor = head(features.to(head.weight.dtype))
    return output.squeeze(1)


class Perceptron(nn.Module):
    """Dense layers on the bits of a mask."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        inputs = shape[0]
        for outputs in PERCEPTRON_WIDTHS:
            layers += [nn.Linear(inputs, outputs), nn.BatchNorm1d(outputs), nn.ReLU()]
            inputs = outputs
        self.layers = nn.Sequential(*layers)
        self.head = nn.Linear(inputs, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map (n, beams) to (n,)."""
        return read_out(self.head, self.layers(2.0 * x - 1.0))


class BasicBlock(nn.Module):
    """Two convolutions with a shortcut, projected where the size changes."""

    def __init__(self, inputs: int, outputs: int, stride: int) -> None:
        super().__init__()
        self.first = nn.Conv2d(inputs, outputs, 3, stride, padding=1, bias=False)
        self.first_norm = nn.BatchNorm2d(outputs)
        self.second = nn.Conv2d(outputs, outputs, 3, padding=1, bias=False)
        self.second_norm = nn.BatchNorm2d(outputs)
        self.shortcut: nn.Module = nn.Identity()
        if stride != 1 or inputs != outputs:
            self.shortcut = nn.Sequential(
                nn.Conv2d(inputs, outputs, 1, stride, bias=False), nn.BatchNorm2d(outputs)
            )

    def forward(self, x: Tensor) -> Tensor:
        """Add the residual to the input."""
        y = torch.relu(self.first_norm(self.first(x)))
        return torch.relu(self.second_norm(self.second(y)) + self.shortcut(x))


class SlimResNet(nn.Module):
    """ResNet-18 (He et al. 2016, Table 1) with a quarter of its channels and one input channel.

    It can be trained on a processor in an hour.
    """

    def __init__(self, _shape: tuple[int, ...]) -> None:
        super().__init__()
        self.stem = nn.Sequential(
            nn.Conv2d(1, SLIM_WIDTH, 7, 2, padding=3, bias=False),
            nn.BatchNorm2d(SLIM_WIDTH),
            nn.ReLU(),
            nn.MaxPool2d(3, 2, padding=1),
        )
        layers, inputs = [], SLIM_WIDTH
        for stage, count in enumerate(SLIM_BLOCKS):
            for number in range(count):
                stride = 2 if stage and not number else 1
                layers.append(BasicBlock(inputs, SLIM_WIDTH << stage, stride))
                inputs = SLIM_WIDTH << stage
        self.stages = nn.Sequential(*layers)
        self.head = nn.Linear(inputs, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map (n, 1, height, width) to (n,)."""
        y: Tensor = self.stages(self.stem(x))
        return read_out(self.head, y.mean(dim=(2, 3)))


def convolve(inputs: int, outputs: int, size: int, stride: int = 1) -> nn.Sequential:
    """Return a convolution with bias and batch normalisation, as in Keras."""
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, size, stride, padding=size // 2),
        nn.BatchNorm2d(outputs, eps=KERAS_EPSILON, momentum=KERAS_MOMENTUM),
    )


class Bottleneck(nn.Module):
    """Convolutions of 1 x 1, 3 x 3 and 1 x 1 with a shortcut."""

    def __init__(self, inputs: int, channels: int, stride: int, *, projected: bool) -> None:
        super().__init__()
        outputs = EXPANSION * channels
        self.first = convolve(inputs, channels, 1, stride)
        self.second = convolve(channels, channels, 3)
        self.third = convolve(channels, outputs, 1)
        self.shortcut = convolve(inputs, outputs, 1, stride) if projected else nn.Identity()

    def forward(self, x: Tensor) -> Tensor:
        """Add the residual to the input."""
        y = torch.relu(self.second(torch.relu(self.first(x))))
        return torch.relu(self.third(y) + self.shortcut(x))


class ResNet50(nn.Module):
    """The paper's network: ResNet50 with one linear output, by the conventions of Keras.

    The stride of a stage is in the first 1 x 1 convolution of its first block, all convolutions
    have biases, and batch normalisation has epsilon 1.001e-5 and momentum 0.99. Initial weights
    follow Glorot's uniform rule, biases are zero. The grey picture is the input of three equal
    channels.
    """

    def __init__(self, _shape: tuple[int, ...]) -> None:
        super().__init__()
        self.stem = nn.Sequential(convolve(3, 64, 7, 2), nn.ReLU(), nn.MaxPool2d(3, 2, padding=1))
        layers, inputs = [], 64
        for stage, (channels, count) in enumerate(STAGES):
            for number in range(count):
                stride = 2 if stage and not number else 1
                layers.append(Bottleneck(inputs, channels, stride, projected=not number))
                inputs = EXPANSION * channels
        self.stages = nn.Sequential(*layers)
        self.head = nn.Linear(inputs, 1)
        self.apply(_initialise_as_keras)

    def forward(self, x: Tensor) -> Tensor:
        """Map (n, 1, height, width) to (n,)."""
        y: Tensor = self.stages(self.stem(x.expand(-1, 3, -1, -1)))
        return read_out(self.head, y.mean(dim=(2, 3)))


def _initialise_as_keras(module: nn.Module) -> None:
    if isinstance(module, nn.Conv2d | nn.Linear):
        nn.init.xavier_uniform_(module.weight)
        if module.bias is not None:
            nn.init.zeros_(module.bias)


models.register("mlp")(Architecture("bits", Perceptron))
models.register("resnet18-w16")(Architecture("picture", SlimResNet))
models.register("resnet50")(Architecture("picture", ResNet50))
