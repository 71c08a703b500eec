"""The paper's network: ResNet50 with one linear output, by the conventions of Keras.

Those are of the first version of the network: the stride of a stage sits in the first 1 x 1
convolution of its first block, all convolutions have biases, and batch normalisation has
epsilon 1.001e-5 and keeps 0.99 of its running figures at each step. Weights start by Glorot's
uniform rule, biases at zero. The grey picture is fed to three equal channels.

References
----------
S. Bonfanti et al., Nat. Commun. 11, 4162 (2020), Methods; K. He et al., CVPR 2016;
keras.applications, ``ResNet50``.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from bellcrank.surrogate.models.reading import read_out
from bellcrank.surrogate.models.registry import Architecture, models

EPSILON = 1.001e-5
MOMENTUM = 0.01
STAGES = ((64, 3), (128, 4), (256, 6), (512, 3))
"""Channels inside the blocks of a stage, and how many there are."""
EXPANSION = 4


def convolve(inputs: int, outputs: int, size: int, stride: int = 1) -> nn.Sequential:
    """Return a convolution with bias, and its batch normalisation."""
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, size, stride, padding=size // 2),
        nn.BatchNorm2d(outputs, eps=EPSILON, momentum=MOMENTUM),
    )


class Bottleneck(nn.Module):
    """Convolutions of 1 x 1, 3 x 3 and 1 x 1 around which the input passes."""

    def __init__(self, inputs: int, channels: int, stride: int, *, projected: bool) -> None:
        super().__init__()
        outputs = EXPANSION * channels
        self.first = convolve(inputs, channels, 1, stride)
        self.second = convolve(channels, channels, 3)
        self.third = convolve(channels, outputs, 1)
        self.shortcut = convolve(inputs, outputs, 1, stride) if projected else nn.Identity()

    def forward(self, x: Tensor) -> Tensor:
        """Add what the block has to say to its input."""
        y = torch.relu(self.second(torch.relu(self.first(x))))
        return torch.relu(self.third(y) + self.shortcut(x))


class ResNet50(nn.Module):
    """The paper's network."""

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
        self.apply(_start_as_keras)

    def forward(self, x: Tensor) -> Tensor:
        """Map (n, 1, height, width) to (n,)."""
        y: Tensor = self.stages(self.stem(x.expand(-1, 3, -1, -1)))
        return read_out(self.head, y.mean(dim=(2, 3)))


def _start_as_keras(module: nn.Module) -> None:
    if isinstance(module, nn.Conv2d | nn.Linear):
        nn.init.xavier_uniform_(module.weight)
        if module.bias is not None:
            nn.init.zeros_(module.bias)


models.register("resnet50")(
    Architecture("picture", ResNet50, "the paper's network, 23.6 M parameters")
)
