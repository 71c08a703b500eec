"""The level `frame`: analysis of a part as a frame of beams with rigid joints."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.fem.contact import find_contacts
from bellcrank.fem.frame.equations import FrameEquations, part_frame
from bellcrank.fem.frame.space import analyse_in_space, check_in_space
from bellcrank.fem.levels import Level, levels
from bellcrank.fem.path import PathStatus, follow_path
from bellcrank.fem.results import Analysis, Field, StrokePoint, stroke_point
from bellcrank.mechanics.frames.analysis import without_ends
from bellcrank.mechanics.frames.beams import theories
from bellcrank.mechanics.output import best_fit_rotation

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bellcrank.fem.contact import Contacts
    from bellcrank.fem.frame.equations import FrameState, PartFrame
    from bellcrank.fem.levels import FemSettings
    from bellcrank.part.part import Part


def check_frame(part: Part, settings: FemSettings) -> None:
    """Raise an error for an unknown beam theory, and for a linear analysis in space."""
    theories[settings.theory]
    if part.dimension == 3:
        check_in_space(settings)


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
    if part.dimension == 3:
        return analyse_in_space(part, settings, report)
    began = time.perf_counter()
    frame = part_frame(part, settings.elements, settings.theory)
    equations = FrameEquations(frame)
    status, loss = PathStatus.CONVERGED, None
    if settings.linear:
        try:
            states = [equations.solve_linear()]
        except RuntimeError:
            raise InvalidSettings(
                f"the part cannot be analysed: {PathStatus.MECHANISM.message}"
            ) from None
        factorisations = 1
    else:
        path = follow_path(equations, report=lambda state: report(state.load))
        states = [equations.complete(state) for state in path.states]
        status, loss, factorisations = path.status, path.loss, path.factorisations
    return Analysis(
        part=part,
        level="frame",
        theory=settings.theory,
        linear=settings.linear,
        status=status,
        loss=loss,
        points=[point_of(part, frame, state) for state in states if state.load or len(states) == 1],
        contacts=contacts_of(part, frame, states),
        field=field_of(part, frame, states[-1]),
        cost={
            "seconds": time.perf_counter() - began,
            "unknowns": equations.count,
            "factorisations": factorisations,
        },
    )


levels.register("frame")(Level(analyse_frame, check_frame, title="Frame", duration="seconds"))


def point_of(part: Part, frame: PartFrame, state: FrameState) -> StrokePoint:
    """Return the figures of an equilibrium."""
    stress, strain = fibre_stress_and_strain(part, frame, state)
    problem = part.design.problem
    force = state.reaction + frame.load_at(state.load)
    motion, output = state.displacement[: len(part.positions)], problem.output.nodes
    if len(output) == 1:
        rotation = np.degrees(motion[output[0], 2])
    else:
        rotation = best_fit_rotation(part.positions[output], motion[output, :2])
    return stroke_point(
        part,
        state.load,
        motion[:, :2],
        force[problem.input.nodes, :2],
        rotation,
        energy=energy(frame, state),
        stress=float(stress.max()),
        strain=float(strain.max()),
    )


def energy(frame: PartFrame, state: FrameState) -> float:
    """Return the elastic energy of the struts, N mm."""
    axial, first, second = state.resultants.T
    extension, own1, other, own2 = frame.stiffness.T
    bending = own2 * first**2 + own1 * second**2 - 2.0 * other * first * second
    return float((axial**2 / extension + bending / (own1 * own2 - other**2)).sum() / 2.0)


def fibre_stress_and_strain(
    part: Part, frame: PartFrame, state: FrameState
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (e,) the largest absolute stress of each element, MPa, and its largest strain.

    Both are those of the outermost fibres. Stress is uniaxial, so that its absolute value is the
    von Mises stress.
    """
    section, young = part.section, part.material.young
    length = np.linalg.norm(frame.rest, axis=1)[:, None]
    moment = np.abs(without_ends(state.resultants[:, 1:], frame.rigid / length)).max(axis=1)
    ratio = np.repeat(part.width_ratios, len(frame.elements) // len(frame.struts))
    bending = moment * section.width / (2.0 * young * section.inertia * ratio**2)
    axial = state.resultants[:, 0] / (young * section.area * ratio)
    # Compression in one direction is extension across it.
    across = part.material.poisson * (bending - axial)
    return young * (np.abs(axial) + bending), np.maximum(axial + bending, across)


def contacts_of(part: Part, frame: PartFrame, states: Sequence[FrameState]) -> Contacts:
    """Find the struts that touch in any equilibrium of the path."""
    rest = frame.positions[frame.lines]
    stroke = ((state.load, rest + state.displacement[frame.lines, :2]) for state in states)
    return find_contacts(frame.struts, rest, stroke, part.widths)


def field_of(part: Part, frame: PartFrame, state: FrameState) -> Field:
    """Return a state for pictures and files, without the nodes that have no struts."""
    nodes, elements = np.unique(frame.elements, return_inverse=True)
    stress, _ = fibre_stress_and_strain(part, frame, state)
    return Field(
        frame.positions[nodes],
        state.displacement[nodes, :2],
        elements.reshape(-1, 2),
        stress,
    )
