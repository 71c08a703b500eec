"""Pictures of designs as input of networks.

Each beam is drawn once, alone, by matplotlib's Agg renderer without snapping to pixels. The
picture of a design is the product of the transmissions of its beams,

    ink = 1 - prod over present beams (1 - coverage),

which is exact where beams do not overlap, and within a few grey levels where their ends do: a
sparse product of a few thousand terms for each picture.

Examples
--------
>>> from bellcrank.model import find_problem
>>> crane = find_problem("crane")
>>> renderer = Renderer(crane.lattice)
>>> pictures = renderer.render(np.packbits(crane.initial)[None])
>>> pictures.shape, int(pictures.max())
((1, 128, 192), 255)
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidDataset, InvalidSettings

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Lattice
    from bellcrank.surrogate.kernels.rendering import Strokes

DOTS_PER_INCH = 72.0
"""Resolution at which a point is a pixel."""
SMALLEST, LARGEST = 8, 4096
"""Smallest and largest side of a canvas in pixels."""


@dataclass(frozen=True, slots=True)
class Canvas:
    """Size of pictures and width of lines.

    Parameters
    ----------
    width, height
        In pixels; 192 x 128 in the paper.
    line
        Line width of a beam in pixels.
    margin
        Distance of the outermost lines from the border in pixels.

    Raises
    ------
    InvalidSettings
    """

    width: int = 192
    height: int = 128
    line: float = 2.0
    margin: float = 2.0

    def __post_init__(self) -> None:
        sides = (self.width, self.height)
        if not all(isinstance(side, int) and SMALLEST <= side <= LARGEST for side in sides):
            raise InvalidSettings(
                f"canvas: expected whole numbers of {SMALLEST} to {LARGEST} pixels, got "
                f"{self.width} x {self.height}"
            )
        if not (self.line > 0.0 and self.margin >= 0.0):
            raise InvalidSettings(
                f"canvas: expected line > 0 and margin >= 0, got {self.line} and {self.margin}"
            )
        if not self.border < min(sides):
            raise InvalidSettings(
                f"canvas: a line of {self.line} and margins of {self.margin} leave no space on "
                f"{self.width} x {self.height} pixels"
            )

    @property
    def border(self) -> float:
        """Pixels between nodes and two opposite sides, both together."""
        return 2.0 * self.margin + self.line

    def to_dict(self) -> dict[str, Any]:
        """Return the canvas as plain data."""
        return asdict(self)

    def pixels_of(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return pixel coordinates of nodes from the lower left corner, centred and scaled to fit.

        Parameters
        ----------
        positions : (N, 2)
        """
        low, high = positions.min(axis=0), positions.max(axis=0)
        size = np.array([self.width, self.height], dtype=np.float64)
        extent = np.maximum(high - low, 1e-9)
        scale = float(((size - self.border) / extent).min())
        return np.asarray((positions - 0.5 * (low + high)) * scale + 0.5 * size)


class Renderer:
    """Draws designs on one lattice.

    Parameters
    ----------
    lattice
        The lattice, at rest.
    canvas
        Size of the pictures.
    common : (M,) bool
        Beams that most designs have. They are multiplied first, and at once in a design that has
        them all, which does not change a bit. Another order of multiplication changes results by
        at most one grey level.
    """

    __slots__ = ("background", "canvas", "strokes")

    def __init__(
        self,
        lattice: Lattice,
        canvas: Canvas | None = None,
        common: NDArray[np.bool_] | None = None,
    ) -> None:
        from bellcrank.surrogate.kernels.rendering import Background, draw_beams

        self.canvas = canvas or Canvas()
        self.strokes = _draw_each_beam(lattice, self.canvas)
        shared = np.zeros(lattice.beam_count, np.bool_) if common is None else common
        packed = np.packbits(shared)
        passed = np.ones(self.canvas.width * self.canvas.height, np.float32)
        draw_beams(self.strokes, packed, passed)
        self.background = Background(packed, passed)

    def render(self, packed: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Draw designs.

        Parameters
        ----------
        packed : (n, bytes) uint8
            Packed masks over the beams of the lattice.

        Returns
        -------
        (n, height, width) uint8
            Ink from 0 to 255, the uppermost row first.

        Raises
        ------
        InvalidDataset
            If the masks have the wrong number of bits.
        """
        from bellcrank.surrogate.kernels.rendering import draw

        # The kernel does not check bounds.
        masks = np.ascontiguousarray(check_masks(packed, len(self.strokes.start) - 1))
        ink = np.empty((len(masks), self.canvas.height, self.canvas.width), np.uint8)
        picture = np.empty_like(self.background.passed)
        draw(self.strokes, self.background, masks, picture, ink.reshape(len(masks), picture.size))
        return ink


def check_masks(packed: NDArray[Any], beams: int) -> NDArray[np.uint8]:
    """Return packed masks (n, bytes) unchanged after a check of their shape and type.

    Raises
    ------
    InvalidDataset
    """
    width = (beams + 7) // 8
    if packed.ndim != 2 or packed.shape[1] != width or packed.dtype != np.uint8:
        raise InvalidDataset(
            f"packed: expected masks of {width} bytes for {beams} beams, got {packed.dtype} of "
            f"shape {packed.shape}"
        )
    return packed


def _draw_each_beam(lattice: Lattice, canvas: Canvas) -> Strokes:
    """Draw each beam alone, and keep the pixels that it covers."""
    from bellcrank.surrogate.kernels.rendering import Strokes

    start, pixels, passed = [0], [], []
    for ends in canvas.pixels_of(lattice.positions)[lattice.beams]:
        coverage = draw_lines(canvas, ends[None]).ravel()
        covered = np.flatnonzero(coverage)
        pixels.append(covered.astype(np.uint32))
        passed.append((255 - coverage[covered]).astype(np.float32) / np.float32(255.0))
        start.append(start[-1] + len(covered))
    return Strokes(np.array(start), np.concatenate(pixels), np.concatenate(passed))


def draw_lines(canvas: Canvas, lines: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Draw lines with matplotlib's Agg renderer.

    Parameters
    ----------
    lines : (m, 2, 2)
        Ends in pixels from the lower left corner.

    Returns
    -------
    (height, width) uint8
        Coverage from 0 to 255.
    """
    from matplotlib.backends.backend_agg import RendererAgg
    from matplotlib.path import Path
    from matplotlib.transforms import IdentityTransform

    renderer: Any = RendererAgg(canvas.width, canvas.height, DOTS_PER_INCH)  # type: ignore[no-untyped-call]
    context = renderer.new_gc()
    context.set_linewidth(canvas.line)
    context.set_capstyle("round")
    context.set_foreground("black")
    context.set_snap(False)
    for line in lines:
        renderer.draw_path(context, Path(line), IdentityTransform())
    return np.array(renderer.buffer_rgba())[:, :, 3]
