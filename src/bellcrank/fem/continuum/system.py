"""A mesh with a material and what holds and drives it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.fem.continuum.backend import ngsolve
from bellcrank.fem.continuum.grips import Grips, grips_of
from bellcrank.fem.continuum.laws import lame_of, laws

if TYPE_CHECKING:
    from bellcrank.fem.continuum.laws import Lame, Law
    from bellcrank.fem.continuum.mesh import ContinuumMesh
    from bellcrank.part.part import Part

ORDER = {2: 4, 3: 2}
"""Degree up to which energies are integrated exactly: six points in a triangle, and the four of
quadratic tetrahedra, which more points only make stiffer."""
MEAN_ORDER = 5
"""Degree up to which mean displacements of hubs are."""


def integration(dimension: int, order: int) -> dict[Any, Any]:
    """Return NGSolve's rules for triangles or tetrahedra."""
    module = ngsolve()
    shape = module.TRIG if dimension == 2 else module.TET
    return {shape: module.IntegrationRule(shape, order)}


@dataclass(frozen=True, slots=True, eq=False)
class ContinuumSystem:
    """A mesh with a material and what holds and drives it.

    Parameters
    ----------
    mesh
        Its elements.
    grips
        On its hubs.
    law, lame
        Of the material.
    unit
        k, stiffness in N / mm by which forces of grips are made lengths.
    order
        Degree up to which energies are integrated exactly.
    """

    mesh: ContinuumMesh
    grips: Grips
    law: Law
    lame: Lame
    unit: float
    order: int


def continuum_system(
    part: Part, mesh: ContinuumMesh, law: str = "neo-hookean", order: int | None = None
) -> ContinuumSystem:
    """Hold and drive a mesh as the problem of its part says.

    Parameters
    ----------
    law
        Name in the registry of laws.
    order
        Degree up to which energies are integrated exactly; by default 4 in the plane, 2 in space.

    Raises
    ------
    UnknownName
    """
    dimension = mesh.dimension
    return ContinuumSystem(
        mesh=mesh,
        grips=grips_of(part, mesh.hubs, dimension),
        law=laws[law],
        lame=lame_of(part.material),
        unit=part.material.young * part.section.thickness,
        order=ORDER[dimension] if order is None else order,
    )
