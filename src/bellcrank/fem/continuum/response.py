"""The response of a part to its input, as a continuum in the plane or in space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.fem.continuum.backend import ngsolve
from bellcrank.fem.continuum.equations import ContinuumEquations
from bellcrank.fem.continuum.fields import Deformed, deformed
from bellcrank.fem.continuum.mesh import plane_mesh
from bellcrank.fem.continuum.solid import solid_mesh
from bellcrank.fem.continuum.system import MEAN_ORDER, continuum_system, integration
from bellcrank.fem.path import Path, PathStatus, State, Stepping, follow

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.fem.continuum.mesh import ContinuumMesh
    from bellcrank.fem.results import Field
    from bellcrank.part.part import Part

STEPPING = Stepping(first=0.125, largest=0.25)


def in_silence(_state: State) -> None:
    """Tell nobody."""


@dataclass(frozen=True, slots=True, eq=False)
class ContinuumState:
    """An equilibrium of a continuum.

    Parameters
    ----------
    load
        Part of the full input, 0 to 1.
    motion : (N, 2) or (N, 3)
        Mean displacement of the hubs of the lattice's nodes, mm; 0 where there is none.
    force : (N, 2) or (N, 3)
        What holds, drives or resists each of these hubs, N.
    input_force
        Of the input along its directions, N.
    energy
        Stored in the material, N mm.
    stress
        Largest equivalent (Cauchy's) stress by von Mises outside clamped hubs, MPa.
    strain
        Largest principal strain there.
    """

    load: float
    motion: NDArray[np.float64]
    force: NDArray[np.float64]
    input_force: float
    energy: float
    stress: float
    strain: float


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """What a part does under its input.

    Parameters
    ----------
    path
        Its equilibria.
    states
        The same in full.
    fields
        The same for pictures and files.
    unknowns
        How many there are.
    elements
        How many there are.
    """

    path: Path
    states: list[ContinuumState]
    fields: list[Field]
    unknowns: int
    elements: int

    @property
    def field(self) -> Field:
        """The last equilibrium."""
        return self.fields[-1]


def solve_plane(
    part: Part,
    law: str = "neo-hookean",
    size: float | None = None,
    stepping: Stepping = STEPPING,
    tell: Callable[[State], None] = in_silence,
) -> Response:
    """Return the response of a part as a sheet (plane stress).

    Parameters
    ----------
    law
        Name in the registry of laws; `linear` takes the full input in one step.
    size
        Of the largest triangles, mm; by default half the width.
    stepping
        With what steps its path is followed.
    tell
        Called with each state that is reached.

    Raises
    ------
    InvalidSettings, UnknownName
    """
    return respond(part, plane_mesh(part, size), law, stepping, tell)


def solve_solid(
    part: Part,
    law: str = "neo-hookean",
    size: float | None = None,
    stepping: Stepping = STEPPING,
    tell: Callable[[State], None] = in_silence,
) -> Response:
    """Return the response of a part as a body, with one layer of elements across its thickness.

    Parameters are those of `solve_plane`; triangles are by default as large as the width.

    Raises
    ------
    InvalidSettings, UnknownName
    """
    return respond(part, solid_mesh(part, size), law, stepping, tell)


def respond(
    part: Part,
    mesh: ContinuumMesh,
    law: str,
    stepping: Stepping = STEPPING,
    tell: Callable[[State], None] = in_silence,
) -> Response:
    """Return the response of a part that is cut into elements already."""
    equations = ContinuumEquations(continuum_system(part, mesh, law))
    if equations.system.law.small:
        path = solve_linear(equations)
    else:
        path = follow(equations, stepping, tell)
    shapes = [deformed(equations, state.unknowns) for state in path.states]
    states = [
        complete(part, equations, state, shape)
        for state, shape in zip(path.states, shapes, strict=True)
    ]
    fields = [shape.field for shape in shapes]
    return Response(path, states, fields, equations.count, len(mesh.elements))


def solve_linear(equations: ContinuumEquations) -> Path:
    """Return rest and the response to the full input of equations that are linear."""
    rest = State(0.0, np.zeros(equations.count))
    near = equations.linearise(rest.unknowns, 1.0)
    if not near.factor.firm:
        return Path([rest], PathStatus.MECHANISM, 1)
    unknowns = -near.factor.solve(near.residual)
    # The stiffness lets given motions yield a little; a second solution takes that away.
    unknowns -= near.factor.solve(equations.residual(unknowns, 1.0)[0])
    return Path([rest, State(1.0, unknowns)], PathStatus.CONVERGED, 1)


def complete(
    part: Part, equations: ContinuumEquations, state: State, shape: Deformed
) -> ContinuumState:
    """Return an equilibrium with motions and forces at the lattice's nodes."""
    system, given = equations.system, part.design.problem.input
    force = forces_on_hubs(equations, state)
    motion = motion_of_hubs(equations, state)
    along = (force[given.nodes, :2] * given.direction).sum()
    mesh = system.mesh
    stored = mesh.thickness * system.law.energy(equations.gradient, system.lame)
    rules = integration(mesh.dimension, system.order)
    energy = ngsolve().Integrate(stored * ngsolve().dx(intrules=rules), mesh.mesh)
    return ContinuumState(
        load=state.load,
        motion=motion,
        force=force,
        input_force=float(along),
        energy=float(energy),
        stress=shape.largest_stress,
        strain=shape.largest_strain,
    )


def motion_of_hubs(equations: ContinuumEquations, state: State) -> NDArray[np.float64]:
    """Return (N, d) the mean displacement of hubs, mm; 0 where there is none."""
    module, mesh = ngsolve(), equations.system.mesh
    equations.place(state.unknowns)
    names = mesh.mesh.GetMaterials()
    places = [names.index(f"hub{node}") for node in mesh.hubs]
    sizes = np.array([equations.hub_sizes[node] for node in mesh.hubs.tolist()])
    motion = np.zeros((mesh.node_count, mesh.dimension))
    for axis in range(mesh.dimension):
        moved = equations.state.components[0][axis]
        totals = module.Integrate(moved, mesh.mesh, order=MEAN_ORDER, region_wise=True)
        motion[mesh.hubs, axis] = np.array([totals[place] for place in places]) / sizes
    return motion


def forces_on_hubs(equations: ContinuumEquations, state: State) -> NDArray[np.float64]:
    """Return (N, d) what acts on hubs from outside, N; 0 where there is none."""
    system = equations.system
    grips, mesh = system.grips, system.mesh
    force = np.zeros((mesh.node_count, mesh.dimension))
    pulls = state.unknowns[equations.moving :]
    for grip, pull in zip(grips.means, pulls.tolist(), strict=True):
        force[grip.node] -= system.unit * pull * np.array(grip.direction)
    force[grips.pushed, :2] += state.load * grips.force
    inner = equations.forces(state.unknowns)[: equations.displacements.ndof]
    inner = inner.reshape(mesh.dimension, -1)
    hub_of_element, elements = mesh.hub_of_element, mesh.elements
    for node in grips.clamped.tolist():
        # The functions of the corners add up to 1 everywhere.
        corners = np.unique(elements[hub_of_element == node])
        force[node] += inner[:, corners].sum(axis=1)
    return force
