"""What parts are made of."""

from __future__ import annotations

from dataclasses import dataclass

from bellcrank.errors import InvalidSettings


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
