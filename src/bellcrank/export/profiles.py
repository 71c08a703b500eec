"""Print profiles for fused deposition, in a registry."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from bellcrank.errors import InvalidSettings
from bellcrank.export.beads import PrintRules
from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Mapping


LEAST_WIDTH, MOST_WIDTH = 0.5, 1.5
"""Range of printed over drawn widths."""


def check_printed_width(ratio: float) -> None:
    """Refuse a ratio of printed to drawn widths that no printer has.

    Raises
    ------
    InvalidSettings
        If it is out of its range.
    """
    if not LEAST_WIDTH <= ratio <= MOST_WIDTH:
        raise InvalidSettings(
            "printed_width: expected the printed width over the drawn one, from "
            f"{LEAST_WIDTH:.0%} to {MOST_WIDTH:.0%}, got {ratio:.4g}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintProfile:
    """Settings of printer and filament.

    Parameters
    ----------
    name
        Name of the profile.
    nozzle
        Diameter of the nozzle, mm.
    layer
        Height of layers, mm.
    bead_width
        Width of printed lines, mm.
    temperature, bed_temperature
        Temperatures of nozzle and bed, degrees Celsius.
    speed
        Speed of the nozzle, mm / s.
    filament_diameter
        Diameter of the filament, mm.
    printed_width
        Width of a printed strut over that of the drawn one, measured on the printer: 0.88 where
        walls are 12 % thin. Struts are drawn wider by its inverse.
    sources
        Source of each value.

    Raises
    ------
    InvalidSettings
        If a value is not valid, for example layers higher than the nozzle diameter.

    Examples
    --------
    >>> profile = profiles["ninjaflex"]
    >>> profile.rules.bead_width, profile.speed
    (0.45, 20.0)
    """

    name: str
    nozzle: float = 0.4
    layer: float = 0.32
    bead_width: float = 0.45
    temperature: int = 215
    bed_temperature: int = 60
    speed: float = 40.0
    filament_diameter: float = 1.75
    printed_width: float = 1.0
    sources: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("speed", "filament_diameter"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise InvalidSettings(f"{name}: expected a number above 0, got {value!r}")
        check_printed_width(self.printed_width)
        self.rules  # noqa: B018  validates the lengths

    @property
    def rules(self) -> PrintRules:
        """Cross-section of printed lines."""
        return PrintRules(nozzle=self.nozzle, bead_width=self.bead_width, layer=self.layer)


profiles: Registry[PrintProfile] = Registry("profile")
"""Profiles by material."""

PAPER = "Bonfanti et al. 2020: nozzle 0.4 mm, layers of 0.8 of that"
CUSTOMARY = "typical of the polymer; the label of the filament takes precedence"
NOZZLE = {"nozzle": PAPER, "layer": PAPER, "bead_width": "slightly wider than the nozzle, typical"}
HEAT = {"temperature": CUSTOMARY, "bed_temperature": CUSTOMARY, "speed": CUSTOMARY}

for _name, _nozzle, _bed, _speed in (
    ("ninjaflex", 230, 40, 20.0),
    ("tpu-95a", 230, 50, 30.0),
    ("pla", 215, 60, 60.0),
    ("petg", 240, 80, 50.0),
):
    profiles.register(_name)(
        PrintProfile(
            name=_name,
            temperature=_nozzle,
            bed_temperature=_bed,
            speed=_speed,
            sources={**NOZZLE, **HEAT},
        )
    )
