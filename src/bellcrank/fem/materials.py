"""What parts are made of: a registry of materials, each figure with its source."""

from __future__ import annotations

from dataclasses import dataclass

from bellcrank.errors import InvalidSettings
from bellcrank.registry import Registry


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """An isotropic material, linear at small strains.

    Parameters
    ----------
    name
        What to call it.
    young
        Young's modulus E in MPa.
    poisson
        Poisson's ratio, 0 or more and below 0.5.
    density
        In g / cm^3; None if unknown.
    strain_limit
        Tensile strain up to which it works; None if unknown.
    source
        Where the figures come from.

    Raises
    ------
    InvalidSettings
        If a figure is impossible.

    Examples
    --------
    >>> round(Material(name="rubber", young=12.0, poisson=0.48).shear, 3)
    4.054
    """

    name: str
    young: float
    poisson: float
    density: float | None = None
    strain_limit: float | None = None
    source: str = ""

    def __post_init__(self) -> None:
        if not 0.0 < self.young < float("inf"):
            raise InvalidSettings(f"young: expected a modulus above 0 MPa, got {self.young!r}")
        if not 0.0 <= self.poisson < 0.5:
            raise InvalidSettings(
                f"poisson: expected a ratio of at least 0 and below 0.5, got {self.poisson!r}"
            )

    @property
    def shear(self) -> float:
        """Shear modulus G in MPa."""
        return self.young / (2.0 * (1.0 + self.poisson))


materials: Registry[Material] = Registry("material")

materials.register("ninjaflex")(
    Material(
        name="ninjaflex",
        young=12.0,
        poisson=0.48,
        density=1.19,
        strain_limit=0.65,
        source="NinjaTek, NinjaFlex technical specifications: tensile modulus, elongation at yield",
    )
)
