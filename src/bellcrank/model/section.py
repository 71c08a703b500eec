"""Cross-section and material of the beams of a frame."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.model.arrays import positive_number, real_array

if TYPE_CHECKING:
    from numpy.typing import NDArray

Shape = Literal["rectangle", "round"]

SHEAR_COEFFICIENTS: dict[Shape, float] = {"rectangle": 5.0 / 6.0, "round": 0.9}
"""Shear coefficient of each shape."""

ODD_SUM = 31.0 / 32.0 * 1.0369277551433699
"""Sum of 1 / n^5 over odd n, 31/32 of Riemann's zeta(5)."""
ODD_NUMBERS = range(1, 20, 2)
"""Terms of Saint-Venant's series; for the sides of a square the last one is below 1e-31."""


@dataclass(frozen=True, slots=True)
class Section:
    """The cross-section of a beam: a rectangle or a disc.

    Lengths have the unit of the user: lattice units in a problem, mm in a part. `Section.round`
    makes a disc of a given diameter.

    Parameters
    ----------
    width
        Size in the plane of the lattice; the diameter of a disc.
    thickness
        Size normal to the lattice; the diameter of a disc.
    shape
        ``"rectangle"`` or ``"round"``.
    joint
        Length of each end of a beam, from the node, that does not bend: where struts meet, they
        are wider than one strut.

    Raises
    ------
    InvalidProblem
        If a length is not finite and greater than 0, the shape is unknown, a disc has two
        diameters, or joints are longer than half the width.

    Examples
    --------
    >>> Section(2.0, 5.0).area, Section(2.0, 6.0).inertia
    (10.0, 4.0)
    >>> Section.round(2.0).width, round(Section.round(2.0).area, 6)
    (2.0, 3.141593)
    """

    width: float
    thickness: float
    shape: Shape = "rectangle"
    joint: float = 0.0

    def __post_init__(self) -> None:
        if self.shape not in get_args(Shape):
            raise InvalidProblem(
                f"section.shape: expected 'rectangle' or 'round', got {self.shape!r}"
            )
        disc = self.shape == "round"
        width = positive_number("section.diameter" if disc else "section.width", self.width)
        thickness = positive_number("section.thickness", self.thickness)
        if disc and thickness != width:
            raise InvalidProblem(
                f"section.thickness: expected the diameter {width:g} of a round section, "
                f"got {thickness:g}"
            )
        joint = real_array("section.joint", self.joint)
        if joint.ndim != 0 or not 0.0 <= joint <= 0.5 * width:
            raise InvalidProblem(
                f"section.joint: expected a length from 0 to half the width, {0.5 * width:g}, "
                f"got {self.joint!r}"
            )
        object.__setattr__(self, "width", width)
        object.__setattr__(self, "thickness", thickness)
        object.__setattr__(self, "joint", float(joint))

    @classmethod
    def round(cls, diameter: float, joint: float = 0.0) -> Section:
        """Return a disc.

        Raises
        ------
        InvalidProblem
            If the diameter is not finite and greater than 0, or joints are longer than half of it.
        """
        return cls(diameter, diameter, "round", joint)

    @property
    def area(self) -> float:
        """Area A."""
        return float(self.area_of(np.asarray(self.width)))

    def area_of(self, width: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (...) the areas of sections of the same kind and other widths.

        Examples
        --------
        >>> Section(2.0, 5.0).area_of(np.array([2.0, 3.0]))
        array([10., 15.])
        """
        if self.shape == "round":
            return np.asarray(math.pi * width**2 / 4.0)
        return np.asarray(width * self.thickness)

    @property
    def inertia(self) -> float:
        """Second moment of area I for bending in the plane of the lattice."""
        if self.shape == "round":
            return math.pi * self.width**4 / 64.0
        return self.thickness * self.width**3 / 12.0

    @property
    def inertia_out_of_plane(self) -> float:
        """Second moment of area for bending out of the plane of the lattice."""
        if self.shape == "round":
            return self.inertia
        return self.width * self.thickness**3 / 12.0

    @property
    def torsion_constant(self) -> float:
        """Torsion constant J, so that G J is the torsional rigidity without restrained warping.

        For a rectangle the series of Saint-Venant, summed to rounding errors.

        References
        ----------
        S. P. Timoshenko and J. N. Goodier, Theory of Elasticity, 3rd edition (1970), section 109.

        Examples
        --------
        >>> round(Section(1.0, 1.0).torsion_constant, 6)
        0.140577
        """
        if self.shape == "round":
            return math.pi * self.width**4 / 32.0
        short, long = sorted((self.width, self.thickness))
        # tanh x = 1 - 2 / (exp(2 x) + 1): the first part has a known sum, the second one
        # decreases exponentially.
        rest = 0.0
        for n in ODD_NUMBERS:
            decay = math.exp(-n * math.pi * long / short)
            rest += 2.0 * decay / (1.0 + decay) / n**5
        series = 192.0 / math.pi**5 * short / long * (ODD_SUM - rest)
        return long * short**3 / 3.0 * (1.0 - series)

    @property
    def shear_coefficient(self) -> float:
        """Ratio of the area that resists shear to the area, kappa."""
        return SHEAR_COEFFICIENTS[self.shape]

    def scaled(self, factor: float) -> Section:
        """Return a section `factor` times as large.

        Raises
        ------
        InvalidProblem
            If the factor is not finite and greater than 0.

        Examples
        --------
        >>> Section(2.0, 5.0).scaled(0.1)
        Section(width=0.2, thickness=0.5, shape='rectangle', joint=0.0)
        """
        factor = positive_number("factor", factor)
        lengths = [factor * each for each in (self.width, self.thickness, self.joint)]
        return Section(lengths[0], lengths[1], self.shape, lengths[2])

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, as in a problem file.

        Examples
        --------
        >>> Section.round(0.2).to_dict()
        {'shape': 'round', 'diameter': 0.2}
        """
        data: dict[str, Any] = {"shape": self.shape}
        if self.shape == "round":
            data["diameter"] = self.width
        else:
            data.update(width=self.width, thickness=self.thickness)
        return data | ({"joint": self.joint} if self.joint else {})


@dataclass(frozen=True, slots=True)
class Elasticity:
    """An isotropic, linearly elastic material.

    Parameters
    ----------
    young
        Young's modulus E, in forces of the problem per squared lattice unit.
    poisson
        Poisson's ratio.

    Raises
    ------
    InvalidProblem
        If Young's modulus is not finite and greater than 0, or Poisson's ratio is not greater
        than -1 and at most 0.5.

    Examples
    --------
    >>> Elasticity(young=3.0, poisson=0.5).shear_modulus
    1.0
    """

    young: float
    poisson: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "young", positive_number("material.young", self.young))
        poisson = real_array("material.poisson", self.poisson)
        if poisson.ndim != 0 or not -1.0 < poisson <= 0.5:
            raise InvalidProblem(
                "material.poisson: expected a ratio greater than -1 and at most 0.5, "
                f"got {self.poisson!r}"
            )
        object.__setattr__(self, "poisson", float(poisson))

    @property
    def shear_modulus(self) -> float:
        """Shear modulus G."""
        return self.young / (2.0 * (1.0 + self.poisson))


DEFAULT_MATERIAL = Elasticity(young=1.0, poisson=0.48)
"""Material of a frame problem that names none; efficiencies do not depend on the modulus."""
