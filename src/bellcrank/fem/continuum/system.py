"""Meshes with their material, supports and loads.

Supports hold all of a hub, rollers and driven inputs its mean displacement, so that driven hubs
rotate freely.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.fem.continuum.backend import ngsolve
from bellcrank.fem.continuum.laws import lame_of, laws
from bellcrank.mechanics.frames.system import applied_forces
from bellcrank.model.stroke_ranges import WHOLE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from bellcrank.fem.continuum.laws import Lame, Law
    from bellcrank.fem.continuum.mesh import ContinuumMesh
    from bellcrank.part.part import Part

ORDER = {2: 4, 3: 2}
"""Degree of exact integration of energies: six points in a triangle and four in a tetrahedron, for
which more points only increase the stiffness."""
MEAN_ORDER = 5
"""Degree of exact integration of mean displacements of hubs."""


@dataclass(frozen=True, slots=True)
class MeanConstraint:
    """A constraint on one component of the mean displacement of one hub.

    Parameters
    ----------
    node
        Lattice node of the hub.
    direction
        Unit vector of the component, of two or three numbers.
    motion
        Prescribed displacement at the full stroke, mm.
    spring
        Stiffness of a spring between the hub and the prescribed displacement, N / mm; inf for a
        displacement that is prescribed exactly.
    during
        Fractions of the stroke between which the prescribed displacement grows.
    """

    node: int
    direction: tuple[float, ...]
    motion: float = 0.0
    spring: float = math.inf
    during: tuple[float, float] = WHOLE


@dataclass(frozen=True, slots=True, eq=False)
class Boundary:
    """Supports and loads of a part.

    Parameters
    ----------
    clamped : (c,) int64
        Lattice nodes whose hubs are held.
    means
        Constraints on mean displacements of hubs.
    loaded : (p,) int64
        Lattice nodes whose hubs are loaded by forces.
    force : (G, p, d) float64
        Full forces on them, N, those of one range together.
    force_range : (G, 2) float64
        Fractions of the load between which they grow; the first is the whole load.
    weight : (d,) float64, optional
        Own weight at the full load, N / mm^3.
    weight_group
        Group of forces with which it grows.
    """

    clamped: NDArray[np.int64]
    means: tuple[MeanConstraint, ...]
    loaded: NDArray[np.int64]
    force: NDArray[np.float64]
    force_range: NDArray[np.float64]
    weight: NDArray[np.float64] | None = None
    weight_group: int = 0


def boundary_of(part: Part, hubs: NDArray[np.int64], dimension: int) -> Boundary:
    """Return the supports and loads of the hubs of a part.

    In the mesh of a solid, the mean displacement of driven hubs of a part in the plane, and of
    those on rollers, has no component out of the plane.

    Parameters
    ----------
    part
        Part with its problem.
    hubs : (h,) int64
        Lattice nodes that have a hub.
    dimension
        2 for a mesh in the plane, 3 for one in space.
    """
    problem = part.design.problem
    supports, given = problem.supports, problem.input
    axes = [tuple(row) for row in np.eye(dimension).tolist()]
    across = axes[problem.lattice.dimension :]
    means: list[MeanConstraint] = []
    rollers = (supports.fixed_x, supports.fixed_y, supports.fixed_z)
    for nodes, held in zip(rollers, axes, strict=False):
        for node in np.intersect1d(nodes, hubs).tolist():
            means += [MeanConstraint(node, axis) for axis in (held, *across)]
    present = np.isin(given.nodes, hubs)
    if given.drive == "displacement":
        full = given.amount * part.scale * given.direction[present]
        ranges = given.ranges[present].tolist()
        for node, motion, during in zip(
            given.nodes[present].tolist(), full.tolist(), ranges, strict=True
        ):
            means += [
                MeanConstraint(node, axis, move, during=tuple(during))
                for axis, move in zip(axes, motion, strict=False)
            ]
            means += [MeanConstraint(node, axis) for axis in across]
    force, force_range, weight_group = applied_forces(problem, *problem.lattice.positions.shape)
    loaded = np.intersect1d(np.flatnonzero(force.any(axis=(0, 2))), hubs)
    unit = part.stiffness_unit * part.scale
    weight = problem.loads.weight
    return Boundary(
        np.intersect1d(supports.fixed, hubs),
        tuple(means) + tuple(_springs(part, hubs, axes)),
        loaded,
        unit * force[:, loaded],
        force_range,
        None if weight is None else unit / part.scale**3 * weight,
        weight_group,
    )


def _springs(
    part: Part, hubs: NDArray[np.int64], axes: list[tuple[float, ...]]
) -> Iterator[MeanConstraint]:
    """Yield the springs at outputs and at other hubs."""
    problem = part.design.problem
    dimension = problem.lattice.dimension
    rest = axes[0][dimension:]
    for output in problem.outputs.values():
        if output.spring is None:
            continue
        for node, along in zip(output.nodes.tolist(), output.direction.tolist(), strict=True):
            isotropic = output.spring_kind == "isotropic"
            for direction in axes[:dimension] if isotropic else [(*along, *rest)]:
                if node in hubs:
                    spring = output.spring * part.stiffness_unit
                    yield MeanConstraint(node, direction, spring=spring)
    for given in problem.loads.springs:
        for node, along in zip(given.nodes.tolist(), given.direction.tolist(), strict=True):
            if node in hubs:
                spring = given.stiffness * part.stiffness_unit
                yield MeanConstraint(node, (*along, *rest), spring=spring)


def integration(dimension: int, order: int) -> dict[Any, Any]:
    """Return NGSolve's integration rules for triangles or tetrahedra."""
    module = ngsolve()
    shape = module.TRIG if dimension == 2 else module.TET
    return {shape: module.IntegrationRule(shape, order)}


@dataclass(frozen=True, slots=True, eq=False)
class ContinuumSystem:
    """A mesh with its material, supports and loads.

    Parameters
    ----------
    mesh
        Elements.
    boundary
        Supports and loads.
    law, lame
        Material law and its constants.
    unit
        Stiffness k, N / mm, that converts forces of constraints to lengths.
    order
        Degree of exact integration of energies.
    """

    mesh: ContinuumMesh
    boundary: Boundary
    law: Law
    lame: Lame
    unit: float
    order: int


def continuum_system(
    part: Part,
    mesh: ContinuumMesh,
    law: str = "neo-hookean",
    order: int | None = None,
) -> ContinuumSystem:
    """Return a mesh with the material, supports and loads of its part.

    Parameters
    ----------
    part
        Part that was meshed.
    mesh
        Its mesh.
    law
        Name in the registry of laws.
    order
        Degree of exact integration of energies; by default 4 in the plane and 2 in space.

    Raises
    ------
    UnknownName
        If there is no such law.
    """
    dimension = mesh.dimension
    return ContinuumSystem(
        mesh=mesh,
        boundary=boundary_of(part, mesh.hubs, dimension),
        law=laws[law],
        lame=lame_of(part.material),
        unit=part.material.young * part.section.thickness,
        order=ORDER[dimension] if order is None else order,
    )
