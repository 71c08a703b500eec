"""The registry of networks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable

    from torch import nn


@dataclass(frozen=True, slots=True)
class Architecture:
    """A kind of network.

    Parameters
    ----------
    view
        Name in the registry of views: what the network looks at.
    build
        Function from the shape of one input, without the batch, to a freshly initialised
        network that maps a float batch (n, *shape) to (n,) standardised efficiencies.
    about
        What it is, in a few words.
    """

    view: str
    build: Callable[[tuple[int, ...]], nn.Module]
    about: str


models: Registry[Architecture] = Registry("model")
