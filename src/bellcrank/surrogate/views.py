"""What a network looks at: pictures or bits.

A view turns packed masks into arrays of bytes, and says how bytes become numbers: training
moves bytes, and the numbers are made where the network is.
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
    """What all views can do."""

    shape: tuple[int, ...]
    """Of what the network gets for one design."""
    scale: float
    """A byte times this is what the network gets."""

    def look(self, packed: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Turn packed masks (n, bytes) into arrays (n, *shape)."""

    def to_dict(self) -> dict[str, Any]:
        """Return what is needed to see the same again, besides the problem."""


views: Registry[Callable[..., View]] = Registry("view")


@views.register("picture")
class PictureView:
    """Designs drawn in black on white, as in the paper."""

    scale = 1.0 / 255.0

    def __init__(self, problem: Problem, **canvas: Any) -> None:
        usual = problem.initial.copy()
        usual[problem.designable] = False
        self.renderer = Renderer(problem.lattice, Canvas(**canvas), usual)
        self.shape = (1, self.renderer.canvas.height, self.renderer.canvas.width)

    def look(self, packed: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Draw the designs."""
        return self.renderer.render(packed)[:, None]

    def to_dict(self) -> dict[str, Any]:
        """Return the canvas."""
        return self.renderer.canvas.to_dict()


@views.register("bits")
class BitsView:
    """The mask itself."""

    scale = 1.0

    def __init__(self, problem: Problem) -> None:
        self.shape = (problem.lattice.beam_count,)

    def look(self, packed: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Unpack the bits."""
        return np.unpackbits(check_masks(packed, self.shape[0]), axis=1, count=self.shape[0])

    def to_dict(self) -> dict[str, Any]:
        """Return nothing: there is no choice."""
        return {}
