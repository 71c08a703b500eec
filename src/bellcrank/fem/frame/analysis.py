"""The whole analysis of a part as a frame: along the stroke, and over a snap if there is one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bellcrank.fem.frame.elements import energy
from bellcrank.fem.frame.mesh import frame_mesh
from bellcrank.fem.frame.path import FrameState, PathStatus, follow, solve_linear
from bellcrank.fem.frame.results import efficiency_of, fibres_of, motion_of
from bellcrank.fem.frame.system import frame_system

if TYPE_CHECKING:
    from bellcrank.fem.frame.mesh import FrameMesh
    from bellcrank.fem.part import Part

BEYOND = 2e-3
"""Part of the stroke by which a frame is pushed over the edge of its stability."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameSettings:
    """How a part is analysed as a frame.

    Parameters
    ----------
    elements
        In each strut.
    theory
        Name in the registry of theories.
    linear
        Small motions only.
    """

    elements: int = 8
    theory: str = "euler-bernoulli"
    linear: bool = False


@dataclass(frozen=True, slots=True)
class StrokePoint:
    """An equilibrium along the stroke.

    Parameters
    ----------
    stroke
        Part of the full input.
    efficiency
    mean_output : (2,)
        Mean motion of the output nodes, mm.
    input_force : (2,)
        Sum over the input nodes, N.
    energy
        N mm.
    strain, stress
        The largest of any fibre, and in MPa.
    """

    stroke: float
    efficiency: float
    mean_output: tuple[float, float]
    input_force: tuple[float, float]
    energy: float
    strain: float
    stress: float


@dataclass(frozen=True, slots=True, eq=False)
class FrameAnalysis:
    """What became of a part.

    Parameters
    ----------
    status
        `converged` if it is stable all along the stroke; of the last point otherwise.
    points
        From rest on; those after a snap are not among them.
    mesh, state
        The last stable equilibrium.
    """

    part: Part
    settings: FrameSettings
    status: PathStatus
    points: list[StrokePoint]
    mesh: FrameMesh
    state: FrameState

    @property
    def efficiency(self) -> float:
        """At the end of the stroke, or where stability was lost."""
        return self.points[-1].efficiency


def analyse_frame(part: Part, settings: FrameSettings | None = None) -> FrameAnalysis:
    """Analyse a part as a frame."""
    settings = settings or FrameSettings()
    mesh = frame_mesh(part, settings.elements, settings.theory)
    system = frame_system(part, mesh)
    if settings.linear:
        states, status = [solve_linear(system)], PathStatus.CONVERGED
    else:
        path = follow(system)
        states, status = path.states[1:] or path.states, path.status
    points = [point_of(part, mesh, state) for state in states]
    return FrameAnalysis(part, settings, status, points, mesh, states[-1])


def point_of(part: Part, mesh: FrameMesh, state: FrameState) -> StrokePoint:
    """Return the figures of an equilibrium."""
    problem = part.design.problem
    moved = motion_of(mesh, state)
    fibres = fibres_of(part, mesh, state)
    nodes = mesh.node[problem.input.nodes]
    force = state.reaction[nodes[nodes >= 0], :2].sum(axis=0)
    mean = moved[problem.output.nodes].mean(axis=0)
    return StrokePoint(
        state.load, efficiency_of(part, moved), (float(mean[0]), float(mean[1])),
        (float(force[0]), float(force[1])), float(energy(mesh, state.displacement).sum()),
        float(fibres.strain.max()), float(fibres.stress.max()),
    )  # fmt: skip
