"""From packed masks to what a network gets, wherever the network is.

On a processor the views of `bellcrank.surrogate.views` are made by compiled code and moved as
bytes. On a GPU nothing but masks is moved: pictures come from one matrix product there.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Protocol

import numpy as np
import torch

from bellcrank.surrogate.pictures import check_masks
from bellcrank.surrogate.views import PictureView

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from torch import Tensor

    from bellcrank.surrogate.views import View

DARKEST = 1.0 / 512.0
"""What a beam lets through at least, since nothing has no logarithm: half a grey level."""


class Feeder(Protocol):
    """Makes the inputs of a network."""

    def feed(self, packed: NDArray[np.uint8]) -> Tensor:
        """Turn packed masks (n, bytes) into a float batch (n, *shape) on the device."""


class HostFeeder:
    """Views made by the processor."""

    def __init__(self, view: View, device: torch.device) -> None:
        self.view = view
        self.device = device

    def feed(self, packed: NDArray[np.uint8]) -> Tensor:
        """Make the views and move them, as bytes."""
        inputs = torch.from_numpy(self.view.look(packed)).to(self.device).float()
        return _channels_last(inputs.mul_(self.view.scale))


class PictureFeeder:
    """Pictures made where the network is: ``1 - exp(bits @ log(1 - coverage))``."""

    def __init__(self, view: PictureView, device: torch.device) -> None:
        self.shape = view.shape
        coverage = torch.from_numpy(view.renderer.coverage()).to(device)
        self.passed = torch.log((1.0 - coverage).clamp_min_(DARKEST))
        self.place = torch.arange(7, -1, -1, device=device, dtype=torch.uint8)
        self.device = device

    def feed(self, packed: NDArray[np.uint8]) -> Tensor:
        """Move the masks, and draw them there, always in float32."""
        checked = check_masks(packed, len(self.passed))
        masks = torch.from_numpy(np.ascontiguousarray(checked)).to(self.device)
        bits = (masks[:, :, None] >> self.place) & 1
        chosen = bits.flatten(1)[:, : len(self.passed)].float()
        # Whoever feeds a network may be in the middle of autocast: in bfloat16 sums of many
        # logarithms would be off by several grey levels.
        with torch.autocast(self.device.type, enabled=False):
            ink = 1.0 - torch.exp(chosen @ self.passed)
        return _channels_last(ink.reshape(-1, *self.shape))


@lru_cache(maxsize=16)
def feeder_of(view: View, device: torch.device) -> Feeder:
    """Return what is fast on a device; the same one for the same view, since it may be large."""
    if device.type != "cpu" and isinstance(view, PictureView):
        return PictureFeeder(view, device)
    return HostFeeder(view, device)


def _channels_last(inputs: Tensor) -> Tensor:
    if inputs.dim() == 4:
        return inputs.contiguous(memory_format=torch.channels_last)
    return inputs
