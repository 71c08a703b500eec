"""Responses of parts to their input, in plane stress or as solids."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.fem.continuum.backend import ngsolve
from bellcrank.fem.continuum.equations import ContinuumEquations
from bellcrank.fem.continuum.fields import StressField, stress_field
from bellcrank.fem.continuum.mesh import plane_mesh
from bellcrank.fem.continuum.solid import solid_mesh
from bellcrank.fem.continuum.space_mesh import space_mesh
from bellcrank.fem.continuum.system import MEAN_ORDER, continuum_system, integration
from bellcrank.fem.path import EquilibriumPath, PathState, PathStatus, StepControl, follow_path
from bellcrank.mechanics.output import best_fit_rotation
from bellcrank.model.stroke_ranges import share_at

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.fem.continuum.mesh import ContinuumMesh
    from bellcrank.fem.results import Field
    from bellcrank.model import Problem
    from bellcrank.part.part import Part

STEPS = StepControl(first=0.125, largest=0.25)


@dataclass(frozen=True, slots=True, eq=False)
class ContinuumState:
    """An equilibrium of a continuum.

    Parameters
    ----------
    load
        Fraction of the full input, 0 to 1.
    motion : (N, 2) or (N, 3) float64
        Mean displacements of the hubs of the lattice nodes, mm; 0 for nodes without a hub.
    rotation : () or (3,) float64
        Rotation of the output, degrees.
    force : (N, 2) or (N, 3) float64
        External forces on the hubs, N, from supports, input and springs.
    input_force
        Total input force along the input directions, N.
    energy
        Elastic energy, N mm.
    stress
        Largest von Mises (Cauchy) stress outside clamped hubs, MPa.
    strain
        Largest principal strain outside clamped hubs.
    """

    load: float
    motion: NDArray[np.float64]
    rotation: NDArray[np.float64]
    force: NDArray[np.float64]
    input_force: float
    energy: float
    stress: float
    strain: float


@dataclass(frozen=True, slots=True, eq=False)
class ContinuumResponse:
    """Response of a part to its input.

    Parameters
    ----------
    path
        Equilibrium path.
    states, fields
        Figures and fields of the equilibria of the path.
    unknowns, elements
        Number of unknowns and of elements.
    """

    path: EquilibriumPath
    states: list[ContinuumState]
    fields: list[Field]
    unknowns: int
    elements: int


def solve_plane(
    part: Part,
    law: str = "neo-hookean",
    size: float | None = None,
    control: StepControl = STEPS,
    report: Callable[[PathState], None] = lambda _state: None,
) -> ContinuumResponse:
    """Return the response of a part in plane stress.

    Parameters
    ----------
    part
        Part to be analysed.
    law
        Name in the registry of laws; `linear` applies the full input in one step.
    size
        Largest edge of the triangles, mm; half the strut width by default.
    control
        Step sizes of the continuation.
    report
        Called with each state on the path.

    Raises
    ------
    InvalidSettings
        If the part cannot be meshed.
    UnknownName
        If there is no such law.
    """
    return solve_mesh(part, plane_mesh(part, size), law, control, report)


def solve_solid(
    part: Part,
    law: str = "neo-hookean",
    size: float | None = None,
    control: StepControl = STEPS,
    report: Callable[[PathState], None] = lambda _state: None,
) -> ContinuumResponse:
    """Return the response of a part as a solid.

    A part in the plane has one layer of elements across its thickness. Parameters and errors are
    those of `solve_plane`; the default size is the strut width, in space that of `space_mesh`.
    """
    mesh = solid_mesh(part, size) if part.dimension == 2 else space_mesh(part, size)
    return solve_mesh(part, mesh, law, control, report)


def solve_mesh(
    part: Part,
    mesh: ContinuumMesh,
    law: str,
    control: StepControl = STEPS,
    report: Callable[[PathState], None] = lambda _state: None,
) -> ContinuumResponse:
    """Return the response of a meshed part."""
    equations = ContinuumEquations(continuum_system(part, mesh, law))
    if equations.system.law.small:
        path = _solve_linear(equations)
    else:
        path = follow_path(equations, control, report)
    stresses = [stress_field(equations, state.unknowns) for state in path.states]
    states = [
        complete_state(part, equations, state, stress)
        for state, stress in zip(path.states, stresses, strict=True)
    ]
    fields = [stress.field for stress in stresses]
    return ContinuumResponse(path, states, fields, equations.count, len(mesh.elements))


def _solve_linear(equations: ContinuumEquations) -> EquilibriumPath:
    """Return rest and the response to the full input of linear equations."""
    rest = PathState(0.0, np.zeros(equations.count))
    linear = equations.linearise(rest.unknowns, 1.0)
    if not linear.stiffness.nonsingular:
        return EquilibriumPath([rest], PathStatus.MECHANISM, 1)
    unknowns = -linear.stiffness.solve(linear.residual)
    # Exact constraints are slightly compliant in the stiffness; a second solution corrects this.
    unknowns -= linear.stiffness.solve(equations.residual(unknowns, 1.0)[0])
    return EquilibriumPath([rest, PathState(1.0, unknowns)], PathStatus.CONVERGED, 1)


def complete_state(
    part: Part, equations: ContinuumEquations, state: PathState, stress: StressField
) -> ContinuumState:
    """Return an equilibrium with displacements and forces at the lattice nodes."""
    system, problem = equations.system, part.design.problem
    given = problem.input
    force = _hub_forces(equations, state)
    motion = hub_displacements(equations, state)
    mesh = system.mesh
    density = mesh.thickness * system.law.energy(equations.gradient, system.lame)
    rules = integration(mesh.dimension, system.order)
    energy = ngsolve().Integrate(density * ngsolve().dx(intrules=rules), mesh.mesh)
    return ContinuumState(
        load=state.load,
        motion=motion,
        rotation=output_rotation(problem, mesh, motion / part.scale, stress.field),
        force=force,
        input_force=float((force[given.nodes, : given.direction.shape[1]] * given.direction).sum()),
        energy=float(energy),
        stress=stress.largest_stress,
        strain=stress.largest_strain,
    )


def output_rotation(
    problem: Problem, mesh: ContinuumMesh, motion: NDArray[np.float64], field: Field
) -> NDArray[np.float64]:
    """Return the rotation of the output, of its nodes or of a single hub, degrees.

    Parameters
    ----------
    problem
        Problem of the part.
    mesh
        Mesh of the part.
    motion : (N, d) float64
        Mean displacements of hubs, lattice units.
    field
        Displacement of the vertices of the mesh.

    Returns
    -------
    () or (3,) float64
        Angle in the plane; rotation vector in space, and of a single hub of a solid.
    """
    nodes, rest = problem.output.nodes, problem.lattice.positions
    if len(nodes) > 1:
        return best_fit_rotation(rest[nodes], motion[nodes, : rest.shape[1]])
    corners = np.unique(mesh.elements[mesh.hub_of_element == nodes[0]])
    return best_fit_rotation(field.rest[corners], field.displacement[corners])


def hub_displacements(equations: ContinuumEquations, state: PathState) -> NDArray[np.float64]:
    """Return (N, d) the mean displacements of hubs, mm; 0 for nodes without a hub."""
    module, mesh = ngsolve(), equations.system.mesh
    equations.set_state(state.unknowns)
    names = mesh.mesh.GetMaterials()
    regions = [names.index(f"hub{node}") for node in mesh.hubs]
    sizes = np.array([equations.hub_sizes[node] for node in mesh.hubs.tolist()])
    motion = np.zeros((mesh.node_count, mesh.dimension))
    for axis in range(mesh.dimension):
        component = equations.state.components[0][axis]
        totals = module.Integrate(component, mesh.mesh, order=MEAN_ORDER, region_wise=True)
        motion[mesh.hubs, axis] = np.array([totals[region] for region in regions]) / sizes
    return motion


def _hub_forces(equations: ContinuumEquations, state: PathState) -> NDArray[np.float64]:
    """Return (N, d) the external forces on hubs, N; 0 for nodes without a hub."""
    system = equations.system
    boundary, mesh = system.boundary, system.mesh
    force = np.zeros((mesh.node_count, mesh.dimension))
    multipliers = state.unknowns[equations.moving :]
    for constraint, multiplier in zip(boundary.means, multipliers.tolist(), strict=True):
        force[constraint.node] -= system.unit * multiplier * np.array(constraint.direction)
    shares = share_at(boundary.force_range, state.load)
    force[boundary.loaded, : boundary.force.shape[2]] += np.tensordot(
        shares, boundary.force, axes=1
    )
    internal = equations.forces(state.unknowns)[: equations.displacements.ndof]
    internal = internal.reshape(mesh.dimension, -1)
    hub_of_element, elements = mesh.hub_of_element, mesh.elements
    for node in boundary.clamped.tolist():
        # The shape functions of the corners add up to 1 everywhere.
        corners = np.unique(elements[hub_of_element == node])
        force[node] += internal[:, corners].sum(axis=1)
    return force
