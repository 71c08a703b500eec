"""Numbers with units: lengths, forces, masses, angles, ratios, stiffness."""

from __future__ import annotations

import math
import re
from contextlib import suppress
from typing import Literal, NamedTuple

from bellcrank.errors import InvalidSettings

GRAVITY = 9.80665
"""Standard acceleration of free fall, m/s^2."""

Quantity = Literal["length", "force", "load", "mass", "angle", "ratio", "stiffness"]


class Unit(NamedTuple):
    """How a quantity is written."""

    units: dict[str, float]
    """Size of each unit in the one that is used; that of bare numbers is ``""``."""
    wanted: str
    """What is expected, for errors."""


LENGTHS = {
    "um": 1e-3, "µm": 1e-3, "μm": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4,
}  # fmt: skip
FORCES = {"N": 1.0, "mN": 1e-3, "kN": 1e3}
MASSES = {"g": 1.0, "mg": 1e-3, "kg": 1e3}

UNITS: dict[str, Unit] = {
    "length": Unit({"": 1.0, **LENGTHS}, "a length like 2mm, 0.2cm or 2 (in mm)"),
    "force": Unit({"": 1.0, **FORCES}, "a force like 0.5N, 300mN or 0.5 (in N)"),
    "load": Unit(
        {**FORCES, **{unit: size * GRAVITY * 1e-3 for unit, size in MASSES.items()}},
        "a force like 0.5N or a mass like 50g, with its unit",
    ),
    "mass": Unit({"": 1.0, **MASSES}, "a mass like 12g or 12 (in g)"),
    "angle": Unit(
        {"": 1.0, "deg": 1.0, "°": 1.0, "rad": math.degrees(1.0)},
        "an angle like 5deg or 5 (in degrees)",
    ),
    "ratio": Unit({"": 1.0, "%": 0.01}, "a ratio like 10% or 0.1"),
    "stiffness": Unit(
        {"": 1.0, "N/mm": 1.0, "N/m": 1e-3, "mN/mm": 1e-3},
        "a stiffness like 0.2N/mm or 0.2 (in N/mm)",
    ),
}
"""Units of each quantity: lengths in mm, forces in N, masses in g, angles in degrees."""
NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S*)\s*")


def read_quantity(name: str, text: str | float, quantity: Quantity) -> float:
    """Return a number in the unit of its quantity (`UNITS`).

    Parameters
    ----------
    name
        Name of the number, for the error.
    text
        A number with a unit, such as ``2mm`` or ``0.2 cm``, or a bare number.
    quantity
        Its kind; a ``"load"`` is a force in N, or the weight of a mass.

    Raises
    ------
    InvalidSettings
        If it is not one; says what is expected.

    Examples
    --------
    >>> read_quantity("strain", "10%", "ratio"), read_quantity("push", "300 mN", "force")
    (0.1, 0.3)
    >>> round(read_quantity("payload", "50g", "load"), 4)
    0.4903
    >>> read_quantity("rotation", "5mm", "angle")
    Traceback (most recent call last):
        ...
    bellcrank.errors.InvalidSettings: rotation: expected an angle like 5deg or 5 (in degrees), \
got '5mm'
    """
    known, value = UNITS[quantity], math.nan
    if isinstance(text, int | float) and not isinstance(text, bool):
        value = float(text) if "" in known.units else math.nan
    elif isinstance(text, str) and (found := NUMBER.fullmatch(text)) and found[2] in known.units:
        with suppress(ValueError):
            value = float(found[1]) * known.units[found[2]]
    if not math.isfinite(value):
        raise InvalidSettings(f"{name}: expected {known.wanted}, got {text!r}")
    return value


def read_length(name: str, text: str | float) -> float:
    """Return a length in mm; see `read_quantity`.

    Raises
    ------
    InvalidSettings
        If it is not a length.

    Examples
    --------
    >>> read_length("width", "2mm"), read_length("width", "0.1 cm"), read_length("width", 1.6)
    (2.0, 1.0, 1.6)
    """
    return read_quantity(name, text, "length")
