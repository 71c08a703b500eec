"""How parts are printed: a registry of profiles for fused deposition."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from bellcrank.errors import InvalidSettings
from bellcrank.export.beads import PrintRules
from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintProfile:
    """Printer and filament.

    Parameters
    ----------
    name
        What to call it.
    nozzle
        Diameter, mm.
    layer
        Height of layers, mm.
    bead_width
        Of a line of plastic, mm.
    temperature, bed_temperature
        Of nozzle and bed, degrees Celsius.
    speed
        Along lines, mm / s.
    filament_diameter
        mm.
    sources
        Where each figure comes from.

    Raises
    ------
    InvalidSettings
        If a figure is impossible: layers higher than the nozzle is wide, say.

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
    sources: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("speed", "filament_diameter"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise InvalidSettings(f"{name}: expected a number above 0, got {value!r}")
        self.rules  # noqa: B018  refuses lengths that make no sense

    @property
    def rules(self) -> PrintRules:
        """What the printer lays down."""
        return PrintRules(nozzle=self.nozzle, bead_width=self.bead_width, layer=self.layer)


profiles: Registry[PrintProfile] = Registry("profile")
"""Profiles by the material that they are for."""

PAPER = "Bonfanti et al. 2020: nozzle 0.4 mm, layers of 0.8 of that"
CUSTOMARY = "customary for the polymer; the label of your filament knows better"
NOZZLE = {"nozzle": PAPER, "layer": PAPER, "bead_width": "a little over the nozzle, customary"}
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
