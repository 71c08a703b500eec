"""Pictures of designs, made as fast as a network can look at them.

Each beam is drawn once, alone, by matplotlib's Agg without snapping to pixels. What a design's
picture then shows in a pixel is the product, over its beams, of what each lets through:

    ink = 1 - prod over present beams (1 - coverage)

which is exact where beams do not overlap, and within a few grey levels where their ends do.
On one core that is a sparse product of a few thousand terms a picture; on a GPU it is one
matrix product, ``exp(bits @ log(1 - coverage))``.

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
"""At which a point is a pixel."""
SMALLEST, LARGEST = 8, 4096
"""Sides of a canvas, in pixels."""


@dataclass(frozen=True, slots=True)
class Canvas:
    """The sheet that lattices are drawn on.

    Parameters
    ----------
    width, height
        In pixels; the paper's pictures have 192 x 128.
    line
        Width of a beam's line, in pixels.
    margin
        Between the outermost lines and the border, in pixels.

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
                f"canvas: a line of {self.line} and margins of {self.margin} leave no room on "
                f"{self.width} x {self.height} pixels"
            )

    @property
    def border(self) -> float:
        """Pixels that nodes stay away from two opposite sides, both together."""
        return 2.0 * self.margin + self.line

    def to_dict(self) -> dict[str, Any]:
        """Return the canvas as plain data."""
        return asdict(self)

    def place(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return pixel coordinates of nodes, from the lower left corner: centred, as large as fits.

        Parameters
        ----------
        positions : (N, 2)
        """
        low, high = positions.min(axis=0), positions.max(axis=0)
        sheet = np.array([self.width, self.height], dtype=np.float64)
        extent = np.maximum(high - low, 1e-9)
        scale = float(((sheet - self.border) / extent).min())
        return np.asarray((positions - 0.5 * (low + high)) * scale + 0.5 * sheet)


class Renderer:
    """Draws designs on one lattice.

    Parameters
    ----------
    lattice
        Whose beams are drawn, at rest.
    canvas
        What they are drawn on.
    usual : (M,) bool
        Beams that most designs have: drawn first, and at once where a design has them all. That
        changes no bit against drawing them first one by one; against another order of drawing,
        products round differently, by one grey level at most.

    Raises
    ------
    InvalidDataset
        By `render`, if masks are not those of the lattice.
    """

    __slots__ = ("background", "canvas", "strokes")

    def __init__(
        self,
        lattice: Lattice,
        canvas: Canvas | None = None,
        usual: NDArray[np.bool_] | None = None,
    ) -> None:
        from bellcrank.surrogate.kernels.rendering import Background, lay_all

        self.canvas = canvas or Canvas()
        self.strokes = _draw_each_beam(lattice, self.canvas)
        shared = np.zeros(lattice.beam_count, np.bool_) if usual is None else usual
        packed = np.packbits(shared)
        passed = np.ones(self.canvas.width * self.canvas.height, np.float32)
        lay_all(self.strokes, packed, passed)
        self.background = Background(packed, passed)

    def render(
        self, packed: NDArray[np.uint8], out: NDArray[np.uint8] | None = None
    ) -> NDArray[np.uint8]:
        """Draw designs.

        Parameters
        ----------
        packed : (n, bytes) uint8
            Masks over the lattice's beams, packed.
        out : (n, height, width) uint8
            Where to; new by default.

        Returns
        -------
        (n, height, width) uint8
            Ink from 0 to 255, the uppermost row first.

        Raises
        ------
        InvalidDataset
            If masks have not one bit for each beam of the lattice.
        InvalidSettings
            If `out` is of another shape or kind, or not contiguous.
        """
        from bellcrank.surrogate.kernels.rendering import draw

        # The kernel reads and writes where it is told, without looking.
        masks = np.ascontiguousarray(check_masks(packed, len(self.strokes.start) - 1))
        shape = (len(masks), self.canvas.height, self.canvas.width)
        ink = np.empty(shape, np.uint8) if out is None else out
        if ink.shape != shape or ink.dtype != np.uint8 or not ink.flags.c_contiguous:
            raise InvalidSettings(
                f"out: expected a contiguous array of bytes of shape {shape}, got "
                f"{ink.dtype} of shape {ink.shape}"
            )
        picture = np.empty_like(self.background.passed)
        draw(self.strokes, self.background, masks, picture, ink.reshape(len(masks), picture.size))
        return ink

    def coverage(self) -> NDArray[np.float32]:
        """Return the ink that each beam would lay alone, (beams, pixels)."""
        start, pixel, passed = self.strokes
        beams = np.repeat(np.arange(len(start) - 1), np.diff(start))
        dense = np.zeros((len(start) - 1, self.canvas.height * self.canvas.width), np.float32)
        dense[beams, pixel] = 1.0 - passed
        return dense


def check_masks(packed: NDArray[Any], beams: int) -> NDArray[np.uint8]:
    """Return packed masks as they are, if they can be over so many beams.

    Parameters
    ----------
    packed : (n, bytes) uint8

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
    """Let Agg draw each beam alone, and keep the pixels that it touches."""
    from bellcrank.surrogate.kernels.rendering import Strokes

    start, pixels, passed = [0], [], []
    for ends in canvas.place(lattice.positions)[lattice.beams]:
        coverage = draw_lines(canvas, ends[None]).ravel()
        touched = np.flatnonzero(coverage)
        pixels.append(touched.astype(np.uint32))
        passed.append((255 - coverage[touched]).astype(np.float32) / np.float32(255.0))
        start.append(start[-1] + len(touched))
    return Strokes(np.array(start), np.concatenate(pixels), np.concatenate(passed))


def draw_lines(
    canvas: Canvas, lines: NDArray[np.float64], *, snap: bool = False
) -> NDArray[np.uint8]:
    """Let matplotlib's Agg draw lines in one go.

    Parameters
    ----------
    lines : (m, 2, 2)
        Ends in pixels, from the lower left corner.
    snap
        Whether Agg may move horizontal and vertical lines to whole pixels, as it does unless it
        is told not to.

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
    # True would move the ends of sloping lines too, which nobody's figures do.
    context.set_snap(None if snap else False)
    for line in lines:
        renderer.draw_path(context, Path(line), IdentityTransform())
    return np.array(renderer.buffer_rgba())[:, :, 3]
