"""Lengths with units."""

from __future__ import annotations

import math
import re
from contextlib import suppress

from bellcrank.errors import InvalidSettings

UNITS = {
    "": 1.0,
    "um": 1e-3,
    "µm": 1e-3,
    "μm": 1e-3,
    "mm": 1.0,
    "cm": 10.0,
    "m": 1000.0,
    "in": 25.4,
}
"""Length of each unit, mm."""
LENGTH = re.compile(r"\s*([-+0-9.eE]+?)\s*([a-zµμ]*)\s*")


def read_length(name: str, text: str | float) -> float:
    """Return a length in mm; numbers without unit are in mm.

    Parameters
    ----------
    name
        Name of the quantity, for the error.
    text
        For example ``2mm``, ``0.2 cm`` or ``2``.

    Raises
    ------
    InvalidSettings
        If it is not a length.

    Examples
    --------
    >>> read_length("width", "2mm"), read_length("width", "0.1 cm"), read_length("width", 1.6)
    (2.0, 1.0, 1.6)
    """
    length = math.nan
    if isinstance(text, int | float) and not isinstance(text, bool):
        length = float(text)
    elif isinstance(text, str) and (found := LENGTH.fullmatch(text)) and found[2] in UNITS:
        with suppress(ValueError):
            length = float(found[1]) * UNITS[found[2]]
    if not math.isfinite(length):
        raise InvalidSettings(
            f"{name}: expected a length like 2mm, 0.2cm or 2 (in mm), got {text!r}"
        )
    return length
