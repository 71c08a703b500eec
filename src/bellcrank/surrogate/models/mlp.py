"""A perceptron on the bits of a mask: the baseline that knows nothing of the plane."""

from __future__ import annotations

from torch import Tensor, nn

from bellcrank.surrogate.models.reading import read_out
from bellcrank.surrogate.models.registry import Architecture, models

WIDTHS = (512, 512, 256)


class Perceptron(nn.Module):
    """Dense layers."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        inputs = shape[0]
        for outputs in WIDTHS:
            layers += [nn.Linear(inputs, outputs), nn.BatchNorm1d(outputs), nn.ReLU()]
            inputs = outputs
        self.layers = nn.Sequential(*layers)
        self.head = nn.Linear(inputs, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map (n, beams) to (n,)."""
        return read_out(self.head, self.layers(2.0 * x - 1.0))


models.register("mlp")(Architecture("bits", Perceptron, "perceptron on the bits of a mask"))
