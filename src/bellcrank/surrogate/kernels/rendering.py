"""Pictures of designs as products of what each beam lets through."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bellcrank.mechanics.kernels._compile import entry, kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Strokes(NamedTuple):
    """The pixels that each of M beams touches, one beam after the other."""

    start: NDArray[np.int64]
    """(M + 1,) where each beam's pixels begin."""
    pixel: NDArray[np.uint32]
    """Indices into a picture of pixels row by row."""
    passed: NDArray[np.float32]
    """Fraction of the pixel that the beam leaves white."""


class Background(NamedTuple):
    """What most designs have in common, drawn once."""

    packed: NDArray[np.uint8]
    """(bytes,) its beams."""
    passed: NDArray[np.float32]
    """(pixels,) what they leave white."""


@kernel
def lay(
    strokes: Strokes, packed: NDArray[np.uint8], beam: int, passed: NDArray[np.float32]
) -> None:
    """Draw one beam of a design, if it is there."""
    if packed[beam >> 3] & (128 >> (beam & 7)):
        for at in range(strokes.start[beam], strokes.start[beam + 1]):
            passed[strokes.pixel[at]] *= strokes.passed[at]


@entry
def lay_all(strokes: Strokes, packed: NDArray[np.uint8], passed: NDArray[np.float32]) -> None:
    """Draw the beams of one design onto what is there."""
    for beam in range(len(strokes.start) - 1):
        lay(strokes, packed, beam, passed)


@entry
def draw(
    strokes: Strokes,
    background: Background,
    packed: NDArray[np.uint8],
    picture: NDArray[np.float32],
    ink: NDArray[np.uint8],
) -> None:
    """Draw designs: the ink in a pixel is 1 - prod over present beams of what they let pass.

    The beams of the background are drawn first, whether at once or one by one: a picture
    comes out the same to the last bit.

    Parameters
    ----------
    packed : (n, bytes)
        The designs, as `numpy.packbits` leaves them.
    picture : (pixels,)
        To work on.
    ink : (n, pixels)
        Filled: 0 where there is paper, 255 where all is covered.
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
                    lay(strokes, design, beam, picture)
        for beam in range(beams):
            if not background.packed[beam >> 3] & (128 >> (beam & 7)):
                lay(strokes, design, beam, picture)
        for pixel in range(len(picture)):
            ink[number, pixel] = np.uint8(np.float32(255.5) - np.float32(255.0) * picture[pixel])
