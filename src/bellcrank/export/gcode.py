"""Read G-code: deposited volume, size, layers and time."""

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
TYPE = ";TYPE:"
"""Comment of PrusaSlicer before lines of one kind."""
SPAN = re.compile(r"(\d+)([dhms])")
SECONDS = {"d": 86400, "h": 3600, "m": 60, "s": 1}


@dataclass(frozen=True, slots=True, eq=False)
class Deposit:
    """Material deposited by G-code.

    Parameters
    ----------
    volume
        Volume of the extruded filament of the part, mm^3.
    support
        Volume of that of supports, mm^3.
    low, high : (3,)
        Corners of the bounding box of extruding moves of the part, mm.
    layers
        Number of distinct heights of these moves.
    seconds
        Printing time estimated by the slicer; nan if unknown.
    """

    volume: float
    support: float
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    layers: int
    seconds: float


def read_gcode(lines: Iterable[str], filament_diameter: float) -> Deposit:
    """Return the material that G-code deposits.

    Extrusion is counted on straight moves in the plane, which excludes retractions and their
    reversal. Filament coordinates may be absolute or relative, nozzle coordinates are absolute.
    Moves after ``;TYPE:Support material`` are those of supports.

    Parameters
    ----------
    lines
        Lines of the G-code.
    filament_diameter
        Diameter of the filament, mm.

    Raises
    ------
    InvalidFile
        If nothing is deposited, or a move cannot be read.

    Examples
    --------
    >>> lines = ["M83", "G1 Z0.3", "G1 X10 Y0", "G1 X20 Y0 E1.0", "G1 E-2", "; estimated"]
    >>> found = read_gcode(lines, 1.75)
    >>> round(found.volume, 3), found.support, found.low.tolist(), found.layers
    (2.405, 0.0, [10.0, 0.0, 0.3], 1)
    """
    relative, filament, position = False, 0.0, {"X": 0.0, "Y": 0.0, "Z": 0.0}
    extruded, seconds, is_support = {False: 0.0, True: 0.0}, math.nan, False
    visited: list[tuple[float, float, float]] = []
    for number, line in enumerate(lines, start=1):
        if found := ESTIMATE.match(line):
            seconds = float(sum(int(n) * SECONDS[unit] for n, unit in SPAN.findall(found[1])))
        if line.startswith(TYPE):
            is_support = line.removeprefix(TYPE).startswith("Support")
        fields = line.split(";", 1)[0].split()
        if not fields:
            continue
        code = fields[0].upper()
        if code in ("M82", "M83"):
            relative = code == "M83"
        if code not in ("G0", "G1", "G92"):
            continue
        given = _numbers(fields[1:], number)
        if code == "G92":
            filament = given.get("E", filament)
            continue
        before = dict(position)
        position.update({axis: given[axis] for axis in position if axis in given})
        if "E" not in given:
            continue
        amount = given["E"] if relative else given["E"] - filament
        filament = given["E"]
        if amount > 0.0 and ("X" in given or "Y" in given):
            extruded[is_support] += amount
            if not is_support:
                visited.append((before["X"], before["Y"], position["Z"]))
                visited.append((position["X"], position["Y"], position["Z"]))
    if not visited:
        raise InvalidFile("the G-code deposits no material")
    points = np.array(visited)
    heights = np.unique(np.round(points[:, 2], 4))
    section = math.pi * filament_diameter**2 / 4.0
    volume, support = (section * extruded[each] for each in (False, True))
    return Deposit(volume, support, points.min(axis=0), points.max(axis=0), len(heights), seconds)


def _numbers(fields: list[str], line: int) -> dict[str, float]:
    """Read the coordinates of a move."""
    try:
        return {field[0].upper(): float(field[1:]) for field in fields if len(field) > 1}
    except ValueError:
        raise InvalidFile(f"line {line} of the G-code cannot be read: {' '.join(fields)}") from None
