"""Inputs of networks: pictures of designs, or the bits of their masks.

A view turns packed masks into arrays of bytes with a scale, so that only bytes are transferred
to the device of the network.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from bellcrank.registry import Registry
from bellcrank.surrogate.pictures import Canvas, Renderer, check_masks

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.model import Problem


class View(Hashable, Protocol):
    """Input of a network."""

    shape: tuple[int, ...]
    """Shape of the input for one design."""
    scale: float
    """Factor from bytes to the values of the input."""

    def arrays(self, packed: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Turn packed masks (n, bytes) into arrays (n, *shape)."""

    def to_dict(self) -> dict[str, Any]:
        """Return the options of the view, in addition to the problem."""


views: Registry[Callable[..., View]] = Registry("view")


@views.register("picture")
class PictureView:
    """Black drawings on white, as in the paper."""

    scale = 1.0 / 255.0

    def __init__(self, problem: Problem, **canvas: Any) -> None:
        common = problem.initial.copy()
        common[problem.designable] = False
        self.renderer = Renderer(problem.lattice, Canvas(**canvas), common)
        self.shape = (1, self.renderer.canvas.height, self.renderer.canvas.width)

    def arrays(self, packed: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Draw the designs."""
        return self.renderer.render(packed)[:, None]

    def to_dict(self) -> dict[str, Any]:
        """Return the canvas."""
        return self.renderer.canvas.to_dict()


@views.register("bits")
class BitsView:
    """Bits of the mask."""

    scale = 1.0

    def __init__(self, problem: Problem) -> None:
        self.shape = (problem.lattice.beam_count,)

    def arrays(self, packed: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Unpack the bits."""
        return np.unpackbits(check_masks(packed, self.shape[0]), axis=1, count=self.shape[0])

    def to_dict(self) -> dict[str, Any]:
        """Return no options."""
        return {}
