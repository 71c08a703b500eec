"""Materials of parts, and a registry of printable ones."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from bellcrank.errors import InvalidSettings
from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Mapping

LARGEST_POISSON = 0.495
"""Largest Poisson's ratio: nearer to 0.5, displacement-based finite elements lock."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """An isotropic material, linear at small strains.

    Parameters
    ----------
    name
        Name of the material.
    young
        Young's modulus E, MPa.
    poisson
        Poisson's ratio, from 0 to 0.495.
    density
        Density, g/cm^3; nan if unknown.
    strain_limit
        Largest strain without permanent damage (0.65 for 65 %); nan if unknown.
    fatigue_strain
        Largest amplitude of the strain that a printed part endures over the cycles of its use; nan
        if unknown, as it is for all bundled materials.
    sources
        Source of each value.

    Raises
    ------
    InvalidSettings
        If a value is outside its range.

    Examples
    --------
    >>> round(Material(name="rubber", young=12.0, poisson=0.48).shear, 3)
    4.054
    """

    name: str
    young: float
    poisson: float
    density: float = math.nan
    strain_limit: float = math.nan
    fatigue_strain: float = math.nan
    sources: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not 0.0 < self.young < math.inf:
            raise InvalidSettings(f"young: expected a modulus above 0 MPa, got {self.young!r}")
        if not 0.0 <= self.poisson <= LARGEST_POISSON:
            raise InvalidSettings(
                f"poisson: expected a ratio from 0 to {LARGEST_POISSON}, got {self.poisson!r}"
            )
        for name in ("density", "strain_limit", "fatigue_strain"):
            value = getattr(self, name)
            if not (math.isnan(value) or 0.0 < value < math.inf):
                raise InvalidSettings(f"{name}: expected a number above 0, got {value!r}")

    @property
    def shear(self) -> float:
        """Shear modulus G, MPa."""
        return self.young / (2.0 * (1.0 + self.poisson))


materials: Registry[Material] = Registry("material")
"""Printable materials by name.

Properties of printed parts vary by tens of percent with direction, machine and colour.
Efficiencies do not depend on E and hardly on Poisson's ratio; forces are proportional to E.
"""

NINJATEK = "NinjaTek, NinjaFlex technical data sheet (ASTM D638), as quoted by others"
TPU_MODULUS = "Haid, Duncan, Hart and Foster, 14th dvs Symposium: 24 to 247 MPa over printed TPUs"
TPU_RATIO = "Xu and Juang, Polymers 13, 1498 (2021): 0.48 after the first loading, measured on TPU"
ULTIMAKER = "Ultimaker, material file of generic TPU 95A"
PRUSAMENT = "Prusa Polymers, Prusament {} data sheet v1.1 (2022), ISO 527-1, printed flat"
CUSTOMARY = "typical of the polymer; in no data sheet"

materials.register("ninjaflex")(
    Material(
        name="ninjaflex",
        young=12.0,
        poisson=0.48,
        density=1.19,
        strain_limit=0.65,
        sources={
            "young": NINJATEK,
            "poisson": TPU_RATIO,
            "density": NINJATEK,
            "strain_limit": f"elongation at yield: {NINJATEK}",
        },
    )
)

materials.register("tpu-95a")(
    Material(
        name="tpu-95a",
        young=26.0,
        poisson=0.48,
        density=1.22,
        sources={"young": TPU_MODULUS, "poisson": TPU_RATIO, "density": ULTIMAKER},
    )
)

for _name, _young, _poisson, _density, _strain_limit in (
    ("pla", 2300.0, 0.35, 1.24, 0.029),
    ("petg", 1500.0, 0.38, 1.27, 0.051),
):
    _sheet = PRUSAMENT.format(_name.upper())
    materials.register(_name)(
        Material(
            name=_name,
            young=_young,
            poisson=_poisson,
            density=_density,
            strain_limit=_strain_limit,
            sources={
                "young": _sheet,
                "poisson": CUSTOMARY,
                "density": _sheet,
                "strain_limit": f"yield strain: {_sheet}",
            },
        )
    )
