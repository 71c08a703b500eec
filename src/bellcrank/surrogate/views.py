"""What a network looks at: pictures, bits, or the lattice as a grid of cells.

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


BASIS = np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])
"""Steps from one node of a triangular lattice to the next."""
DIRECTIONS = 3
"""In each of which a node of a triangular lattice starts one beam."""


@views.register("grid")
class GridView:
    """The lattice in its own coordinates: a cell a node, a channel a direction of beams.

    Exact on triangular lattices, where beams to the right and up from a node are in its cell,
    and those to the upper left in the cell before. On others, beams go to the cell of their
    middle and the nearest direction, and to further channels where two would share one.
    """

    scale = 1.0

    def __init__(self, problem: Problem) -> None:
        lattice = problem.lattice
        ends = lattice.positions[lattice.beams]
        along = ends[:, 1] - ends[:, 0]
        step = float(np.median(np.linalg.norm(along, axis=1)))
        start = lattice.positions[0]  # a node: beams that start in one share their cell
        middle = (ends.mean(axis=1) - start) / step @ np.linalg.inv(BASIS)
        cell = np.floor(middle + 1e-3).astype(np.int64)
        cell -= cell.min(axis=0)
        angle = np.arctan2(along[:, 1], along[:, 0])
        channel = np.round(angle * DIRECTIONS / np.pi).astype(np.int64) % DIRECTIONS
        columns, rows = cell.max(axis=0) + 1
        place = (channel * rows + cell[:, 1]) * columns + cell[:, 0]
        layer = _rank_among_equals(place)
        self.place = layer * (DIRECTIONS * rows * columns) + place
        channels = int(layer.max() + 1) * DIRECTIONS
        self.shape = (channels, int(rows), int(columns))

    def look(self, packed: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Put each bit into its cell."""
        cells = np.zeros((len(packed), int(np.prod(self.shape))), np.uint8)
        beams = len(self.place)
        cells[:, self.place] = np.unpackbits(check_masks(packed, beams), axis=1, count=beams)
        return cells.reshape(len(packed), *self.shape)

    def to_dict(self) -> dict[str, Any]:
        """Return nothing: there is no choice."""
        return {}


def _rank_among_equals(values: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return how many equal values come before each."""
    order = np.argsort(values, kind="stable")
    ordered = values[order]
    first = np.searchsorted(ordered, ordered)
    rank = np.empty(len(values), np.int64)
    rank[order] = np.arange(len(values)) - first
    return rank
