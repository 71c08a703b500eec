"""Widths of printed lines, one and several side by side."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bellcrank.errors import InvalidSettings


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintRules:
    """Cross-section of the lines of a printer.

    The cross-section of a bead is a rectangle with half circles at both sides, of the height of a
    layer. Adjacent beads overlap so that no voids remain. The distance of their centre lines is
    ``bead_width - layer (1 - pi / 4)``, and n beads are n times this distance plus
    ``layer (1 - pi / 4)`` wide.

    Parameters
    ----------
    nozzle, bead_width, layer : float, mm
        Diameter of the nozzle, width of a single bead, and its height.
    min_lines
        Smallest number of lines of a strut. A single line tears at its ends.

    Raises
    ------
    InvalidSettings
        If a length is not positive, or layers are higher than the nozzle or a bead is wide.

    References
    ----------
    Slic3r manual, "Flow Math": ``spacing = extrusion width - layer height (1 - pi / 4)``, which
    PrusaSlicer has kept.

    Examples
    --------
    A strut of 1.6 mm consists of four lines of 0.45 mm, but of no whole number of 0.40 mm lines:

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
    min_lines: int = 2

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
        if self.min_lines < 1:
            raise InvalidSettings(f"min_lines: expected at least 1, got {self.min_lines}")

    @property
    def overlap(self) -> float:
        """Overlap of adjacent beads, mm."""
        return self.layer * (1.0 - 0.25 * math.pi)

    def width_of(self, lines: int) -> float:
        """Return the width of a number of adjacent lines, mm."""
        return lines * (self.bead_width - self.overlap) + self.overlap

    def lines_in(self, width: float) -> int:
        """Return the number of lines, at least 1, whose width is nearest to `width` (mm).

        Examples
        --------
        >>> PrintRules().lines_in(1.6), PrintRules().lines_in(0.1)
        (4, 1)
        """
        return max(1, round((width - self.overlap) / (self.bead_width - self.overlap)))
