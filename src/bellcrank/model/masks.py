"""Masks over the beams of a lattice, packed into hexadecimal text.

Bit m is beam m of the lattice in the order of its file, eight beams to a byte, the first in the
highest bit (`numpy.packbits`). The last byte is padded with zeros.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def pack_mask(mask: ArrayLike) -> str:
    """Return a mask as hexadecimal text.

    Parameters
    ----------
    mask : (M,) bool
        Which beams are present.

    Examples
    --------
    >>> pack_mask([True, False, False, True, True, True, True, True, True])
    '9f80'
    """
    return np.packbits(np.asarray(mask, dtype=np.bool_)).tobytes().hex()


def unpack_mask(text: str, beam_count: int) -> NDArray[np.bool_]:
    """Return the mask of `beam_count` beams that hexadecimal text describes.

    Returns
    -------
    (M,) bool

    Raises
    ------
    InvalidFile
        If the text is not hexadecimal, has the wrong length, or marks beams beyond the last one.

    Examples
    --------
    >>> unpack_mask("9f80", 9)
    array([ True, False, False,  True,  True,  True,  True,  True,  True])
    >>> unpack_mask("9f", 9)
    Traceback (most recent call last):
        ...
    bellcrank.errors.InvalidFile: mask: expected 4 hexadecimal digits for 9 beams, got 2
    """
    digits = 2 * ((beam_count + 7) // 8)
    if len(text) != digits:
        raise InvalidFile(
            f"mask: expected {digits} hexadecimal digits for {beam_count} beams, got {len(text)}"
        )
    wrong = next((k for k, c in enumerate(text) if c not in "0123456789abcdefABCDEF"), None)
    if wrong is not None:
        raise InvalidFile(
            f"mask: expected hexadecimal digits, got {text[wrong]!r} at position {wrong}"
        )
    bits = np.unpackbits(np.frombuffer(bytes.fromhex(text), dtype=np.uint8)).astype(np.bool_)
    beyond = np.flatnonzero(bits[beam_count:])
    if len(beyond):
        raise InvalidFile(
            f"mask: marks beam {beam_count + beyond[0]}, "
            f"but the lattice has only {beam_count} beams (0 to {beam_count - 1})"
        )
    return bits[:beam_count]
