"""Material laws: elastic energy per volume at rest.

F is the deformation gradient; lambda and mu are Lame's constants. In plane stress the thickness
stretches by the factor that minimises the energy, which has a closed form for each law here. All
laws agree at small strains.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.fem.continuum.backend import ngsolve
from bellcrank.registry import Registry

if TYPE_CHECKING:
    from bellcrank.part.materials import Material

Quantity = Callable[[Any, "Lame"], Any]
"""Function of F, a coefficient function of NGSolve, and of Lame's constants."""


@dataclass(frozen=True, slots=True)
class Lame:
    """Lame's constants.

    Parameters
    ----------
    first, shear
        Constants lambda and mu, MPa.
    """

    first: float
    shear: float

    @property
    def plane_stress(self) -> float:
        """Constant that replaces lambda in plane stress, MPa."""
        return 2.0 * self.first * self.shear / (self.first + 2.0 * self.shear)


def lame_of(material: Material) -> Lame:
    """Return Lame's constants of a material.

    Examples
    --------
    >>> from bellcrank.part.materials import Material
    >>> constants = lame_of(Material(name="rubber", young=12.0, poisson=0.25))
    >>> constants, round(constants.plane_stress, 9)
    (Lame(first=4.8, shear=4.8), 3.2)
    """
    first = 2.0 * material.shear * material.poisson / (1.0 - 2.0 * material.poisson)
    return Lame(first, material.shear)


@dataclass(frozen=True, slots=True)
class Law:
    """Elastic energy per volume at rest, N / mm^2.

    Parameters
    ----------
    plane, solid
        Energy in plane stress, from F (2, 2), and of a solid, from F (3, 3).
    thinning
        Squared stretch of the thickness in plane stress, from F (2, 2).
    small
        Whether the law is linear and holds at small strains only.
    """

    plane: Quantity
    solid: Quantity
    thinning: Quantity
    small: bool = False

    def energy(self, gradient: Any, lame: Lame) -> Any:
        """Return the energy in plane stress or of a solid, by the shape of F."""
        return (self.plane if gradient.dims[0] == 2 else self.solid)(gradient, lame)

    def stress(self, gradient: Any, lame: Lame) -> Any:
        """Return the Cauchy stress, MPa; for small strains the nominal stress."""
        module = ngsolve()
        variable = gradient.MakeVariable()
        nominal = self.energy(variable, lame).Diff(variable)
        if self.small:
            return nominal
        volume = module.Det(variable)
        if gradient.dims[0] == 2:
            volume *= module.sqrt(self.thinning(variable, lame))
        return nominal * variable.trans / volume


laws: Registry[Law] = Registry("law")
"""Material laws by name."""


def hooke(strain: Any, first: float, shear: float) -> Any:
    """Return the energy lambda / 2 (tr E)^2 + mu E : E."""
    module = ngsolve()
    return 0.5 * first * module.Trace(strain) ** 2 + shear * module.InnerProduct(strain, strain)


def small_strain(gradient: Any) -> Any:
    """Return (F + F') / 2 - 1."""
    module = ngsolve()
    return 0.5 * (gradient + gradient.trans) - module.Id(gradient.dims[0])


def green_strain(gradient: Any) -> Any:
    """Return (F' F - 1) / 2."""
    module = ngsolve()
    return 0.5 * (gradient.trans * gradient - module.Id(gradient.dims[0]))


laws.register("linear")(
    Law(
        plane=lambda gradient, lame: hooke(small_strain(gradient), lame.plane_stress, lame.shear),
        solid=lambda gradient, lame: hooke(small_strain(gradient), lame.first, lame.shear),
        thinning=lambda _gradient, _lame: ngsolve().CF(1.0),
        small=True,
    )
)


def st_venant_kirchhoff_thinning(gradient: Any, lame: Lame) -> Any:
    """Return 1 + 2 E33 with the strain E33 = -lambda / (lambda + 2 mu) tr E of zero stress."""
    ratio = lame.first / (lame.first + 2.0 * lame.shear)
    return 1.0 - 2.0 * ratio * ngsolve().Trace(green_strain(gradient))


laws.register("st-venant-kirchhoff")(
    Law(
        plane=lambda gradient, lame: hooke(green_strain(gradient), lame.plane_stress, lame.shear),
        solid=lambda gradient, lame: hooke(green_strain(gradient), lame.first, lame.shear),
        thinning=st_venant_kirchhoff_thinning,
    )
)


def ciarlet(trace: Any, volume: Any, lame: Lame) -> Any:
    """Return mu / 2 (I1 - 3) + lambda / 4 (J^2 - 1) - (lambda / 2 + mu) ln J.

    References
    ----------
    P. G. Ciarlet, Mathematical elasticity, vol. 1, 1988, section 4.10.
    """
    shape = 0.5 * lame.shear * (trace - 3.0)
    size = 0.25 * lame.first * (volume * volume - 1.0)
    return shape + size - (0.5 * lame.first + lame.shear) * ngsolve().log(volume)


def thinning_of(gradient: Any, lame: Lame) -> Any:
    """Return c = (lambda + 2 mu) / (2 mu + lambda j^2), with j = det F in the plane.

    The energy of Ciarlet's law, with I1 = tr F' F + c and J^2 = j^2 c, is minimal for
    mu / 2 + lambda j^2 / 4 = (lambda / 2 + mu) / (2 c).
    """
    area = ngsolve().Det(gradient)
    return (lame.first + 2.0 * lame.shear) / (2.0 * lame.shear + lame.first * area * area)


def neo_hookean_plane(gradient: Any, lame: Lame) -> Any:
    """Return the energy by Ciarlet's law in plane stress."""
    module = ngsolve()
    thinning = thinning_of(gradient, lame)
    trace = module.InnerProduct(gradient, gradient) + thinning
    return ciarlet(trace, module.Det(gradient) * module.sqrt(thinning), lame)


def neo_hookean_solid(gradient: Any, lame: Lame) -> Any:
    """Return the energy by Ciarlet's law of a solid."""
    module = ngsolve()
    return ciarlet(module.InnerProduct(gradient, gradient), module.Det(gradient), lame)


laws.register("neo-hookean")(
    Law(plane=neo_hookean_plane, solid=neo_hookean_solid, thinning=thinning_of)
)
