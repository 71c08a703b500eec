"""What training makes small."""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch

if TYPE_CHECKING:
    from torch import Tensor

LEAST_DIFFERENCE = 0.02
"""In standard deviations: differences smaller than this need not be told apart."""


def loss_of(output: Tensor, target: Tensor, differences: float = 0.0) -> Tensor:
    """Return the mean squared error, and with a weight that of differences within pairs.

    A search asks which of two similar designs is better. The error of a difference is therefore
    measured against the difference itself: to tell a gain of 0.01 from a loss of 0.01 counts as
    much as to tell 1 from -1.

    Parameters
    ----------
    output, target : (n,)
        Predicted and actual, in standard deviations; with a weight, pairs one after the other.
    differences
        The weight.

    Examples
    --------
    >>> target = torch.tensor([1.0, 1.5])
    >>> round(float(loss_of(target + 0.5, target)), 4)
    0.25
    >>> round(float(loss_of(target + 0.5, target, differences=1.0)), 4)
    0.25
    >>> round(float(loss_of(torch.tensor([1.25, 1.25]), target, differences=1.0)), 2)
    1.06
    """
    squared = torch.mean((output - target) ** 2)
    if not differences:
        return squared
    said = output[0::2] - output[1::2]
    true = target[0::2] - target[1::2]
    return squared + differences * torch.mean((said - true) ** 2 / (LEAST_DIFFERENCE**2 + true**2))
