"""Level A: a part as a frame of beams with rigid joints, along the whole stroke."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.fem.contact import find_contacts
from bellcrank.fem.frame.elements import energy, linear_natural, natural
from bellcrank.fem.frame.equilibrium import FrameEquations, solve_linear
from bellcrank.fem.frame.mesh import frame_mesh
from bellcrank.fem.frame.settling import settle
from bellcrank.fem.frame.system import frame_system
from bellcrank.fem.levels import levels
from bellcrank.fem.path import Follower, PathStatus, Stepping
from bellcrank.fem.results import Analysis, Field, StrokePoint
from bellcrank.mechanics import efficiency_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.fem.contact import Contacts
    from bellcrank.fem.frame.equilibrium import FrameState
    from bellcrank.fem.frame.mesh import FrameMesh
    from bellcrank.fem.levels import FemSettings
    from bellcrank.fem.path import Path
    from bellcrank.parts.part import Part

SNAPS = 5
"""Jumps after which nobody wants to know where the part ends."""


@levels.register("frame")
def analyse_frame(
    part: Part, settings: FemSettings, tell: Callable[[float], None] = lambda _load: None
) -> Analysis:
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
        contacts=contacts_of(part, mesh, last),
        field=field_of(part, mesh, last, linear=settings.linear),
        cost={
            "seconds": time.perf_counter() - began,
            "unknowns": equations.count,
            "factorisations": factorisations,
        },
    )


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
    problem = part.design.problem
    moved = mesh.at_lattice(state.displacement)
    stress, strain = fibres(part, mesh, state.displacement, linear=linear)
    mean = moved[problem.output.nodes].mean(axis=0)
    force = input_force(part, mesh, state)
    return StrokePoint(
        load=state.load,
        efficiency=efficiency_of(problem, moved / part.scale, load=state.load),
        output=(float(mean[0]), float(mean[1])),
        force=(float(force[0]), float(force[1])),
        energy=float(energy(mesh, state.displacement, linear=linear).sum()),
        stress=float(stress.max()),
        strain=float(strain.max()),
    )


def input_force(part: Part, mesh: FrameMesh, state: FrameState) -> NDArray[np.float64]:
    """Return (2,) what pushes the input, N."""
    given = part.design.problem.input
    if given.drive == "displacement":
        nodes = mesh.node[given.nodes]
        pushed: NDArray[np.float64] = state.reaction[nodes[nodes >= 0], :2].sum(axis=0)
        return pushed
    force = state.load * given.amount * part.stiffness_unit * part.scale
    total: NDArray[np.float64] = force * given.direction[mesh.node[given.nodes] >= 0].sum(axis=0)
    return total


def fibres(
    part: Part, mesh: FrameMesh, displacement: NDArray[np.float64], *, linear: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (e,) the largest stress in size, MPa, and the largest principal strain.

    Stress is uniaxial, so its size is the von Mises stress as well.
    """
    small = linear_natural(mesh, displacement) if linear else None
    strain = natural(mesh, displacement)[0] if small is None else small
    inner = np.einsum("eij,ej->ei", mesh.stiffness, strain)
    section, young = part.section, part.material.young
    bent = np.abs(inner[:, 1:]).max(axis=1) * section.width / (2.0 * young * section.inertia)
    stretched = strain[:, 0] / mesh.length
    # What is pressed together one way grows the other.
    widened = part.material.poisson * (bent - stretched)
    return young * (np.abs(stretched) + bent), np.maximum(stretched + bent, widened)


def contacts_of(part: Part, mesh: FrameMesh, state: FrameState) -> Contacts:
    """Find the struts that touch."""
    struts, lines = mesh.lines()
    moved = mesh.positions + state.displacement[:, :2]
    return find_contacts(struts, mesh.positions[lines], moved[lines], part.section.width)


def field_of(part: Part, mesh: FrameMesh, state: FrameState, *, linear: bool) -> Field:
    """Return what pictures need."""
    stress, _ = fibres(part, mesh, state.displacement, linear=linear)
    return Field(mesh.positions, state.displacement[:, :2], mesh.elements, stress)
