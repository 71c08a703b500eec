"""A slim residual network of 18 layers: what a processor without a GPU can train in an hour.

The layout is that of ResNet-18 (He et al. 2016, Table 1) with a quarter of its channels and
one of colour.

References
----------
K. He, X. Zhang, S. Ren, J. Sun, "Deep residual learning for image recognition", CVPR 2016.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from bellcrank.surrogate.models.reading import read_out
from bellcrank.surrogate.models.registry import Architecture, models

WIDTH = 16
BLOCKS = (2, 2, 2, 2)


class BasicBlock(nn.Module):
    """Two convolutions around which the input passes unchanged, or resampled to fit."""

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
        """Add what the block has to say to its input."""
        y = torch.relu(self.first_norm(self.first(x)))
        return torch.relu(self.second_norm(self.second(y)) + self.shortcut(x))


def stages(width: int, blocks: tuple[int, ...]) -> nn.Sequential:
    """Return residual stages, each after the first of half the size and twice the channels."""
    layers, inputs = [], width
    for stage, count in enumerate(blocks):
        outputs = width << stage
        for number in range(count):
            stride = 2 if stage and not number else 1
            layers.append(BasicBlock(inputs, outputs, stride))
            inputs = outputs
    return nn.Sequential(*layers)


class SlimResNet(nn.Module):
    """Residual network over pictures with one channel."""

    def __init__(self, _shape: tuple[int, ...]) -> None:
        super().__init__()
        self.stem = nn.Sequential(
            nn.Conv2d(1, WIDTH, 7, 2, padding=3, bias=False),
            nn.BatchNorm2d(WIDTH),
            nn.ReLU(),
            nn.MaxPool2d(3, 2, padding=1),
        )
        self.stages = stages(WIDTH, BLOCKS)
        self.head = nn.Linear(WIDTH << len(BLOCKS) - 1, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map (n, 1, height, width) to (n,)."""
        y: Tensor = self.stages(self.stem(x))
        return read_out(self.head, y.mean(dim=(2, 3)))


models.register("resnet18-w16")(
    Architecture("picture", SlimResNet, "slim residual network, 0.7 M parameters")
)
