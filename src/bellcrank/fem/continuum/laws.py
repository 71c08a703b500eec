"""Laws of the material: the energy that it stores per volume at rest.

F is the gradient of the deformation, lambda and mu are Lame's constants. In the plane a sheet
is free to change its thickness (plane stress); its thickness stretches by the factor that makes
the energy least, which has a closed form for each law here. All agree at small strains.
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
"""Of F, a coefficient function of NGSolve, and a material."""


@dataclass(frozen=True, slots=True)
class Lame:
    """Lame's constants.

    Parameters
    ----------
    first, shear
        lambda and mu, MPa.
    """

    first: float
    shear: float

    @property
    def thin(self) -> float:
        """What takes the place of lambda in a sheet that may change its thickness, MPa."""
        return 2.0 * self.first * self.shear / (self.first + 2.0 * self.shear)


def lame_of(material: Material) -> Lame:
    """Return Lame's constants of a material.

    Examples
    --------
    >>> from bellcrank.part.materials import Material
    >>> constants = lame_of(Material(name="rubber", young=12.0, poisson=0.25))
    >>> constants, round(constants.thin, 9)
    (Lame(first=4.8, shear=4.8), 3.2)
    """
    first = 2.0 * material.shear * material.poisson / (1.0 - 2.0 * material.poisson)
    return Lame(first, material.shear)


@dataclass(frozen=True, slots=True)
class Law:
    """Energy per volume at rest, N / mm^2.

    Parameters
    ----------
    plane, solid
        Of a sheet by its F (2, 2), and of a body by its F (3, 3).
    thinning
        Squared stretch of a sheet's thickness by its F.
    small
        Whether it holds at small strains only, and is linear.
    """

    plane: Quantity
    solid: Quantity
    thinning: Quantity
    small: bool = False

    def energy(self, gradient: Any, lame: Lame) -> Any:
        """Return the energy of a sheet or body, whichever F is of."""
        return (self.plane if gradient.dims[0] == 2 else self.solid)(gradient, lame)

    def stress(self, gradient: Any, lame: Lame) -> Any:
        """Return Cauchy's stress, MPa: on areas as they are in that state.

        In small strains areas do not change.
        """
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
"""Laws by name."""


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
        plane=lambda gradient, lame: hooke(small_strain(gradient), lame.thin, lame.shear),
        solid=lambda gradient, lame: hooke(small_strain(gradient), lame.first, lame.shear),
        thinning=lambda _gradient, _lame: ngsolve().CF(1.0),
        small=True,
    )
)


def flattened(gradient: Any, lame: Lame) -> Any:
    """Return 1 + 2 E33 of the strain E33 = -lambda / (lambda + 2 mu) tr E that bears no stress."""
    part = lame.first / (lame.first + 2.0 * lame.shear)
    return 1.0 - 2.0 * part * ngsolve().Trace(green_strain(gradient))


laws.register("st-venant-kirchhoff")(
    Law(
        plane=lambda gradient, lame: hooke(green_strain(gradient), lame.thin, lame.shear),
        solid=lambda gradient, lame: hooke(green_strain(gradient), lame.first, lame.shear),
        thinning=flattened,
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


def squeezed(gradient: Any, lame: Lame) -> Any:
    """Return c = (lambda + 2 mu) / (2 mu + lambda j^2), with j = det F of the sheet.

    The energy of Ciarlet's law, with I1 = tr F' F + c and J^2 = j^2 c, is least where
    mu / 2 + lambda j^2 / 4 = (lambda / 2 + mu) / (2 c).
    """
    area = ngsolve().Det(gradient)
    return (lame.first + 2.0 * lame.shear) / (2.0 * lame.shear + lame.first * area * area)


def rubber_sheet(gradient: Any, lame: Lame) -> Any:
    """Return the energy of a sheet by Ciarlet's law."""
    module = ngsolve()
    thinning = squeezed(gradient, lame)
    trace = module.InnerProduct(gradient, gradient) + thinning
    return ciarlet(trace, module.Det(gradient) * module.sqrt(thinning), lame)


def rubber(gradient: Any, lame: Lame) -> Any:
    """Return the energy of a body by Ciarlet's law."""
    module = ngsolve()
    return ciarlet(module.InnerProduct(gradient, gradient), module.Det(gradient), lame)


laws.register("neo-hookean")(Law(plane=rubber_sheet, solid=rubber, thinning=squeezed))
