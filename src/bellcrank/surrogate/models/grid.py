"""A residual network on the lattice itself: one cell a node, one channel a direction of beams.

Nothing is spent on white paper, and a convolution sees exactly the beams that meet.
"""

from __future__ import annotations

from torch import Tensor, nn

from bellcrank.surrogate.models.reading import read_out
from bellcrank.surrogate.models.registry import Architecture, models
from bellcrank.surrogate.models.resnet18 import BasicBlock

WIDTH = 64
BLOCKS = 6


class GridNet(nn.Module):
    """Residual blocks of one size, read out place by place."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        super().__init__()
        channels, rows, columns = shape
        self.stem = nn.Sequential(
            nn.Conv2d(channels, WIDTH, 3, padding=1, bias=False), nn.BatchNorm2d(WIDTH), nn.ReLU()
        )
        self.blocks = nn.Sequential(*(BasicBlock(WIDTH, WIDTH, 1) for _ in range(BLOCKS)))
        self.head = nn.Linear(WIDTH * rows * columns, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map (n, channels, rows, columns) to (n,)."""
        y: Tensor = self.blocks(self.stem(x))
        return read_out(self.head, y.flatten(1))


models.register("grid")(Architecture("grid", GridNet, "residual network on the lattice's own grid"))
