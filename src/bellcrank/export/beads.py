"""How wide the lines of a printer are, one and several side by side."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bellcrank.errors import InvalidSettings


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintRules:
    """What a printer lays down.

    A bead is a rectangle with half circles at both sides, as high as a layer. Beads side by
    side overlap by as much as fills what the half circles leave open, so that each needs
    ``bead_width - layer (1 - pi / 4)``, and n of them are that times n, and once
    ``layer (1 - pi / 4)``, wide.

    Parameters
    ----------
    nozzle, bead_width, layer : float, mm
        Its diameter, the width of a single bead, and its height.
    least_lines
        How many lines struts should have at least. One alone tears where it begins and ends.

    Raises
    ------
    InvalidSettings
        If a length makes no sense, or layers are higher than a nozzle or a bead is wide.

    References
    ----------
    Slic3r manual, "Flow Math": ``spacing = extrusion width - layer height (1 - pi / 4)``, which
    PrusaSlicer has kept.

    Examples
    --------
    A strut of 1.6 mm is four lines of 0.45 mm, but no whole number of lines of 0.40 mm:

    >>> rules = PrintRules(bead_width=0.45, layer=0.32)
    >>> [round(rules.width_of(lines), 3) for lines in (1, 2, 3, 4)]
    [0.45, 0.831, 1.213, 1.594]
    >>> rules = PrintRules(bead_width=0.40, layer=0.32)
    >>> [round(rules.width_of(lines), 3) for lines in (4, 5)]
    [1.394, 1.725]
    """

    nozzle: float = 0.4
    bead_width: float = 0.45
    layer: float = 0.32
    least_lines: int = 2

    def __post_init__(self) -> None:
        for name in ("nozzle", "bead_width", "layer"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise InvalidSettings(f"{name}: expected a length above 0 mm, got {value!r}")
        most = min(self.nozzle, self.bead_width)
        if self.layer > most:
            raise InvalidSettings(
                f"layer: expected at most {most:g} mm, the smaller of nozzle and bead_width, "
                f"got {self.layer:g} mm"
            )
        if self.least_lines < 1:
            raise InvalidSettings(f"least_lines: expected at least 1, got {self.least_lines}")

    @property
    def overlap(self) -> float:
        """By how much a bead is wider than the space that it needs beside others, mm."""
        return self.layer * (1.0 - 0.25 * math.pi)

    def width_of(self, lines: int) -> float:
        """Return the width of so many lines side by side, mm."""
        return lines * (self.bead_width - self.overlap) + self.overlap

    def lines_in(self, width: float) -> int:
        """Return how many lines, one at least, come nearest to a width.

        Examples
        --------
        >>> PrintRules().lines_in(1.6), PrintRules().lines_in(0.1)
        (4, 1)
        """
        return max(1, round((width - self.overlap) / (self.bead_width - self.overlap)))
