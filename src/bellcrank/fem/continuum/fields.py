"""Stress and strain at the corners of the elements.

Stresses are most accurate at the integration points of each element. They are extrapolated linearly
from three points in a triangle, or four in a tetrahedron, to its corners and averaged over the
elements that share a corner.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.fem.continuum.backend import ngsolve
from bellcrank.fem.results import Field

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.fem.continuum.equations import ContinuumEquations

SAMPLES = 2
"""Order of the integration rule that has as many points as an element has corners."""


@dataclass(frozen=True, slots=True, eq=False)
class StressField:
    """Displacement, stress and strain of a state.

    Parameters
    ----------
    field
        Displacement and stress at the corners of the elements. Its cells are the triangles in the
        plane, and the surface triangles in space.
    strain : (n,) float64
        Largest principal strain, stretch minus 1, at each vertex.
    clamped : (n,) bool
        Whether each vertex belongs to a clamped hub.
    """

    field: Field
    strain: NDArray[np.float64]
    clamped: NDArray[np.bool_]

    @property
    def largest_stress(self) -> float:
        """Largest von Mises stress outside clamped hubs, MPa."""
        return float(self.field.stress[~self.clamped].max())

    @property
    def largest_strain(self) -> float:
        """Largest principal strain outside clamped hubs."""
        return float(self.strain[~self.clamped].max())


def stress_field(equations: ContinuumEquations, unknowns: NDArray[np.float64]) -> StressField:
    """Return displacement, stress and strain of a state."""
    equations.set_state(unknowns)
    system = equations.system
    mesh, dimension = system.mesh, system.mesh.dimension
    vertices, elements = mesh.vertices, mesh.elements
    gradient = equations.gradient
    stress, stretched = (
        at_vertices(mesh.mesh, elements, len(vertices), quantity)
        for quantity in (system.law.stress(gradient, system.lame), gradient)
    )
    # In NGSolve's basis the functions of the corners come first; coefficients are values there.
    values = equations.state.components[0].vec.FV().NumPy().reshape(dimension, -1)
    clamped = np.zeros(len(vertices), dtype=bool)
    clamped[elements[np.isin(mesh.hub_of_element, system.boundary.clamped)]] = True
    field = Field(
        rest=vertices,
        displacement=values[:, : len(vertices)].T.copy(),
        cells=elements if dimension == 2 else surface(elements),
        stress=von_mises(stress),
    )
    return StressField(field, largest_strain(stretched, small=system.law.small), clamped)


def at_vertices(
    region: Any, elements: NDArray[np.int64], count: int, quantity: Any
) -> NDArray[np.float64]:
    """Return (count, d, d) the averages of a coefficient function at the corners of elements."""
    module = ngsolve()
    corners = elements.shape[1]
    dimension = corners - 1
    rule = module.IntegrationRule(module.TRIG if dimension == 2 else module.TET, SAMPLES)
    where = np.array([point[:dimension] for point in rule.points])
    # Linear functions that are 1 in one corner, first those of the corners on the axes.
    shapes = np.column_stack([where, 1.0 - where.sum(axis=1)])
    sampled = np.array(quantity(region.MapToAllElements(rule, module.VOL)))
    sampled = sampled.reshape(len(elements), len(shapes), -1)
    spread = np.einsum("cs,esk->eck", np.linalg.inv(shapes), sampled)
    total = np.zeros((count, spread.shape[2]))
    np.add.at(total, elements.ravel(), spread.reshape(-1, spread.shape[2]))
    meeting = np.bincount(elements.ravel(), minlength=count)
    return (total / np.maximum(meeting, 1)[:, None]).reshape(count, dimension, dimension)


def von_mises(stress: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n,) the von Mises stress of (n, 2, 2) plane or (n, 3, 3) stresses.

    Examples
    --------
    >>> von_mises(np.array([[[3.0, 0.0], [0.0, 0.0]], [[0.0, 1.0], [1.0, 0.0]]])).round(6).tolist()
    [3.0, 1.732051]
    """
    whole = np.zeros((len(stress), 3, 3))
    whole[:, : stress.shape[1], : stress.shape[1]] = (stress + stress.transpose(0, 2, 1)) / 2.0
    whole -= np.trace(whole, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
    equivalent: NDArray[np.float64] = np.sqrt(1.5 * (whole**2).sum(axis=(1, 2)))
    return equivalent


def largest_strain(gradient: NDArray[np.float64], *, small: bool) -> NDArray[np.float64]:
    """Return (n,) the largest principal stretch minus 1 of (n, d, d) deformation gradients.

    Parameters
    ----------
    gradient : (n, d, d) float64
        Deformation gradients.
    small
        Whether to return the largest principal small strain instead.
    """
    turned = gradient.transpose(0, 2, 1)
    if small:
        strain = np.linalg.eigvalsh((gradient + turned) / 2.0)[:, -1] - 1.0
    else:
        strain = np.sqrt(np.linalg.eigvalsh(turned @ gradient)[:, -1]) - 1.0
    return np.asarray(strain, dtype=np.float64)


def surface(tetrahedra: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return (t, 3) the faces of only one tetrahedron, counter-clockwise seen from outside.

    Examples
    --------
    >>> surface(np.array([[0, 1, 2, 3]])).tolist()
    [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]
    """
    faces = tetrahedra[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3)
    _, first, times = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    outside: NDArray[np.int64] = faces[np.sort(first[times == 1])]
    return outside
