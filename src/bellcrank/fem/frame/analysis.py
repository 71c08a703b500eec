"""The level `frame`: analysis of a part as a frame of beams with rigid joints."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.fem.contact import find_contacts
from bellcrank.fem.frame.elements import energy, strain_of
from bellcrank.fem.frame.equilibrium import FrameEquations, solve_linear
from bellcrank.fem.frame.mesh import frame_mesh, theories
from bellcrank.fem.frame.system import frame_system
from bellcrank.fem.levels import Level, levels
from bellcrank.fem.path import PathStatus, follow_path
from bellcrank.fem.results import Analysis, Field, StrokePoint, stroke_point

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bellcrank.fem.contact import Contacts
    from bellcrank.fem.frame.equilibrium import FrameState
    from bellcrank.fem.frame.mesh import FrameMesh
    from bellcrank.fem.levels import FemSettings
    from bellcrank.part.part import Part


def check_frame(_part: Part, settings: FemSettings) -> None:
    """Raise UnknownName for an unknown beam theory."""
    theories[settings.theory]


def analyse_frame(part: Part, settings: FemSettings, report: Callable[[float], None]) -> Analysis:
    """Analyse a part as a frame.

    Parameters
    ----------
    part
        Part to be analysed.
    settings
        Beam theory, elements of each strut, linear or not.
    report
        Called with each load reached.

    Raises
    ------
    InvalidSettings
        If a piece of the part is not held, in a linear analysis.
    """
    began = time.perf_counter()
    mesh = frame_mesh(part, settings.elements, settings.theory)
    system = frame_system(part, mesh)
    equations = FrameEquations(system)
    status, loss = PathStatus.CONVERGED, None
    if settings.linear:
        try:
            states = [solve_linear(system)]
        except RuntimeError:
            raise InvalidSettings(
                f"the part cannot be analysed: {PathStatus.MECHANISM.message}"
            ) from None
        factorisations = 1
    else:
        path = follow_path(equations, report=lambda state: report(state.load))
        states = [equations.complete(state) for state in path.states]
        status, loss, factorisations = path.status, path.loss, path.factorisations
    points = [
        point_of(part, mesh, state, linear=settings.linear)
        for state in states
        if state.load or len(states) == 1
    ]
    return Analysis(
        part=part,
        level="frame",
        theory=settings.theory,
        linear=settings.linear,
        status=status,
        loss=loss,
        points=points,
        contacts=contacts_of(part, mesh, states),
        field=field_of(part, mesh, states[-1], linear=settings.linear),
        cost={
            "seconds": time.perf_counter() - began,
            "unknowns": equations.count,
            "factorisations": factorisations,
        },
    )


levels.register("frame")(Level(analyse_frame, check_frame, title="Frame", duration="seconds"))


def point_of(part: Part, mesh: FrameMesh, state: FrameState, *, linear: bool) -> StrokePoint:
    """Return the figures of an equilibrium."""
    stress, strain = fibre_stress_and_strain(part, mesh, state.displacement, linear=linear)
    return stroke_point(
        part,
        state.load,
        mesh.at_lattice(state.displacement),
        input_forces(part, mesh, state),
        energy=float(energy(mesh, state.displacement, linear=linear).sum()),
        stress=float(stress.max()),
        strain=float(strain.max()),
    )


def input_forces(part: Part, mesh: FrameMesh, state: FrameState) -> NDArray[np.float64]:
    """Return (i, 2) the forces on the input nodes, N; 0 for nodes without struts."""
    given = part.design.problem.input
    nodes = mesh.node[given.nodes]
    present = (nodes >= 0)[:, None]
    if given.drive == "displacement":
        return np.where(present, state.reaction[nodes, :2], 0.0)
    force = state.load * given.amount * part.stiffness_unit * part.scale
    return np.where(present, force * given.direction, 0.0)


def fibre_stress_and_strain(
    part: Part, mesh: FrameMesh, displacement: NDArray[np.float64], *, linear: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (e,) the largest absolute stress of each element, MPa, and its largest strain.

    Both are those of the outermost fibres. Stress is uniaxial, so that its absolute value is the
    von Mises stress.
    """
    strain = strain_of(mesh, displacement, linear=linear)
    forces = np.einsum("eij,ej->ei", mesh.stiffness, strain)
    section, young = part.section, part.material.young
    bending = np.abs(forces[:, 1:]).max(axis=1) * section.width / (2.0 * young * section.inertia)
    axial = strain[:, 0] / mesh.length
    # Compression in one direction is extension across it.
    across = part.material.poisson * (bending - axial)
    return young * (np.abs(axial) + bending), np.maximum(axial + bending, across)


def contacts_of(part: Part, mesh: FrameMesh, states: Sequence[FrameState]) -> Contacts:
    """Find the struts that touch in any equilibrium of the path."""
    struts, lines = mesh.lines()
    stroke = ((state.load, (mesh.positions + state.displacement[:, :2])[lines]) for state in states)
    return find_contacts(struts, mesh.positions[lines], stroke, part.section.width)


def field_of(part: Part, mesh: FrameMesh, state: FrameState, *, linear: bool) -> Field:
    """Return a state for pictures and files."""
    stress, _ = fibre_stress_and_strain(part, mesh, state.displacement, linear=linear)
    return Field(mesh.positions, state.displacement[:, :2], mesh.elements, stress)
