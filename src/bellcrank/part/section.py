"""The cross-section of a strut."""

from __future__ import annotations

from dataclasses import dataclass

from bellcrank.errors import InvalidSettings

SHEAR_COEFFICIENT = 5.0 / 6.0
"""Shear coefficient of a rectangle."""


@dataclass(frozen=True, slots=True)
class Section:
    """A rectangular cross-section.

    Parameters
    ----------
    width
        Size in the plane of the lattice, mm.
    thickness
        Size normal to the lattice, mm.

    Raises
    ------
    InvalidSettings
        If one is not above 0.

    Examples
    --------
    >>> Section(2.0, 5.0).area, Section(2.0, 6.0).inertia
    (10.0, 4.0)
    """

    width: float
    thickness: float

    def __post_init__(self) -> None:
        for name in ("width", "thickness"):
            value = getattr(self, name)
            if not 0.0 < value < float("inf"):
                raise InvalidSettings(f"{name}: expected a length above 0 mm, got {value!r}")

    @property
    def area(self) -> float:
        """Area A, mm^2."""
        return self.width * self.thickness

    @property
    def inertia(self) -> float:
        """Second moment of area I about the axis normal to the lattice, mm^4."""
        return self.thickness * self.width**3 / 12.0
