"""Level A: a part as a frame of beams with rigid joints, along the whole stroke."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.fem.contact import find_contacts
from bellcrank.fem.frame.elements import energy, strain_of
from bellcrank.fem.frame.equilibrium import FrameEquations, solve_linear
from bellcrank.fem.frame.mesh import frame_mesh, theories
from bellcrank.fem.frame.settling import settle
from bellcrank.fem.frame.system import frame_system
from bellcrank.fem.levels import Level, levels
from bellcrank.fem.path import Follower, PathStatus, Stepping
from bellcrank.fem.results import Analysis, Field, StrokePoint, stroke_point

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bellcrank.fem.contact import Contacts
    from bellcrank.fem.frame.equilibrium import FrameState
    from bellcrank.fem.frame.mesh import FrameMesh
    from bellcrank.fem.levels import FemSettings
    from bellcrank.fem.path import Path
    from bellcrank.part.part import Part

SNAPS = 5
"""Jumps after which nobody wants to know where the part ends."""


def check_frame(_part: Part, settings: FemSettings) -> None:
    """Refuse an unknown theory."""
    theories[settings.theory]


def analyse_frame(part: Part, settings: FemSettings, tell: Callable[[float], None]) -> Analysis:
    """Analyse a part as a frame.

    Raises
    ------
    InvalidSettings
        If a piece of it is not held, in a linear analysis.
    """
    began = time.perf_counter()
    mesh = frame_mesh(part, settings.elements, settings.theory)
    system = frame_system(part, mesh)
    equations = FrameEquations(system)
    status, loss, after = PathStatus.CONVERGED, None, None
    if settings.linear:
        try:
            states = [solve_linear(system)]
        except RuntimeError:
            raise InvalidSettings(
                f"the part cannot be analysed: {PathStatus.MECHANISM.message}"
            ) from None
        factorisations = 1
    else:
        path = Follower(equations, Stepping(), lambda state: tell(state.load)).follow()
        states = [equations.complete(state) for state in path.states]
        status, loss, factorisations = path.status, path.loss, path.factorisations
        if status is PathStatus.SNAPPED:
            after = beyond(equations, path)
    last = states[-1]
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
        after=point_of(part, mesh, after) if after else None,
        contacts=contacts_of(part, mesh, states),
        field=field_of(part, mesh, last, linear=settings.linear),
        cost={
            "seconds": time.perf_counter() - began,
            "unknowns": equations.count,
            "factorisations": factorisations,
        },
    )


levels.register("frame")(Level(analyse_frame, check_frame))


def beyond(equations: FrameEquations, path: Path) -> FrameState | None:
    """Return where a frame is at the full input, after all its jumps; None if that is not found."""
    for _ in range(SNAPS):
        landed = settle(equations, path.states[-1])
        if landed is None:
            return None
        path = Follower(equations, Stepping()).follow(landed)
        if path.status is PathStatus.CONVERGED:
            return equations.complete(path.states[-1])
        if path.status is not PathStatus.SNAPPED:
            return None
    return None


def point_of(
    part: Part, mesh: FrameMesh, state: FrameState, *, linear: bool = False
) -> StrokePoint:
    """Return the figures of an equilibrium."""
    stress, strain = fibres(part, mesh, state.displacement, linear=linear)
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
    """Return (i, 2) what pushes each input node, N; 0 where no strut is."""
    given = part.design.problem.input
    nodes = mesh.node[given.nodes]
    there = (nodes >= 0)[:, None]
    if given.drive == "displacement":
        return np.where(there, state.reaction[nodes, :2], 0.0)
    force = state.load * given.amount * part.stiffness_unit * part.scale
    return np.where(there, force * given.direction, 0.0)


def fibres(
    part: Part, mesh: FrameMesh, displacement: NDArray[np.float64], *, linear: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (e,) the largest stress in size, MPa, and the largest principal strain.

    Stress is uniaxial, so its size is the von Mises stress as well.
    """
    strain = strain_of(mesh, displacement, linear=linear)
    inner = np.einsum("eij,ej->ei", mesh.stiffness, strain)
    section, young = part.section, part.material.young
    bent = np.abs(inner[:, 1:]).max(axis=1) * section.width / (2.0 * young * section.inertia)
    stretched = strain[:, 0] / mesh.length
    # What is pressed together one way grows the other.
    widened = part.material.poisson * (bent - stretched)
    return young * (np.abs(stretched) + bent), np.maximum(stretched + bent, widened)


def contacts_of(part: Part, mesh: FrameMesh, states: Sequence[FrameState]) -> Contacts:
    """Find the struts that touch in any equilibrium of the path."""
    struts, lines = mesh.lines()
    stroke = ((state.load, (mesh.positions + state.displacement[:, :2])[lines]) for state in states)
    return find_contacts(struts, mesh.positions[lines], stroke, part.section.width)


def field_of(part: Part, mesh: FrameMesh, state: FrameState, *, linear: bool) -> Field:
    """Return what pictures need."""
    stress, _ = fibres(part, mesh, state.displacement, linear=linear)
    return Field(mesh.positions, state.displacement[:, :2], mesh.elements, stress)
