"""What a printer will really do: G-code, read back."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

ESTIMATE = re.compile(r"; estimated printing time \(normal mode\) = (.*)")
SPAN = re.compile(r"(\d+)([dhms])")
SECONDS = {"d": 86400, "h": 3600, "m": 60, "s": 1}


@dataclass(frozen=True, slots=True, eq=False)
class Deposit:
    """What G-code lays down.

    Parameters
    ----------
    volume
        Of the filament that is pushed out on the way, mm^3.
    low, high : (3,)
        Corners of the box in which the nozzle moves while it does, mm.
    layers
        Heights at which it does.
    seconds
        That the slicer estimates; nan if it says nothing.
    """

    volume: float
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    layers: int
    seconds: float


def read_gcode(lines: Iterable[str], filament_diameter: float) -> Deposit:
    """Read what G-code lays down.

    Counts what is pushed out on straight moves in the plane, and so neither retractions nor what
    takes them back. Knows absolute and relative coordinates of the filament, and absolute ones
    of the nozzle.

    Parameters
    ----------
    filament_diameter
        mm.

    Raises
    ------
    InvalidFile
        If nothing is laid down, or a move makes no sense.

    Examples
    --------
    >>> lines = ["M83", "G1 Z0.3", "G1 X10 Y0", "G1 X20 Y0 E1.0", "G1 E-2", "; estimated"]
    >>> found = read_gcode(lines, 1.75)
    >>> round(found.volume, 3), found.low.tolist(), found.layers
    (2.405, [10.0, 0.0, 0.3], 1)
    """
    relative, filament, place = False, 0.0, {"X": 0.0, "Y": 0.0, "Z": 0.0}
    pushed, seconds = 0.0, math.nan
    visited: list[tuple[float, float, float]] = []
    for number, line in enumerate(lines, start=1):
        if found := ESTIMATE.match(line):
            seconds = float(sum(int(n) * SECONDS[unit] for n, unit in SPAN.findall(found[1])))
        words = line.split(";", 1)[0].split()
        if not words:
            continue
        code = words[0].upper()
        if code in ("M82", "M83"):
            relative = code == "M83"
        if code not in ("G0", "G1", "G92"):
            continue
        given = _numbers(words[1:], number)
        if code == "G92":
            filament = given.get("E", filament)
            continue
        before = dict(place)
        place.update({axis: given[axis] for axis in place if axis in given})
        if "E" not in given:
            continue
        amount = given["E"] if relative else given["E"] - filament
        filament = given["E"]
        if amount > 0.0 and ("X" in given or "Y" in given):
            pushed += amount
            visited.append((before["X"], before["Y"], place["Z"]))
            visited.append((place["X"], place["Y"], place["Z"]))
    if not visited:
        raise InvalidFile("the G-code lays nothing down")
    places = np.array(visited)
    heights = np.unique(np.round(places[:, 2], 4))
    section = math.pi * filament_diameter**2 / 4.0
    return Deposit(pushed * section, places.min(axis=0), places.max(axis=0), len(heights), seconds)


def _numbers(words: list[str], line: int) -> dict[str, float]:
    """Read the coordinates of a move."""
    try:
        return {word[0].upper(): float(word[1:]) for word in words if len(word) > 1}
    except ValueError:
        raise InvalidFile(f"line {line} of the G-code makes no sense: {' '.join(words)}") from None
