"""Pictures of designs as products of the transmissions of their beams."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bellcrank.mechanics.kernels._compile import entry, kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Strokes(NamedTuple):
    """The pixels that each of M beams covers, one beam after the other."""

    start: NDArray[np.int64]
    """(M + 1,) index of the first pixel of each beam."""
    pixel: NDArray[np.uint32]
    """Indices into a picture, row by row."""
    passed: NDArray[np.float32]
    """Transmission: fraction of the pixel that the beam leaves white."""


class Background(NamedTuple):
    """Beams that most designs have in common, drawn once."""

    packed: NDArray[np.uint8]
    """(bytes,) packed mask of these beams."""
    passed: NDArray[np.float32]
    """(pixels,) their transmission."""


@kernel
def draw_beam(
    strokes: Strokes, packed: NDArray[np.uint8], beam: int, passed: NDArray[np.float32]
) -> None:
    """Multiply the transmission of one beam into a picture, if a design has the beam."""
    if packed[beam >> 3] & (128 >> (beam & 7)):
        for at in range(strokes.start[beam], strokes.start[beam + 1]):
            passed[strokes.pixel[at]] *= strokes.passed[at]


@entry
def draw_beams(strokes: Strokes, packed: NDArray[np.uint8], passed: NDArray[np.float32]) -> None:
    """Multiply the transmissions of the beams of one design into a picture."""
    for beam in range(len(strokes.start) - 1):
        draw_beam(strokes, packed, beam, passed)


@entry
def draw(
    strokes: Strokes,
    background: Background,
    packed: NDArray[np.uint8],
    picture: NDArray[np.float32],
    ink: NDArray[np.uint8],
) -> None:
    """Draw designs: the ink in a pixel is 1 minus the product of the transmissions of the beams.

    The beams of the background are multiplied first, at once or one by one: both give the same
    picture to the last bit.

    Parameters
    ----------
    packed : (n, bytes)
        Designs as `numpy.packbits` returns them.
    picture : (pixels,)
        Workspace.
    ink : (n, pixels)
        Result: 0 is white, 255 is black.
    """
    beams = len(strokes.start) - 1
    for number in range(len(packed)):
        design = packed[number]
        whole = True
        for byte in range(len(design)):
            whole &= (design[byte] & background.packed[byte]) == background.packed[byte]
        if whole:
            for pixel in range(len(picture)):
                picture[pixel] = background.passed[pixel]
        else:
            picture[:] = np.float32(1.0)
            for beam in range(beams):
                if background.packed[beam >> 3] & (128 >> (beam & 7)):
                    draw_beam(strokes, design, beam, picture)
        for beam in range(beams):
            if not background.packed[beam >> 3] & (128 >> (beam & 7)):
                draw_beam(strokes, design, beam, picture)
        for pixel in range(len(picture)):
            ink[number, pixel] = np.uint8(np.float32(255.5) - np.float32(255.0) * picture[pixel])
